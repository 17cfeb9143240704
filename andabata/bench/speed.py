"""Speed, ours and the peers' that are installed: the same scene, in turns, in one run."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.bench import speed_peers as peers_
from andabata.bench.chain import STEP, driving
from andabata.bench.perception_peers import PEERS
from andabata.bench.speed_peers import Work
from andabata.datasets.labelled_cloud import CloudsConfig, labelled_cloud
from andabata.localization.process_model import (
    STATES,
    Body,
    Noise,
    Room,
    Weights,
    predict,
    see_gravity,
)
from andabata.machine.beams import BeamTables, beam_rays
from andabata.machine.lidar import LidarConfig, RotatingLidar
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import Sweeps
from andabata.models import shipped_forest, shipped_policy
from andabata.tasks.offroad import stage_config
from andabata.tasks.planar import FlatVectorEnv
from andabata.tasks.vector import OffroadVectorEnv, make_vector
from rl.sac import SacConfig, SoftActorCritic
from rl.spaces import ObservationLayout
from rl.training import EpisodeSpec, play_together
from terrain.kernel import kernel
from traversability.features import cell_features
from traversability.scanner import TraversabilityScanner
from worlds.scenes import Scene, SceneCache
from worlds.splits import evaluation_world
from worlds.world import World

OURS = "andabata"

_SWEEPS = 4
"""Sweeps of a control period of the paper's laser."""

_FILTER_STEPS, _PEER_FILTER_STEPS, _FLAT_STEPS, _IRSIM_STEPS, _LOOP_STEPS = 2000, 50, 300, 100, 300


@dataclass(frozen=True)
class Contender:
    """One of those who do the same work.

    Attributes:
        subject: Whose.
        amount: Units of work that a call does.
        make: Sets up and returns the call; ImportError when the peer is not installed.
    """

    subject: str
    amount: float
    make: Callable[[], Work]


@dataclass(frozen=True)
class Case:
    """A kind of work, and who does it; ours comes first.

    Attributes:
        name: For tables.
        unit: What is counted, in a second.
        contenders: Ours, then the peers.
    """

    name: str
    unit: str
    contenders: tuple[Contender, ...]


def race(
    contest: Case, runs: int, seconds: float, status: Callable[[str], None]
) -> list[dict[str, Any]]:
    """Return one row for each runner that is installed: the median of runs in turns.

    Args:
        contest: Who does what.
        runs: Turns.
        seconds: What a turn of one runner takes at least [s].
        status: Told who is left out.
    """
    works: list[tuple[Contender, Work]] = []
    for contender in contest.contenders:
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
            spent, calls, turn = 0.0, 0, time.perf_counter()
            while calls == 0 or time.perf_counter() - turn < seconds:
                began = time.perf_counter()
                own = work()
                spent += own if isinstance(own, float) else time.perf_counter() - began
                calls += 1
            speeds[contender.subject].append(contender.amount * calls / spent)
    ours = float(np.median(speeds[works[0][0].subject]))
    rows = []
    for contender, _ in works:
        values = np.array(speeds[contender.subject])
        rows.append(
            {
                "name": contest.name,
                "subject": contender.subject,
                "value": float(np.median(values)),
                "unit": contest.unit,
                "ratio_to_ours": float(np.median(values)) / ours,
                "runs": runs,
                "low": float(values.min()),
                "high": float(values.max()),
            }
        )
    return rows


def races(world: str, seed: int) -> Iterator[Case]:
    """Yield every kind of work; scenes are set up when they are asked for.

    Args:
        world: Preset; the world is one of the judges'.
        seed: Of world and noise.
    """
    from rl.networks import use_one_thread

    use_one_thread()
    scenes = SceneCache()
    scene = scenes.get(world, evaluation_world(seed, 0))
    yield _ray_race(scene, seed)
    maze = scenes.get("maze", evaluation_world(seed, 0))
    yield _flat_race(maze, evaluation_world(seed, 0), scenes)
    yield from _cloud_races(scene, seed)
    yield _filter_race()
    yield from _loop_races(scene, seed)
    yield _training_race(scenes)
    yield _crowd_race(world, seed, scenes)


