"""Measures what motion does to clouds and virtual scans, with and without the beams' poses."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.bench.table import Row
from andabata.engine_processes import run_tasks
from andabata.localization.noisy_ground_truth import (
    NoisyGroundTruthConfig,
    NoisyGroundTruthLocalizer,
)
from andabata.localization.ukf_localizer import UkfLocalizer
from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.reality import TrueConstants
from andabata.machine.sensor_readings import SensorReadings, WheelSpeeds
from andabata.machine.simulator import Simulator
from andabata.models import shipped_forest
from andabata.navigation.cloud_assembly import CloudAssembler
from traversability.grid import PolarGrid
from traversability.scanner import TraversabilityScanner
from worlds.scenes import Scene, SceneCache
from worlds.splits import evaluation_world
from worlds.world import Start

SPEEDS = (0.1, 0.3, 0.6, 1.0)
"""Forward speeds [m/s]; the paper's is 0.3."""

TURNS = (0.0, 0.4)
"""Yaw rates [rad/s]."""

GROUNDS = ("lake", "natural-test")
"""World presets: nearly flat, and rough."""

_TRUE = NoisyGroundTruthConfig(position_sigma=0.0, yaw_sigma=0.0, tilt_sigma=0.0)
_STILL = WheelSpeeds(0.0, 0.0)


@dataclass(frozen=True)
class Ride:
    """Ride of some seconds at a constant twist.

    Attributes:
        ground: World preset.
        speed: Forward speed [m/s].
        turn: Yaw rate [rad/s].
        number: Number of the world among the evaluation's.
    """

    ground: str
    speed: float
    turn: float
    number: int


class _Frozen(PoseTrack):
    """Track with a single pose, which places beams without de-skewing."""

    def __init__(self, track: PoseTrack) -> None:
        """Keep the latest pose of a track."""
        super().__init__(2)
        pose = track.at(np.array([track.latest]))[0]
        self.append(track.latest, pose[:3], pose[3:])


def ride_count(rides: int) -> int:
    """Return the number of rides of a curve with some rides of each row."""
    return rides * len(GROUNDS) * len(TURNS) * len(SPEEDS)


def error_table(rows: Sequence[Row]) -> list[Row]:
    """Return the errors of ``ride_clouds`` as a table for people: median and 95 %."""
    return [
        _ride_cells(row)
        | {
            "error [m]": f"{row['error_median_m']:.3f} {row['error_95_m']:.3f}",
            "skewed [m]": f"{row['skewed_median_m']:.3f} {row['skewed_95_m']:.3f}",
        }
        for row in rows
        if row["clouds"]
    ]


def agreement_table(rows: Sequence[Row]) -> list[Row]:
    """Return how well scans agree with those of a standing robot, as a table for people.

    The last column is the agreement of two scans of the standing robot.
    """
    return [
        _ride_cells(row)
        | {
            "scan": row["scan_agrees"],
            "skewed": row["skewed_scan_agrees"],
            "true pose": row["true_scan_agrees"],
            "standing": row["standing_scan_agrees"],
        }
        for row in rows
        if row["clouds"]
    ]


def _ride_cells(row: Row) -> Row:
    """Return the first columns of a table for people."""
    return {
        "ground": row["ground"],
        "yaw rate [rad/s]": f"{row['turn']:.1f}",
        "speed [m/s]": f"{row['speed']:.1f}",
    }


def ride_clouds(
    config: SimulatedRobotConfig,
    rides: int,
    seed: int,
    workers: int,
    step: Callable[[], None] | None = None,
) -> list[Row]:
    """Return the error-against-speed curve: one row for each ground, yaw rate and speed.

    A cloud's error is the distance of its points from the same points placed with the true pose,
    both relative to the robot. The virtual scans are compared with those of a robot that stands
    still where the moving one is.

    Args:
        config: Configuration of the robot.
        rides: Number of rides of each row.
        seed: Seed of worlds and noise.
        workers: Number of processes.
        step: Function that is called after each ride.
    """
    tasks = [
        Ride(ground, speed, turn, number)
        for ground in GROUNDS
        for turn in TURNS
        for speed in SPEEDS
        for number in range(rides)
    ]
    rows: dict[tuple[str, float, float], list[dict[str, float]]] = {}
    for ride, errors in run_tasks(partial(_ride, config, seed), tasks, workers):
        rows.setdefault((ride.ground, ride.turn, ride.speed), []).extend(errors)
        if step is not None:
            step()
    table = []
    for (ground, turn, speed), errors in rows.items():
        row: Row = {"ground": ground, "turn": turn, "speed": speed, "clouds": len(errors)}
        names = errors[0] if errors else ()
        table.append(row | {name: float(np.mean([one[name] for one in errors])) for name in names})
    return table


