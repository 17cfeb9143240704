"""Datum of a live navigator, from given fields and the first fixes that agree."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from andabata.localization.datum import (
    Datum,
    consistent_fixes,
    datum_from_heading,
    make_datum,
    rejected_fixes,
)
from andabata.localization.initial_pose import initial_pose
from andabata.localization.localizer import Localizer
from andabata.machine.magnetic_model import decimal_year
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.records import topics
from andabata.records.recorder import DATUM
from andabata.records.topics import Ros
from andabata.replay.datum import use_datum
from andabata.runs.strict_json import dumps

STATUS_INTERVAL = 10.0
"""Time after which a navigator that lacks readings reports which [s]."""

_MIN_FIXES = 3
"""Number of fixes that have to agree before one of them becomes the datum of a start by sensors."""

_START_FIXES = 5
"""Number of fixes that have to agree before their mean is laid on a given start: that of one of
them would move the map by its whole error, a metre of many receivers."""

_KEPT_FIXES = 30
"""Number of last fixes among which agreement is sought."""


class DatumInitializer:
    """Determines the datum from the fields that the user gives and the first consistent fixes.

    Two cases: without a known start, the datum is the first good fix and the start follows from
    it; with a given start, the datum is laid such that the fixes fall on the estimated positions,
    in the mean.

    Attributes:
        datum: Datum of the map; None until it is determined.
    """

    def __init__(
        self, given: Mapping[str, float], status: Callable[[str], None], ros: Ros = 1
    ) -> None:
        """Begin without a datum.

        Args:
            given: Fields of ``GeoReference`` that the user gives.
            status: Function called with a line of text for the user.
            ros: Version of ROS, whose names of topics the lines use.
        """
        self._given, self._status, self._ros = given, status, ros
        self.datum: Datum | None = None
        self._fixes, self._positions = np.empty((0, 5)), np.empty((0, 3))
        self._has_mag_reference = False

    def initial_pose(self, readings: SensorReadings, now_ns: int) -> Pose | None:
        """Return the pose that readings give, and determine the datum, once enough fixes agree.

        Args:
            readings: All readings of the robot at rest so far.
            now_ns: The graph's time [ns].

        Raises:
            DatumError: If the fixes lie far from the datum that is given.
        """
        if readings.gnss is None:
            return None
        consistent = readings.gnss[consistent_fixes(readings.gnss)]
        if len(consistent) < _MIN_FIXES:
            return None
        datum = self._make_datum(readings.gnss, now_ns)
        pose = initial_pose(replace(readings, gnss=consistent), datum.reference)
        if pose is not None:
            self.datum = datum.with_compass(readings)
        return pose

    def update(self, readings: SensorReadings, now_ns: int, position: NDArray[np.float64]) -> bool:
        """Determine the datum of a given start; return True if this period did.

        The datum is laid such that some consistent fixes are where the robot was, in the mean.

        Args:
            readings: Readings of the period.
            now_ns: The graph's time [ns].
            position: Estimated position of the robot in the map [m], shape (3,).

        Raises:
            DatumError: If the fixes lie far from the datum that is given.
        """
        if readings.gnss is not None:
            here = np.tile(position, (len(readings.gnss), 1))
            self._fixes = np.concatenate([self._fixes, readings.gnss])[-_KEPT_FIXES:]
            self._positions = np.concatenate([self._positions, here])[-_KEPT_FIXES:]
        is_consistent = consistent_fixes(self._fixes)
        if is_consistent.sum() < _START_FIXES or readings.imu is None or readings.mag is None:
            return False
        fixes, positions = self._fixes[is_consistent], self._positions[is_consistent]
        # Newest first: the datum is laid through the first fix, and the robot is there now.
        datum = self._make_datum(fixes[::-1], now_ns, position)
        # Then by the mean distance of all of them from where the robot was.
        error = np.mean(_places(fixes, datum) - positions[:, :2], axis=0)
        datum = self._make_datum(fixes[::-1], now_ns, position - [*error, 0.0])
        if "latitude_deg" not in self._given:
            source = f"the mean of {len(fixes)} good fixes, at the given start"
            datum = replace(datum, source=source)
        self.datum = datum.with_compass(readings)
        return True

    def _make_datum(
        self,
        fixes: NDArray[np.float64],
        now_ns: int,
        position: NDArray[np.float64] | None = None,
    ) -> Datum:
        """Return the datum of fixes of which some are good.

        Raises:
            DatumError: If the fixes lie far from the datum that is given.
        """
        datum = make_datum(self._given, fixes, decimal_year(now_ns), position)
        assert datum is not None  # Consistent fixes are good ones.
        return datum

    def apply(self, localizer: Localizer) -> dict[str, str]:
        """Refer a localizer to the datum, and report the datum to the user.

        Returns:
            Values for the diagnostics by key; empty without a datum.
        """
        if self.datum is None:
            return {}
        use_datum(localizer, self.datum)
        for note in self.datum.notes:
            self._status(note)
        return {DATUM: dumps(self.datum.as_dict())}

    def mask(self, readings: SensorReadings, now: float, localizer: Localizer) -> SensorReadings:
        """Return the readings without those that cannot be used as long as there is no datum.

        After ``STATUS_INTERVAL`` without a datum, magnetic measurements are referred to the given
        heading, which they keep from then on.

        Args:
            readings: Readings of the period.
            now: Time since the start [s].
            localizer: Localizer that gets the reference of the magnetic field.
        """
        if not self._has_mag_reference and now > STATUS_INTERVAL and readings.mag is not None:
            use_datum(localizer, datum_from_heading(readings, localizer.pose.yaw))
            self._has_mag_reference = True
            missing = _missing_fixes(self._fixes, self._ros, _START_FIXES)
            self._status(f"no datum yet: expected {missing}")
        return replace(readings, gnss=None, mag=readings.mag if self._has_mag_reference else None)


def missing_readings(readings: SensorReadings, ros: Ros) -> str:
    """Return which readings a start by sensors alone still lacks, in words.

    Args:
        readings: Readings so far.
        ros: Version of ROS, whose names of topics are used.
    """
    missing = [
        topic.name(ros)
        for topic, rows in ((topics.IMU, readings.imu), (topics.MAG, readings.mag))
        if rows is None
    ]
    fixes = np.empty((0, 5)) if readings.gnss is None else readings.gnss
    return " and ".join([*missing, _missing_fixes(fixes, ros, _MIN_FIXES)])


def _missing_fixes(fixes: NDArray[np.float64], ros: Ros, expected: int) -> str:
    """Return which fixes a datum still lacks, and why, in words."""
    reasons = "".join(f", {n} refused {why}" for why, n in rejected_fixes(fixes).items())
    return (
        f"{expected} good fixes of {topics.FIX.name(ros)} that agree with each other, got "
        f"{int(consistent_fixes(fixes).sum())} of {len(fixes)}{reasons}"
    )


def _places(fixes: NDArray[np.float64], datum: Datum) -> NDArray[np.float64]:
    """Return the places of fixes in the map of a datum [m], shape (k, 2)."""
    level = datum.reference.model_copy(update={"altitude": None})
    return level.to_map(np.column_stack([fixes[:, 1:3], np.zeros(len(fixes))]))[:, :2]
