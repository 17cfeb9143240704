"""Datum of a live navigator, which hears where on Earth it is only bit by bit."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from andabata.localization.datum import (
    Datum,
    consistent_fixes,
    datum_of_heading,
    make_datum,
    refused_fixes,
)
from andabata.localization.initial_pose import initial_pose
from andabata.localization.localizer import Localizer
from andabata.machine.magnetic_model import decimal_year
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.records import topics
from andabata.replay.datum import use_datum

SILENCE = 10.0
"""Time after which a navigator that misses something says what [s]."""

_FEW_FIXES = 3
"""Number of fixes that have to fit each other before one of them is the datum."""

_MOST_FIXES = 30
"""Number of fixes that are kept for that."""


class DatumInitializer:
    """Takes the datum from what is given or from the first fixes that fit each other.

    Attributes:
        datum: None until it is known.
    """

    def __init__(self, given: Mapping[str, float], status: Callable[[str], None]) -> None:
        """Begin without a datum.

        Args:
            given: Fields of ``GeoReference`` that the user gives.
            status: Tells the user.
        """
        self._given, self._status = given, status
        self.datum: Datum | None = None
        self._fixes = np.empty((0, 5))
        self._is_turned = False  # Whether the compass is compared with a heading that was told.

    def locate(self, kept: SensorReadings, now_ns: int) -> Pose | None:
        """Return the pose that the senses tell, once enough fixes fit each other.

        Args:
            kept: Readings so far.
            now_ns: The graph's time [ns].

        Raises:
            DatumError: If the fixes lie far from the datum that is given.
        """
        if kept.gnss is None:
            return None
        fitting = kept.gnss[consistent_fixes(kept.gnss)]
        if len(fitting) < _FEW_FIXES:
            return None
        datum = make_datum(self._given, kept.gnss, decimal_year(now_ns))
        assert datum is not None  # A fix is good.
        pose = initial_pose(replace(kept, gnss=fitting), datum.reference)
        if pose is not None:
            self.datum = datum.with_compass(kept)
        return pose

    def take(self, localizer: Localizer, facts: dict[str, str], key: str) -> None:
        """Let a localizer use the datum from now on, note it under a key, and tell the user."""
        if self.datum is None:
            return
        use_datum(localizer, self.datum)
        facts[key] = json.dumps(self.datum.as_dict())
        for note in self.datum.notes:
            self._status(note)

    def find(self, readings: SensorReadings, now_ns: int, place: NDArray[np.float64]) -> bool:
        """Look for the datum of a start that was told; return whether it has just been found.

        The datum is laid so that the last of some fixes that fit each other is where the robot
        believes to be.

        Args:
            readings: Readings of the period.
            now_ns: The graph's time [ns].
            place: Where the robot believes to be in the map [m], shape (3,).

        Raises:
            DatumError: If the fixes lie far from the datum that is given.
        """
        if readings.gnss is not None:
            self._fixes = np.concatenate([self._fixes, readings.gnss])[-_MOST_FIXES:]
        fitting = self._fixes[consistent_fixes(self._fixes)]
        if len(fitting) < _FEW_FIXES or readings.imu is None or readings.mag is None:
            return False
        datum = make_datum(self._given, fitting[::-1], decimal_year(now_ns), place)
        assert datum is not None  # A fix is good.
        self.datum = datum.with_compass(readings)
        return True

    def usable(self, readings: SensorReadings, now: float, localizer: Localizer) -> SensorReadings:
        """Return senses without what needs a datum, while there is none.

        Without fixes for long, the compass keeps the heading that was told.

        Args:
            readings: Readings of the period.
            now: Time since the start [s].
            localizer: Told what to expect of the compass.
        """
        if not self._is_turned and now > SILENCE and readings.mag is not None:
            use_datum(localizer, datum_of_heading(readings, localizer.pose.yaw))
            self._is_turned = True
            self._status(f"no place yet: expected {_missing_fixes(self._fixes)}")
        return replace(readings, gnss=None, mag=readings.mag if self._is_turned else None)


def missing_senses(kept: SensorReadings) -> str:
    """Return what a start by the senses still lacks, in words."""
    found = [
        topic.ros1
        for topic, rows in ((topics.IMU, kept.imu), (topics.MAG, kept.mag))
        if rows is None
    ]
    fixes = np.empty((0, 5)) if kept.gnss is None else kept.gnss
    return " and ".join([*found, _missing_fixes(fixes)])


def _missing_fixes(fixes: NDArray[np.float64]) -> str:
    """Return which fixes a datum still lacks, and why, in words."""
    reasons = "".join(f", {n} refused {why}" for why, n in refused_fixes(fixes).items())
    return (
        f"{_FEW_FIXES} good fixes of {topics.FIX.ros1} that fit each other, got "
        f"{int(consistent_fixes(fixes).sum())} of {len(fixes)}{reasons}"
    )