def _ray_race(scene: Scene, seed: int) -> Case:
    """Return the laser's work: four sweeps of a robot that stands in a natural world."""
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
    rays = beam_rays(sweeps, track, robot.lidar_height, BeamTables()).copy()
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
                "embree (open3d), first hit", n, partial(peers_.embree_rays, scene.world, rays)
            ),
            Contender(
                "pybullet, without plants", n, partial(peers_.pybullet_rays, scene.world, rays)
            ),
            Contender(
                "mujoco, without plants",
                n // _SWEEPS,
                partial(peers_.mujoco_rays, scene.world, rays[: n // _SWEEPS]),
            ),
        ),
    )


def _standing(world: World) -> PoseTrack:
    """Return the track of a robot that stands at the world's first start."""
    start, track = world.tasks[0].start, PoseTrack()
    z = float(world.ground.height_at(start.x, start.y))
    pose = Pose.from_euler(np.array([start.x, start.y, z]), 0.0, 0.0, start.yaw)
    for stamp in (0.0, 10.0):
        track.append(stamp, pose.position, pose.quaternion)
    return track


def _flat_race(scene: Scene, world_seed: int, scenes: SceneCache) -> Case:
    """Return stage 1's work: a robot with 32 horizontal beams in a maze."""
    config = stage_config("Maze2D").model_copy(update={"seeds": (world_seed,), "heading": "goal"})
    count = 64

    def ours() -> Work:
        robots = FlatVectorEnv(config, count, scenes)
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
                partial(peers_.irsim_steps, scene.world, 32, _IRSIM_STEPS),
            ),
        ),
    )


def _cloud_races(scene: Scene, seed: int) -> Iterator[Case]:
    """Yield the work on a cloud: cells, features, trees."""
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
            Contender("jakteristics: points", 1, partial(peers_.jakteristics_features, points)),
        ),
    )
    cells = cell_features(points, forest.grid)
    features = np.repeat(cells.values.reshape(-1, cells.values.shape[-1]), 16, axis=0)
    features = np.ascontiguousarray(features[np.isfinite(features).all(axis=1)])
    red = forest.predict_proba(features) >= 0.5
    yield Case(
        "trees",
        "cells/s",
        (
            Contender(OURS, len(features), lambda: lambda: forest.predict_proba(features)),
            Contender("onnxruntime", len(features), partial(peers_.onnx_forest, forest, features)),
            Contender(
                "scikit-learn, as many trees",
                len(features),
                partial(peers_.sklearn_forest, forest, features, red),
            ),
        ),
    )


def _method(
    make: Callable[..., Callable[[NDArray[np.float32]], NDArray[np.bool_]]],
    name: str,
    points: NDArray[np.float32],
    grid: Any,  # noqa: ANN401 - of the forest.
) -> Work:
    """Return a peer that tells obstacles from ground."""
    obstacles = make(grid=grid, **peers_.settings_of(name))
    return lambda: obstacles(points)


def _filter_race() -> Case:
    """Return the filter's work: a prediction and a correction by gravity."""

    def ours() -> Work:
        x, P = np.zeros(STATES), np.diag(np.linspace(0.01, 0.1, STATES) ** 2)
        imu = np.array([0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 9.81])
        body = Body(0.1, 0.18, 0.09, 0.31, 0.0, 26.0, -34.0)
        weights, room = Weights.make(), Room.make()
        return lambda: _filter(_FILTER_STEPS, x, P, imu, body, Noise(), weights, room)

    return Case(
        "filter of 18 numbers",
        "steps/s",
        (
            Contender(OURS, _FILTER_STEPS, ours),
            Contender(
                "filterpy", _PEER_FILTER_STEPS, partial(peers_.filterpy_steps, _PEER_FILTER_STEPS)
            ),
        ),
    )


