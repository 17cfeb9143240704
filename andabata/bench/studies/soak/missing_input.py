"""Input that is missing stops the robot: the laser, or inertial unit and wheels, drop out."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np

from andabata.bench.studies.soak.outcome import Outcome, Tally
from andabata.bench.studies.soak.synthetic_drive import PERIOD, fresh_localizer, synthetic_readings
from andabata.localization.localizer import Localizer
from andabata.localization.ukf_config import UkfConfig
from andabata.machine.kinematics import Twist
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import SensorReadings
from andabata.navigation.laser_monitor import LaserMonitorConfig
from andabata.navigation.navigator import Navigator
from andabata.navigation.perception import Perception

_LATE = 0.2
"""Time after a time-out within which the robot has to stand [s]."""

_EVERY, _LEAST, _MOST = 60, 8, 20
"""Periods from drop-out to drop-out, and the least and the largest number of those that it has."""

_SECTORS = 32


class _NoPerception:
    """Perception that sees nothing: what stops the robot is asked before it."""

    def update(self, readings: SensorReadings, localizer: Localizer) -> None:
        """Take in nothing."""


def _navigator(localizer: Localizer) -> Navigator:
    """Return a navigator of a localizer."""
    return Navigator(RobotModel(), localizer, cast(Perception, _NoPerception()))


def command_of(localizer: Localizer) -> Callable[[], float]:
    """Return a function that returns the speed with which the robot would drive on now [m/s]."""
    navigator = _navigator(localizer)
    return lambda: navigator.execute(Twist(0.3, 0.0))[0].linear


def missing_input_stops_the_robot(count: int, folder: Path) -> Outcome:
    """Check that the robot stands soon after an input has fallen silent, and drives on after it.

    Half of the drop-outs are those of the laser, the others of inertial unit and wheels at once.

    Args:
        count: Number of drop-outs.
        folder: Folder for its files; none are made.
    """
    rng, tally, longest = np.random.default_rng(8020), Tally(), 0.0
    localizer = fresh_localizer()
    navigator, late = _navigator(localizer), 0
    begin, length, silent_since, stood = _EVERY, 0, 0.0, False
    for number, readings in enumerate(synthetic_readings((count + 1) * _EVERY)):
        drop_out, place = divmod(number, _EVERY)
        if place == 0:
            begin, length = int(rng.integers(10, 30)), int(rng.integers(_LEAST, _MOST))
            silent_since, stood = 0.0, False
        is_silent = drop_out > 0 and begin <= place < begin + length
        ranges = rng.uniform(1.0, 9.0, _SECTORS).astype(np.float32)
        given = replace(readings, horizontal=ranges)
        navigator.update(_silent(given, drop_out % 2 == 0) if is_silent else given)
        moves = navigator.execute(Twist(0.3, 0.0))[0].linear != 0.0
        silent_since = silent_since + PERIOD if is_silent else 0.0
        if is_silent and not moves and not stood:
            stood, longest = True, max(longest, silent_since - _time_out(drop_out % 2 == 0))
        if drop_out > 0 and place == begin + length:
            tally.trials += 1
            tally.expect(stood, f"drop-out {drop_out}: drives on for {length * PERIOD:.1f} s")
        if drop_out > 0 and place == _EVERY - 1:
            tally.expect(moves, f"drop-out {drop_out}: stands although all arrives again")
        if is_silent and moves and silent_since > _time_out(drop_out % 2 == 0) + _LATE + 1e-6:
            late += 1
            tally.fail(f"drop-out {drop_out}: drives after {silent_since:.1f} s of silence")
    return tally.outcome(f"{late} late of {tally.trials:,}, at most {longest:.1f} s after time-out")


def _silent(readings: SensorReadings, is_laser: bool) -> SensorReadings:
    """Return readings without those of the laser, or of inertial unit and wheels."""
    if is_laser:
        return replace(readings, horizontal=None)
    return replace(readings, imu=None, encoders=None)


def _time_out(is_laser: bool) -> float:
    """Return the time-out of the laser, or the longer one of inertial unit and wheels [s]."""
    if is_laser:
        return LaserMonitorConfig().timeout
    config = UkfConfig()
    return max(config.imu_timeout, config.wheel_timeout)
