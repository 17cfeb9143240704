"""Compares the speed of andabata and of installed peers: same scene, in turns, in one run."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.bench import speed_peers
from andabata.bench.chain import driving
from andabata.bench.filter import MODEL, STANDING_IMU, initial_belief, predict_and_correct
from andabata.bench.perception_peers import PEERS
from andabata.bench.reporter import Reporter
from andabata.bench.speed_peers import Work
from andabata.bench.table import Row, benchmark_row
from andabata.datasets.labelled_cloud import CloudsConfig, labelled_cloud
from andabata.localization.sigma_points import Workspace
from andabata.machine.beam_rays import beam_rays
from andabata.machine.beams import BeamTables
from andabata.machine.clock import CONTROL_PERIOD
from andabata.machine.lidar import LidarConfig, RotatingLidar
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import Sweeps
from andabata.models import shipped_forest, shipped_policy
from andabata.tasks.maze import MazeVectorEnv
from andabata.tasks.offroad import OffroadConfig, stage_config
from andabata.tasks.vector import OffroadVectorEnv, make_vector
from rl.sac import SacConfig, SoftActorCritic
from rl.spaces import steering_actions, steering_observations
from rl.training import EpisodeSpec, play_together
from traversability.features import cell_features
from traversability.grid import PolarGrid
from traversability.scanner import TraversabilityScanner
from worlds.scenes import Scene, SceneCache
from worlds.splits import evaluation_world
from worlds.world import World

OURS = "andabata"
"""Name of this project in the tables."""

_SWEEPS = 4
"""Number of sweeps in a control period of the paper's laser."""

_FILTER_STEPS, _PEER_FILTER_STEPS, _FLAT_STEPS, _IRSIM_STEPS, _LOOP_STEPS = 2000, 50, 300, 100, 300
"""Numbers of steps in one call of the work."""


@dataclass(frozen=True)
class Contender:
    """Implementation of a case.

    Attributes:
        subject: Name for tables.
        amount: Units of work in one call.
        make: Function that prepares the work and returns it as a call; raises ImportError if the
            peer is not installed.
    """

    subject: str
    amount: float
    make: Callable[[], Work]


@dataclass(frozen=True)
class Case:
    """Kind of work with its contenders.

    Attributes:
        name: Name for tables.
        unit: Unit of the speed.
        contenders: Contenders, ours first.
    """

    name: str
    unit: str
    contenders: tuple[Contender, ...]


def bench_speed(
    world: str, seed: int, runs: int, seconds: float, only: str, reporter: Reporter
) -> list[Row]:
    """Return the rows of all cases whose name contains a text.

    Args:
        world: World preset; the world is one of the evaluation's.
        seed: Seed of world and noise.
        runs: Number of turns.
        seconds: Shortest duration of a turn of one contender [s].
        only: Part of the names of the cases to run.
        reporter: Receiver of the cases' names and of the peers that are left out.

    Raises:
        ValueError: If no case is named so.
    """
    rows: list[Row] = []
    names = []
    for case in make_cases(world, seed):
        names.append(case.name)
        if only in case.name:
            reporter.status(case.name)
            rows += run_case(case, runs, seconds, reporter.status)
    if not rows:
        raise ValueError(f"only: expected part of one of {', '.join(names)}, got {only!r}")
    return rows


def run_case(case: Case, runs: int, seconds: float, status: Callable[[str], None]) -> list[Row]:
    """Return one row for each contender that is installed: the median over turns.

    The contenders take turns, so that a busy machine slows all of them.

    Args:
        case: Work and its contenders.
        runs: Number of turns.
        seconds: Shortest duration of a turn of one contender [s].
        status: Function that is called with a message for each contender that is left out.
    """
    works: list[tuple[Contender, Work]] = []
    for contender in case.contenders:
        try:
            work = contender.make()
        except ImportError as error:
            status(f"{contender.subject}: left out, {error.name} is not installed (extra `peers`)")
            continue
        work()  # Compiled code is compiled, caches are warm.
        works.append((contender, work))
    speeds: dict[str, list[float]] = {contender.subject: [] for contender, _ in works}
    for _ in range(runs):
        for contender, work in works:
            speeds[contender.subject].append(contender.amount / _seconds_of(work, seconds))
    ours = float(np.median(speeds[works[0][0].subject]))
    rows = []
    for subject, values in speeds.items():
        median = float(np.median(values))
        row = benchmark_row(case.name, subject, median, case.unit, runs, median / ours)
        rows.append(row | {"low": min(values), "high": max(values)})
    return rows


