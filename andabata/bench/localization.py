"""Measures the error and the consistency of the filter on whole drives, beside single sensors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from andabata.assembly.controllers import make_steering
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.bench.motion import ride_clouds, ride_count
from andabata.bench.reporter import Reporter
from andabata.bench.table import Row, benchmark_row
from andabata.engine_processes import run_tasks
from andabata.evaluation.trial import run_trial
from andabata.localization.ukf_localizer import UkfLocalizer
from andabata.machine.pose import Pose, wrap
from andabata.machine.sensor_readings import SensorReadings
from andabata.tasks.episode_monitor import TerminationConfig
from worlds.scenes import SceneCache
from worlds.splits import evaluation_world

_INSTANT = 100
"""Control steps between the instants at which the NEES is averaged: ten seconds."""


@dataclass(frozen=True)
class Tracked:
    """Errors of the filter and of single sensors on one drive.

    Attributes:
        errors: Errors of x, y [m] and yaw [rad] at each control step, shape (k, 3).
        nees: Normalised estimation error squared, of three numbers, shape (k,).
        fixes: Horizontal errors of the satellite fixes alone [m].
        headings: Errors of the compass alone [rad].
        attempts: Outcomes of the attempts to reach the goals.
    """

    errors: NDArray[np.float64]
    nees: NDArray[np.float64]
    fixes: NDArray[np.float64]
    headings: NDArray[np.float64]
    attempts: tuple[str, ...]


def bench_localization(
    config: SimulatedRobotConfig,
    world: str,
    drives: int,
    rides: int,
    seed: int,
    workers: int,
    reporter: Reporter,
) -> Row:
    """Return the filter's statistics, and what motion does to clouds, ready for JSON.

    Args:
        config: Configuration of the robot.
        world: World preset of the drives.
        drives: Number of drives.
        rides: Number of rides of each row of the error-against-speed curve; 0 leaves it out.
        seed: Seed of the worlds and of every noise.
        workers: Number of processes.
        reporter: Receiver of progress.
    """
    with reporter.progress("drives", drives) as step:
        tracked = track_drives(world, drives, seed, config, workers, step)
    statistics = summarise_tracks(tracked)
    motion: list[Row] = []
    if rides:
        with reporter.progress("rides", ride_count(rides)) as step:
            motion = ride_clouds(config, rides, seed, workers, step)
    return {
        "rows": localization_rows(statistics),
        "localization": statistics,
        "motion": motion,
    }


def localization_rows(statistics: Row) -> list[Row]:
    """Return one benchmark row for each number of ``summarise_tracks``; the unit ends its name."""
    return [
        benchmark_row(
            name,
            name.split("_", 1)[0] if "alone" in name else "andabata",
            value,
            {"m": "m", "deg": "deg"}.get(name.rsplit("_", 1)[-1], "1"),
            statistics["drives"],
        )
        for name, value in statistics.items()
        if isinstance(value, float)
    ]


def localization_table(statistics: Row) -> list[Row]:
    """Return the statistics of ``summarise_tracks`` as a table for people."""
    rows: list[Row] = [
        {
            "quantity": "position",
            "rms": f"{statistics['position_rms_m']:.2f} m",
            "one sensor alone": f"{statistics['gnss_alone_rms_m']:.2f} m (GNSS)",
            "remarks": f"95 % within {statistics['position_95_m']:.2f} m",
        },
        {
            "quantity": "heading",
            "rms": f"{statistics['heading_rms_deg']:.2f} deg",
            "one sensor alone": f"{statistics['compass_alone_rms_deg']:.2f} deg (compass)",
            "remarks": f"{statistics['goals']} goals in {statistics['drives']} drives",
        },
    ]
    if statistics["nees_mean"] is not None:
        low, high = statistics["nees_band"]
        rows.append(
            {
                "quantity": "NEES, mean",
                "rms": f"{statistics['nees_mean']:.2f}",
                "one sensor alone": "-",
                "remarks": f"{statistics['nees_inside']:.0%} within {low:.2f} to {high:.2f}",
            }
        )
    return rows


def track_drives(
    world: str,
    trials: int,
    seed: int,
    config: SimulatedRobotConfig,
    workers: int,
    step: Callable[[], None] | None = None,
) -> list[Tracked]:
    """Drive to the goals of many worlds with the oracle, and record the filter's errors.

    The turning laser is left out: neither the filter nor the oracle uses it.

    Args:
        world: World preset; the worlds are those of the evaluation.
        trials: Number of drives, one a world.
        seed: Seed of the worlds and of every noise.
        config: Configuration of the robot.
        workers: Number of processes.
        step: Function that is called after each drive.
    """
    lean = config.model_copy(
        update={
            "localizer": "ukf",
            "sensing": config.sensing.model_copy(update={"scanner": "horizontal"}),
        }
    )
    drives = []
    for _, tracked in run_tasks(partial(_track, world, seed, lean), range(trials), workers):
        drives.append(tracked)
        if step is not None:
            step()
    return drives


def _track(world: str, seed: int, config: SimulatedRobotConfig, trial: int) -> Tracked:
    """Return the errors of one drive."""
    scene = SceneCache(1).get(world, evaluation_world(seed, trial))
    simulated_robot = SimulatedRobot(
        scene, config, None, make_steering("oracle", scene.world, config)
    )
    filter_ = simulated_robot.localizer
    if not isinstance(filter_, UkfLocalizer):
        raise TypeError(f"localizer: expected the filter, got {type(filter_).__name__}")
    geo_reference = config.sensing.geo_reference
    errors, nees, fixes, headings = [], [], [], []
    waiting: list[SensorReadings] = []
    places: dict[int, NDArray[np.float64]] = {}

    def watch(readings: SensorReadings) -> None:
        """Record the error after the step before: these readings reach the filter in the next."""
        if readings.gnss is not None and readings.true_track is not None:
            for row in readings.true_track:
                places[round(row[0] * 100)] = row[1:3]
            for fix in readings.gnss[np.isfinite(readings.gnss[:, 4])]:
                seen = geo_reference.to_map(fix[None, 1:4])[0, :2]
                fixes.append(float(np.hypot(*(seen - places[round(fix[0] * 100)]))))
        if waiting:
            error = _error(filter_.pose, waiting[-1])
            errors.append(error)
            nees.append(float(error @ np.linalg.solve(filter_.covariance, error)))
        if readings.mag is not None and readings.truth is not None and len(readings.mag):
            headings.append(
                _heading_error(readings.mag[-1, 1:4], readings.truth.pose, geo_reference.flux)
            )
        waiting[:] = [readings]

    attempts = run_trial(
        simulated_robot,
        scene.world.tasks[0],
        TerminationConfig(),
        np.random.default_rng([seed, trial, 1]),
        watch,
    )
    simulated_robot.close()
    outcomes = tuple(str(attempt.outcome) for attempt in attempts)
    return Tracked(np.array(errors), np.array(nees), np.array(fixes), np.array(headings), outcomes)


def _error(pose: Pose, readings: SensorReadings) -> NDArray[np.float64]:
    """Return the error of a pose: x, y [m], yaw [rad]."""
    if readings.truth is None:
        raise ValueError("truth: expected the simulator's true state, got none")
    truth = readings.truth.pose
    return np.array([*(pose.position[:2] - truth.position[:2]), wrap(pose.yaw - truth.yaw)])


def _heading_error(field: NDArray[np.float64], pose: Pose, flux: NDArray[np.float64]) -> float:
    """Return the error of a heading from one magnetic field at the true tilt [rad]."""
    _, pitch, roll = Rotation.from_quat(pose.quaternion).as_euler("ZYX")
    level = Rotation.from_euler("ZYX", [0.0, pitch, roll]).apply(field)
    heading = np.arctan2(flux[1], flux[0]) - np.arctan2(level[1], level[0])
    return wrap(float(heading) - pose.yaw)


def summarise_tracks(drives: Sequence[Tracked]) -> Row:
    """Return the statistics of all drives together, ready for JSON.

    ``nees`` is the mean over the drives at each whole ten seconds that all of them last, and
    ``nees_band`` the interval in which it lies with 95 % probability for a consistent filter
    (Bar-Shalom et al. 2001, section 5.4).
    """
    errors = np.concatenate([drive.errors for drive in drives])
    far = np.hypot(errors[:, 0], errors[:, 1])
    each = [float(np.sqrt((drive.errors[:, :2] ** 2).sum(axis=1).mean())) for drive in drives]
    fixes = np.concatenate([drive.fixes for drive in drives])
    headings = np.concatenate([drive.headings for drive in drives])
    last = min(len(drive.nees) for drive in drives)
    instants = np.arange(_INSTANT - 1, last, _INSTANT)
    nees = np.mean([drive.nees[instants] for drive in drives], axis=0)
    count = 3 * len(drives)
    low, high = (float(chi2.ppf(share, count)) / len(drives) for share in (0.025, 0.975))
    return {
        "drives": len(drives),
        "goals": sum(attempt == "goal" for drive in drives for attempt in drive.attempts),
        "position_rms_m": float(np.sqrt((far**2).mean())),
        "position_95_m": float(np.quantile(far, 0.95)),
        "position_rms_of_drives_m": [min(each), float(np.median(each)), max(each)],
        "heading_rms_deg": float(np.rad2deg(np.sqrt((errors[:, 2] ** 2).mean()))),
        "gnss_alone_rms_m": float(np.sqrt((fixes**2).mean())),
        "compass_alone_rms_deg": float(np.rad2deg(np.sqrt((headings**2).mean()))),
        "nees": nees.tolist(),
        "nees_mean": float(nees.mean()) if len(nees) else None,
        "nees_band": [low, high],
        "nees_inside": float(((nees >= low) & (nees <= high)).mean()) if len(nees) else None,
    }
