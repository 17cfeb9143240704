"""Work that is compared with peers: rays, a maze, classification and the filter."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.bench import speed_peers
from andabata.bench.contenders import OURS, Case, Contender
from andabata.bench.filter import MODEL, STANDING_IMU, initial_belief, predict_and_correct
from andabata.bench.perception_peers import PEERS
from andabata.bench.speed_peers import Work
from andabata.datasets.labelled_cloud import CloudsConfig, labelled_cloud
from andabata.localization.sigma_points import Workspace
from andabata.machine.beam_rays import beam_rays
from andabata.machine.beams import BeamTables
from andabata.machine.lidar import LidarConfig, RotatingLidar
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import Sweeps
from andabata.models import shipped_forest
from andabata.tasks.maze import MazeVectorEnv
from andabata.tasks.offroad import stage_config
from terrain.record import packed
from traversability.features import cell_features
from traversability.grid import PolarGrid
from traversability.scanner import TraversabilityScanner
from worlds.scenes import Scene, SceneCache
from worlds.world import World

_SWEEPS = 4
"""Number of sweeps in a control period of the paper's laser."""

_FILTER_STEPS, _PEER_FILTER_STEPS, _FLAT_STEPS, _IRSIM_STEPS = 2000, 50, 300, 100
"""Numbers of steps in one call of the work."""


def laser_case(scene: Scene, seed: int) -> Case:
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


def flat_case(scene: Scene, world_seed: int, scenes: SceneCache) -> Case:
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


def cloud_cases(scene: Scene, seed: int) -> Iterator[Case]:
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


def filter_case() -> Case:
    """Return the filter: predictions, each with a correction by gravity."""

    def ours() -> Work:
        x, P = initial_belief()
        records = (packed(MODEL), packed(Workspace.allocate()))
        return lambda: predict_and_correct(_FILTER_STEPS, x, P, STANDING_IMU, *records)

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