@kernel
def _filter(steps, x, P, imu, body, noise, weights, room):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Predict and correct by gravity again and again."""
    for _ in range(steps):
        predict(x, P, 0.0, 0.0, 0.1, 0.01, body, noise, weights, room)
        see_gravity(x, P, imu, body, noise, 1e9, weights, room)


def _loop_races(scene: Scene, seed: int) -> Iterator[Case]:
    """Yield the whole loop, from plant to policy, for both plants."""
    for plant in ("kinematic", "bullet"):
        yield Case(
            f"whole loop, {plant}",
            "robot-seconds/s",
            tuple(
                Contender(
                    f"{OURS}: {beams} beams",
                    _LOOP_STEPS * STEP,
                    partial(_loop, scene, plant, beams, seed),
                )
                for beams in (1081, 541)
            ),
        )


def _loop(scene: Scene, plant: str, beams: int, seed: int) -> Work:
    """Return a drive that tells how long it took without what came before its first clouds."""
    lidar = LidarConfig(beams=beams)
    config = SimulatedRobotConfig.model_validate({"plant": plant, "sensing": {"lidar": lidar}})

    def work() -> float:
        with driving(scene, config, "learned", seed) as (_, advance):
            began = time.perf_counter()
            advance(_LOOP_STEPS)
            return time.perf_counter() - began

    return work


def _training_race(scenes: SceneCache) -> Case:
    """Return stage 1's training: control steps with everything that is learnt from them."""
    config = stage_config("Maze2D").model_copy(update={"seeds": (0,)})

    def ours() -> Work:
        robots = FlatVectorEnv(config, 8, scenes, autoreset=False)
        robot, grid = config.simulated_robot.robot, config.simulated_robot.grid
        layout = ObservationLayout(grid.n_sectors)
        learner = SoftActorCritic(layout, grid.outer_radius, robot.max_steering, SacConfig(), 0)
        rng = np.random.default_rng(0)

        def work() -> float:
            began = time.perf_counter()
            tasks = [EpisodeSpec(0, (0, int(number))) for number in rng.integers(2**31, size=8)]
            explorer = learner.explorer(robot.dead_zone)
            played = play_together(robots, explorer, learner.config.hold, tasks)
            learner.update(played, rng)
            return (time.perf_counter() - began) / sum(episode.steps for episode in played)

        return work

    return Case("training, stage 1", "steps/s", (Contender(OURS, 1, ours),))


def _crowd_race(world: str, seed: int, scenes: SceneCache) -> Case:
    """Return many robots in one world, each with rotating laser, filter and classifier."""
    stage = stage_config("Natural")
    config = stage.model_copy(update={"preset": world, "seeds": (evaluation_world(seed, 0),)})

    def crowd(count: int, workers: int) -> Work:
        if workers == 1:
            robots: VectorEnv[Any, Any, Any] = make_vector("Natural", count, config, 1, scenes)
        else:
            robots = OffroadVectorEnv(config, count, workers)
        states, _ = robots.reset(seed=0)
        policy, steps = shipped_policy(), max(2, 64 // count)

        def work() -> float:
            nonlocal states
            began = time.perf_counter()
            for _ in range(steps):
                turns = [[policy.act(state) / policy.limit] for state in states]
                states, *_ = robots.step(np.array(turns, dtype=np.float32))
            return (time.perf_counter() - began) / steps

        return work

    sizes = ((1, 1), (4, 1), (16, 1), (64, 1), (16, 2), (64, 2))
    return Case(
        "robots in one world",
        "robot-seconds/s",
        tuple(
            Contender(
                f"{OURS}: {count} in {workers} process{'es' * (workers > 1)}",
                count * STEP,
                partial(crowd, count, workers),
            )
            for count, workers in sizes
        ),
    )
