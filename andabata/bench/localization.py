"""How well the robot knows where it is: the filter on whole drives, beside its senses alone."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from andabata.assembly.controllers import make_controller
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.engine import run_tasks
from andabata.evaluation.trial import run_trial
from andabata.localization.ukf_localizer import UkfLocalizer
from andabata.machine.pose import Pose, wrap
from andabata.machine.sensor_readings import SensorReadings
from andabata.tasks.episode_monitor import TerminationConfig
from worlds.scenes import SceneCache
from worlds.splits import evaluation_world

_INSTANT = 100
"""Control steps between the instants at which the filter's honesty is judged: ten seconds."""


@dataclass(frozen=True)
class Tracked:
    """One drive, as the filter saw it.

    Attributes:
        errors: x, y [m] and yaw [rad] of the filter at each control step, shape (k, 3).
        nees: Squared errors in units of the filter's own covariance, shape (k,).
        fixes: Horizontal errors of the satellite fixes alone [m].
        headings: Errors of the compass alone [rad].
        attempts: How the drives to the goals ended.
    """

    errors: NDArray[np.float64]
    nees: NDArray[np.float64]
    fixes: NDArray[np.float64]
    headings: NDArray[np.float64]
    attempts: tuple[str, ...]


def track_drives(
    world: str,
    trials: int,
    seed: int,
    config: SimulatedRobotConfig,
    workers: int,
    step: Callable[[], None] | None = None,
) -> list[Tracked]:
    """Let the oracle visit the goals of many worlds, and watch the filter.

    The laser is left out: the filter does not use it, and the oracle does not need it.

    Args:
        world: Preset; its worlds are the judges'.
        trials: Drives, one a world.
        seed: Of the worlds and of every noise.
        config: The robot.
        workers: Processes.
        step: Called after each drive.
    """
    lean = config.model_copy(
        update={
            "localizer": "ukf",
            "sensing": config.sensing.model_copy(update={"scanner": "horizontal"}),
        }
    )
    found = []
    for _, tracked in run_tasks(partial(_track, world, seed, lean), range(trials), workers):
        found.append(tracked)
        if step is not None:
            step()
    return found


def _track(world: str, seed: int, config: SimulatedRobotConfig, trial: int) -> Tracked:
    """Drive through one world."""
    scene = SceneCache(1).get(world, evaluation_world(seed, trial))
    simulated_robot = SimulatedRobot(
        scene, config, None, make_controller("oracle", scene.world, config)
    )
    filter_ = simulated_robot.localizer
    if not isinstance(filter_, UkfLocalizer):
        raise TypeError(f"localizer: expected the filter, got {type(filter_).__name__}")
    geo_reference = config.sensing.geo_reference
    errors, nees, fixes, headings = [], [], [], []
    waiting: list[SensorReadings] = []
    places: dict[int, NDArray[np.float64]] = {}

    def watch(readings: SensorReadings) -> None:
        """Judge the step before: these senses reach the filter in the next one."""
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
    """Return the error of a heading read off one magnetic field [rad], the tilt being known."""
    _, pitch, roll = Rotation.from_quat(pose.quaternion).as_euler("ZYX")
    level = Rotation.from_euler("ZYX", [0.0, pitch, roll]).apply(field)
    heading = np.arctan2(flux[1], flux[0]) - np.arctan2(level[1], level[0])
    return wrap(float(heading) - pose.yaw)


def summarise_tracks(drives: Sequence[Tracked]) -> dict[str, Any]:
    """Return the figures of all drives together, ready for JSON.

    ``nees`` is the mean over the drives at each whole ten seconds that all of them last, with the
    band in which the mean of honest filters lies 95 times in a hundred.
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