def _ride(config: SimulatedRobotConfig, seed: int, ride: Ride) -> list[dict[str, float]]:
    """Stand for one cloud, as the navigator does, ride for two, and return the errors of each."""
    scene = SceneCache(1).get(ride.ground, evaluation_world(seed, ride.number))
    rng = np.random.default_rng([seed, ride.number, 7])
    robot, lidar = config.robot, config.sensing.lidar
    simulator = Simulator(scene.world, scene.rays, robot, config.plant, config.sensing, rng)
    start = scene.world.tasks[0].start
    constants = config.reality.draw(rng.spawn(1)[0])
    readings = simulator.reset(start, constants)
    localizers = (
        UkfLocalizer(config.filter, robot, config.sensing.geo_reference),
        NoisyGroundTruthLocalizer(_TRUE, rng),
    )
    ours, skewed, true = (CloudAssembler(config.assembly, robot.lidar_height) for _ in range(3))
    for localizer in localizers:
        localizer.reset(_pose(readings), readings.stamp)
    wheels = SkidSteer(robot).wheel_speeds(ride.speed, ride.turn)
    period = config.assembly.turn / lidar.head_rate
    errors: list[dict[str, float]] = []
    before = None
    while readings.stamp < 4 * period + 1.0 and len(errors) < 2:
        readings = simulator.step(wheels if before is not None else _STILL)
        if readings.truth is None or readings.truth.collided or readings.sweeps is None:
            break
        for localizer in localizers:
            localizer.update(readings)
        filter_, truth = localizers
        ours.add(readings.sweeps, filter_.track)
        skewed.add(readings.sweeps, _Frozen(filter_.track))
        true.add(readings.sweeps, truth.track)
        if true.cloud is not None and true.cloud is not before:
            first, before = before is None, true.cloud
            if first:
                continue
            clouds = [
                assembler.relative(localizer.odometry).points
                for assembler, localizer in ((ours, filter_), (skewed, filter_), (true, truth))
            ]
            standing = partial(_standing, scene, config, constants, readings, rng)
            errors.append(_compared(config.grid, clouds, standing))
    simulator.close()
    return errors


def _pose(readings: SensorReadings) -> Pose:
    """Return the true pose."""
    if readings.truth is None:
        raise ValueError("truth: expected the simulator's true state, got none")
    return readings.truth.pose


def _compared(
    grid: PolarGrid,
    clouds: list[NDArray[np.float32]],
    stand: Callable[[], NDArray[np.float32]],
) -> dict[str, float]:
    """Return errors of the points and agreement of the scans at one instant.

    Args:
        grid: Polar grid of the scans.
        clouds: Clouds placed with the filter's track, with its latest pose alone, and with the true
            track; relative to the robot [m], shape (n, 3) each.
        stand: Function that returns the cloud of a robot that stands still there.
    """
    ours, skewed, true = clouds
    scanner = TraversabilityScanner(shipped_forest(), grid)
    standing, again = stand(), stand()
    rings = [_rings(scanner, points) for points in (ours, skewed, true, standing, again)]
    still = rings[3]
    return {
        "error_median_m": float(np.median(np.linalg.norm(ours - true, axis=1))),
        "error_95_m": float(np.quantile(np.linalg.norm(ours - true, axis=1), 0.95)),
        "skewed_median_m": float(np.median(np.linalg.norm(skewed - true, axis=1))),
        "skewed_95_m": float(np.quantile(np.linalg.norm(skewed - true, axis=1), 0.95)),
        "scan_agrees": _agreement(rings[0], still),
        "skewed_scan_agrees": _agreement(rings[1], still),
        "true_scan_agrees": _agreement(rings[2], still),
        "standing_scan_agrees": _agreement(rings[4], still),
    }


def _standing(
    scene: Scene,
    config: SimulatedRobotConfig,
    constants: TrueConstants,
    readings: SensorReadings,
    rng: np.random.Generator,
) -> NDArray[np.float32]:
    """Return the cloud of a robot that stands still where the moving one is, in its frame."""
    pose = _pose(readings)
    simulator = Simulator(scene.world, scene.rays, config.robot, config.plant, config.sensing, rng)
    start = Start(float(pose.position[0]), float(pose.position[1]), pose.yaw)
    localizer = NoisyGroundTruthLocalizer(_TRUE, rng)
    assembler = CloudAssembler(config.assembly, config.robot.lidar_height)
    there = simulator.reset(start, constants)
    localizer.reset(_pose(there), there.stamp)
    while assembler.cloud is None:
        there = simulator.step(_STILL)
        localizer.update(there)
        if there.sweeps is not None:
            assembler.add(there.sweeps, localizer.track)
    simulator.close()
    return assembler.relative(localizer.odometry).points


def _rings(scanner: TraversabilityScanner, points: NDArray[np.float32]) -> NDArray[np.int64]:
    """Return the ring at which each sector ends, one more if it is free, -10 if unknown."""
    ranges, edges = scanner.scan(points).ranges, scanner.grid.ring_edges
    rings = np.searchsorted(edges, ranges - 1e-3)
    rings = np.where(np.isinf(ranges), len(edges) - 1, rings)
    return np.where(np.isnan(ranges), -10, rings)


def _agreement(one: NDArray[np.int64], other: NDArray[np.int64]) -> float:
    """Return the share of sectors that are equal or one ring apart."""
    return float((np.abs(one - other) <= 1).mean())
