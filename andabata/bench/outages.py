"""What the filter makes of a receiver that falls silent, jumps, or states a false accuracy.

Each fault has a filter of its own, which gets the very readings that the robot drives by, but for
the fault: its estimate is compared with the truth, and with that of a filter without the fault.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.reporter import Reporter
from andabata.bench.table import Row
from andabata.engine_processes import run_tasks
from andabata.evaluation.trial import run_trial
from andabata.localization.ukf_localizer import UkfLocalizer
from andabata.machine.pose import wrap
from andabata.machine.sensor_readings import SensorReadings
from andabata.tasks.episode_monitor import TerminationConfig
from worlds.scenes import SceneCache
from worlds.splits import evaluation_world

_METRES_PER_DEGREE = 111_320.0
"""Length of a degree of latitude [m]."""

_JUMP = 700.0
"""Distance by which false fixes are off [m], as in FusionCore's recordings."""


@dataclass(frozen=True)
class Fault:
    """Fault of a satellite receiver.

    Attributes:
        name: Name for people.
        outage: Begin and end of a span without fixes [s].
        jump: Begin and end of a span in which fixes are off by ``_JUMP`` [s].
        sigma_ratio: Ratio of the standard deviation that is stated to what it stated before.
    """

    name: str
    outage: tuple[float, float] = (0.0, 0.0)
    jump: tuple[float, float] = (0.0, 0.0)
    sigma_ratio: float = 1.0

    @property
    def span(self) -> tuple[float, float]:
        """Begin and end of what is measured [s]: of the outage and of the jump after it."""
        spans = [span for span in (self.outage, self.jump) if span[1] > span[0]]
        if not spans:
            return 0.0, np.inf
        return min(span[0] for span in spans), max(span[1] for span in spans)

    def apply(self, fixes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return fixes with the fault, rows as in ``SensorReadings.gnss``."""
        stamps, faulty = fixes[:, 0], fixes.copy()
        faulty[(self.jump[0] <= stamps) & (stamps < self.jump[1]), 1] += _JUMP / _METRES_PER_DEGREE
        faulty[:, 4] *= self.sigma_ratio**2
        return faulty[(stamps < self.outage[0]) | (stamps >= self.outage[1])]


FAULTS = (
    Fault("60 s without fixes", outage=(60.0, 120.0)),
    Fault("211 s without fixes", outage=(60.0, 271.0)),
    Fault("461 s without fixes", outage=(30.0, 491.0)),
    Fault("105 fixes 700 m off after 60 s without", outage=(60.0, 120.0), jump=(120.0, 225.0)),
    Fault("one fix 700 m off", jump=(120.0, 121.0)),
    Fault("states half of its sigma", sigma_ratio=1 / 2),
    Fault("states a sixth of its sigma", sigma_ratio=1 / 6),
    Fault("states an eighteenth of its sigma", sigma_ratio=1 / 18),
)
"""Faults that are measured."""


@dataclass(frozen=True)
class FaultyDrive:
    """One drive with one fault.

    Attributes:
        errors: Errors of x, y [m] and yaw [rad] at each control step of the span, shape (k, 3).
        nees: Normalised estimation error squared there, of three numbers, shape (k,).
        moved: Distance from the estimate without the fault there [m], shape (k,).
        way: Way that was driven in the span [m].
    """

    errors: NDArray[np.float64]
    nees: NDArray[np.float64]
    moved: NDArray[np.float64]
    way: float


def bench_outages(
    config: SimulatedRobotConfig,
    world: str,
    drives: int,
    seed: int,
    workers: int,
    reporter: Reporter,
) -> list[Row]:
    """Return a row for each of ``FAULTS``, ready for JSON.

    Args:
        config: Configuration of the robot.
        world: World preset of the drives.
        drives: Number of drives.
        seed: Seed of the worlds and of every noise.
        workers: Number of processes.
        reporter: Receiver of progress.
    """
    lean = config.model_copy(
        update={
            "localizer": "ukf",
            "sensing": config.sensing.model_copy(update={"scanner": "horizontal"}),
        }
    )
    each: list[tuple[FaultyDrive, ...]] = []
    with reporter.progress("drives with faults", drives) as step:
        for _, drive in run_tasks(partial(_drive, world, seed, lean), range(drives), workers):
            each.append(drive)
            step()
    return [fault_row(fault.name, [drive[k] for drive in each]) for k, fault in enumerate(FAULTS)]


def _drive(
    world: str, seed: int, config: SimulatedRobotConfig, trial: int
) -> tuple[FaultyDrive, ...]:
    """Drive to the goals of a world with the oracle; return what each fault does meanwhile."""
    scene = SceneCache(1).get(world, evaluation_world(seed, trial))
    robot = SimulatedRobot(scene, config, None, make_steering("oracle", scene.world, config))
    shadows = [
        UkfLocalizer(config.filter, config.robot, config.sensing.geo_reference)
        for _ in range(len(FAULTS) + 1)
    ]
    # Of each step: stamp, true x and y, then error, NEES and place of each filter.
    stamps: list[float] = []
    places: list[NDArray[np.float64]] = []
    beliefs: list[NDArray[np.float64]] = []

    def watch(readings: SensorReadings) -> None:
        """Give every filter the readings, each with its fault, and record the errors."""
        if readings.truth is None:
            raise ValueError("truth: expected the simulator's true state, got none")
        if not stamps and robot.navigator.start is not None:
            for shadow in shadows:
                shadow.reset(*robot.navigator.start)
        shadows[0].update(readings)
        for shadow, fault in zip(shadows[1:], FAULTS, strict=True):
            fixes = None if readings.gnss is None else fault.apply(readings.gnss)
            shadow.update(replace(readings, gnss=fixes))
        stamps.append(readings.stamp)
        truth = readings.truth.pose
        places.append(truth.position[:2].copy())
        beliefs.append(np.array([_belief(s, truth.position, truth.yaw) for s in shadows]))

    run_trial(
        robot,
        scene.world.tasks[0],
        TerminationConfig(),
        np.random.default_rng([seed, trial, 1]),
        watch,
    )
    robot.close()
    return tuple(
        _cut(fault, k, np.array(stamps), np.array(places), np.array(beliefs))
        for k, fault in enumerate(FAULTS, start=1)
    )


def _belief(
    localizer: UkfLocalizer, position: NDArray[np.float64], yaw: float
) -> NDArray[np.float64]:
    """Return the error of x, y [m] and yaw [rad] of a filter, and its NEES, shape (4,)."""
    pose = localizer.pose
    error = np.array([*(pose.position[:2] - position[:2]), wrap(pose.yaw - yaw)])
    return np.array([*error, error @ np.linalg.solve(localizer.covariance, error)])


def _cut(
    fault: Fault,
    number: int,
    stamps: NDArray[np.float64],
    places: NDArray[np.float64],
    beliefs: NDArray[np.float64],
) -> FaultyDrive:
    """Return what a fault does in its span, or up to the end of a drive that is shorter."""
    begin, end = fault.span
    inside = (stamps >= begin) & (stamps < end)
    own, sound = beliefs[inside, number], beliefs[inside, 0]
    way = float(np.hypot(*np.diff(places[inside], axis=0).T).sum())
    return FaultyDrive(own[:, :3], own[:, 3], np.hypot(*(own - sound)[:, :2].T), way)


def fault_row(name: str, drives: Sequence[FaultyDrive]) -> Row:
    """Return the figures of a fault over all drives that last until it, ready for JSON.

    ``within`` is the share of drives whose error at the end of the span is at most a metre and 2 %
    of the way; ``moved_m`` the largest distance between the estimates with and without the fault.
    """
    lasting = [drive for drive in drives if len(drive.errors)]
    if not lasting:
        return {"fault": name, "drives": 0}
    ends = np.array([float(np.hypot(*drive.errors[-1, :2])) for drive in lasting])
    ways = np.array([drive.way for drive in lasting])
    errors = np.concatenate([drive.errors for drive in lasting])
    return {
        "fault": name,
        "drives": len(lasting),
        "way_m": float(np.median(ways)),
        "error_at_end_m": float(np.median(ends)),
        "largest_at_end_m": float(ends.max()),
        "within": float((ends <= 1.0 + 0.02 * ways).mean()),
        "moved_m": float(max(drive.moved.max() for drive in lasting)),
        "position_rms_m": float(np.sqrt((errors[:, :2] ** 2).sum(axis=1).mean())),
        "heading_rms_deg": float(np.rad2deg(np.sqrt((errors[:, 2] ** 2).mean()))),
        "nees_mean": float(np.mean([drive.nees.mean() for drive in lasting])),
    }


def outage_table(rows: Sequence[Row]) -> list[Row]:
    """Return the rows of ``bench_outages`` as a table for people."""
    return [
        {
            "fault": row["fault"],
            "drives": row["drives"],
            "way": f"{row['way_m']:.0f} m",
            "error at its end": f"{row['error_at_end_m']:.2f} m",
            "largest": f"{row['largest_at_end_m']:.2f} m",
            "within 1 m + 2 %": f"{row['within']:.2f}",
            "moved by it": f"{row['moved_m']:.2f} m",
            "NEES": f"{row['nees_mean']:.1f}",
        }
        for row in rows
        if row["drives"]
    ]