def _seconds_of(work: Work, seconds: float) -> float:
    """Return the mean duration of a call [s], which is called for at least ``seconds``."""
    spent, calls, turn = 0.0, 0, time.perf_counter()
    while calls == 0 or time.perf_counter() - turn < seconds:
        began = time.perf_counter()
        own = work()
        spent += own if isinstance(own, float) else time.perf_counter() - began
        calls += 1
    return spent / calls


def speed_table(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of ``bench_speed`` as a table for people."""
    return [
        {
            "work": row["name"],
            "subject": row["subject"],
            "speed": f"{row['value']:.4g} {row['unit']}",
            "ratio to ours": f"{row['ratio_to_ours']:.3g}",
            "least to most": f"{row['low']:.4g} to {row['high']:.4g}",
        }
        for row in rows
    ]


def make_cases(world: str, seed: int) -> Iterator[Case]:
    """Yield every case; its scene is made when it is asked for.

    Args:
        world: World preset; the world is one of the evaluation's.
        seed: Seed of world and noise.
    """
    from rl.networks import use_one_thread

    use_one_thread()
    scenes = SceneCache()
    scene = scenes.get(world, evaluation_world(seed, 0))
    yield _laser_case(scene, seed)
    maze = scenes.get("maze", evaluation_world(seed, 0))
    yield _flat_case(maze, evaluation_world(seed, 0), scenes)
    yield from _cloud_cases(scene, seed)
    yield _filter_case()
    yield from _loop_cases(scene, seed)
    yield _training_case(scenes)
    yield _many_robots_case(world, seed, scenes)


def _laser_case(scene: Scene, seed: int) -> Case:
    """Return the laser: four sweeps of a robot that stands still in a natural world."""
    config, robot = LidarConfig(), RobotModel()
    track = _standing(scene.world)
    stamps = np.arange(_SWEEPS) / config.sweep_hz
    sweeps = Sweeps(
        stamps,
        stamps * config.head_rate,
        config.head_rate,
        config.beam_period,
        config.elevations(0, 1),
        np.full((_SWEEPS, config.beams), np.inf, dtype=np.float32),
    )
    rays = beam_rays(sweeps, track, robot.lidar_height, BeamTables())[0].copy()
    reach = SimulatedRobotConfig().assembly.sight
    budgets = np.random.default_rng(seed).standard_exponential(len(rays), dtype=np.float32)
    lidar = RotatingLidar(scene.rays, config, robot, np.random.default_rng(seed), reach)
    end, n = _SWEEPS / config.sweep_hz, len(rays)
    return Case(
        "laser",
        "rays/s",
        (
            Contender(
                f"{OURS}: sweeps with poses, plants, noise, labels",
                n,
                lambda: lambda: lidar.sweeps(0.0, end, track),
            ),
            Contender(
                f"{OURS}: rays within reach",
                n,
                lambda: lambda: scene.rays.cast(rays, budgets, reach),
            ),
            Contender(
                f"{OURS}: rays without end",
                n,
                lambda: lambda: scene.rays.cast(rays, budgets),
            ),
            Contender(
                "embree (open3d), first hit", n, partial(speed_peers.embree_rays, scene.world, rays)
            ),
            Contender(
                "pybullet, without plants", n, partial(speed_peers.pybullet_rays, scene.world, rays)
            ),
            Contender(
                "mujoco, without plants",
                n // _SWEEPS,
                partial(speed_peers.mujoco_rays, scene.world, rays[: n // _SWEEPS]),
            ),
        ),
    )


def _standing(world: World) -> PoseTrack:
    """Return the track of a robot that stands still at the world's first start."""
    start, track = world.tasks[0].start, PoseTrack()
    z = float(world.ground.height_at(start.x, start.y))
    pose = Pose.from_euler(np.array([start.x, start.y, z]), 0.0, 0.0, start.yaw)
    for stamp in (0.0, 10.0):
        track.append(stamp, pose.position, pose.quaternion)
    return track


def _flat_case(scene: Scene, world_seed: int, scenes: SceneCache) -> Case:
    """Return the simulation of stage 1: robots with 32 horizontal beams in a maze."""
    config = stage_config("Maze2D").model_copy(update={"seeds": (world_seed,), "heading": "goal"})
    count = 64

    def ours() -> Work:
        robots = MazeVectorEnv(config, count, scenes)
        robots.reset(seed=0)
        draws = np.random.default_rng(0).uniform(-0.6, 0.6, (_FLAT_STEPS, count, 1))
        actions = draws.astype(np.float32)
        return lambda: [robots.step(action) for action in actions]

    return Case(
        "maze in 2D, 32 beams",
        "steps/s",
        (
            Contender(f"{OURS}: {count} robots", count * _FLAT_STEPS, ours),
            Contender(
                "ir-sim, nothing drawn",
                _IRSIM_STEPS,
                partial(speed_peers.irsim_steps, scene.world, 32, _IRSIM_STEPS),
            ),
        ),
    )


def _cloud_cases(scene: Scene, seed: int) -> Iterator[Case]:
    """Yield the stages of classification: virtual scan, features, trees."""
    forest = shipped_forest()
    rng = np.random.default_rng(seed)
    cloud = labelled_cloud(scene, CloudsConfig(), rng, scene.world.tasks[0].start)
    points = cloud.points

    def ours() -> Work:
        scanner = TraversabilityScanner(forest)
        return lambda: scanner.scan(points)

    methods = [
        Contender(peer.name, 1, partial(_method, peer.make, peer.name, points, forest.grid))
        for peer in PEERS
        if peer.name != "quantile rule"
    ]
    yield Case("cloud to virtual scan", "clouds/s", (Contender(OURS, 1, ours), *methods))
    yield Case(
        "features of a cloud",
        "clouds/s",
        (
            Contender(f"{OURS}: cells", 1, lambda: lambda: cell_features(points, forest.grid)),
            Contender(
                "jakteristics: points", 1, partial(speed_peers.jakteristics_features, points)
            ),
        ),
    )
    cells = cell_features(points, forest.grid)
    features = np.repeat(cells.values.reshape(-1, cells.values.shape[-1]), 16, axis=0)
    features = np.ascontiguousarray(features[np.isfinite(features).all(axis=1)])
    blocked = forest.predict_proba(features) >= 0.5
    yield Case(
        "trees",
        "cells/s",
        (
            Contender(OURS, len(features), lambda: lambda: forest.predict_proba(features)),
            Contender(
                "onnxruntime", len(features), partial(speed_peers.onnx_forest, forest, features)
            ),
            Contender(
                "scikit-learn, as many trees",
                len(features),
                partial(speed_peers.sklearn_forest, forest, features, blocked),
            ),
        ),
    )


def _method(
    make: Callable[..., Callable[[NDArray[np.float32]], NDArray[np.bool_]]],
    name: str,
    points: NDArray[np.float32],
    grid: PolarGrid,
) -> Work:
    """Return a peer that labels obstacle points."""
    obstacles = make(grid=grid, **speed_peers.settings_of(name))
    return lambda: obstacles(points)


def _filter_case() -> Case:
    """Return the filter: predictions, each with a correction by gravity."""

    def ours() -> Work:
        x, P = initial_belief()
        workspace = Workspace.allocate()
        return lambda: predict_and_correct(_FILTER_STEPS, x, P, STANDING_IMU, MODEL, workspace)

    return Case(
        "filter of 18 numbers",
        "steps/s",
        (
            Contender(OURS, _FILTER_STEPS, ours),
            Contender(
                "filterpy",
                _PEER_FILTER_STEPS,
                partial(speed_peers.filterpy_steps, _PEER_FILTER_STEPS),
            ),
        ),
    )


def _loop_cases(scene: Scene, seed: int) -> Iterator[Case]:
    """Yield the whole control loop, from plant to policy, for all plants."""
    for plant in ("kinematic", "wheels", "bullet"):
        yield Case(
            f"whole loop, {plant}",
            "robot-seconds/s",
            tuple(
                Contender(
                    f"{OURS}: {beams} beams",
                    _LOOP_STEPS * CONTROL_PERIOD,
                    partial(_loop, scene, plant, beams, seed),
                )
                for beams in (1081, 541)
            ),
        )


def _loop(scene: Scene, plant: str, beams: int, seed: int) -> Work:
    """Return a drive, whose time [s] does not include its run-in to the first clouds."""
    lidar = LidarConfig(beams=beams)
    config = SimulatedRobotConfig.model_validate({"plant": plant, "sensing": {"lidar": lidar}})

    def work() -> float:
        with driving(scene, config, "policy+planner", seed) as (_, advance):
            began = time.perf_counter()
            advance(_LOOP_STEPS)
            return time.perf_counter() - began

    return work


def _training_case(scenes: SceneCache) -> Case:
    """Return the training of stage 1: control steps and the gradient steps after them."""
    config = stage_config("Maze2D").model_copy(update={"seeds": (0,)})

    def ours() -> Work:
        robots = MazeVectorEnv(config, 8, scenes, autoreset=False)
        robot, grid = config.simulated_robot.robot, config.simulated_robot.grid
        observations = steering_observations(grid.n_sectors, grid.outer_radius, robot.max_steering)
        actions = steering_actions(robot.max_steering)
        learner = SoftActorCritic(observations, actions, SacConfig(), 0)
        rng = np.random.default_rng(0)

        def work() -> float:
            began = time.perf_counter()
            tasks = [EpisodeSpec(0, (0, int(number))) for number in rng.integers(2**31, size=8)]
            behaviour = learner.behaviour_policy()
            played = play_together(robots, behaviour, learner.config.action_repeat, tasks)
            learner.update(played, rng)
            return (time.perf_counter() - began) / sum(episode.steps for episode in played)

        return work

    return Case("training, stage 1", "steps/s", (Contender(OURS, 1, ours),))


def _many_robots_case(world: str, seed: int, scenes: SceneCache) -> Case:
    """Return many robots in one world, each with rotating laser, filter and classifier.

    They make a virtual scan at every control step, and in the last rows once a decision, as in the
    default training, with the planner and in the whole loop of one robot.

    Args:
        world: World preset.
        seed: Seed of the evaluation's world.
        scenes: Cache of scenes.
    """
    stage = stage_config("Natural")
    config = stage.model_copy(update={"preset": world, "seeds": (evaluation_world(seed, 0),)})
    every = config.simulated_robot.rollouts.action_repeat
    decimated = config.model_copy(update={"perception_decimation": every})

    def make_robots(count: int, workers: int, config: OffroadConfig = config) -> Work:
        if workers == 1:
            robots: VectorEnv[Any, Any, Any] = make_vector("Natural", count, config, 1, scenes)
        else:
            robots = OffroadVectorEnv(config, count, workers)
        states, _ = robots.reset(seed=0)
        # Whole decisions, so that each call holds as many scans.
        policy, steps = shipped_policy(), every * max(1, 12 // count)

        def work() -> float:
            nonlocal states
            began = time.perf_counter()
            for _ in range(steps):
                shares = [policy.best(state) for state in states]
                states, *_ = robots.step(np.array(shares, dtype=np.float32))
            return (time.perf_counter() - began) / steps

        return work

    sizes = ((1, 1), (4, 1), (16, 1), (64, 1), (16, 2), (64, 2))
    return Case(
        "robots in one world",
        "robot-seconds/s",
        (
            *(
                Contender(
                    f"{OURS}: {count} in {workers} process{'es' * (workers > 1)}",
                    count * CONTROL_PERIOD,
                    partial(make_robots, count, workers),
                )
                for count, workers in sizes
            ),
            *(
                Contender(
                    f"{OURS}: {count} in 1 process, a scan in {every} steps",
                    count * CONTROL_PERIOD,
                    partial(make_robots, count, 1, decimated),
                )
                for count in (1, 16)
            ),
        ),
    )
