"""Initial pose of a robot that nobody told: from gravity, the compass and a fix."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.localization.fix_check import check_fixes
from andabata.machine.geo_reference import GeoReference
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings

_WINDOW = 1.0
"""Span of the latest rows of a sense that are averaged [s]: before, the robot may have turned."""


def initial_pose(readings: SensorReadings, reference: GeoReference) -> Pose | None:
    """Return the pose of a robot at rest: tilt by gravity, heading by the compass, place by a fix.

    Args:
        readings: Readings of the robot while it stood.
        reference: Datum of the map, and the magnetic field there.

    Returns:
        The pose in the map, good to some metres and some ten degrees; None while one of the three
        senses has said nothing that can be used.
    """
    tilt, field, place = _tilt(readings), levelled_field(readings), _place(readings, reference)
    if tilt is None or field is None or place is None:
        return None
    north = np.arctan2(reference.flux[1], reference.flux[0])
    yaw = float(north - np.arctan2(field[1], field[0]))
    pose = Pose.from_euler(place, *tilt, yaw)
    if readings.antenna is None:
        return pose
    arm = Rotation.from_quat(pose.quaternion).apply(readings.antenna)
    return Pose(pose.position - arm, pose.quaternion)


def levelled_field(readings: SensorReadings) -> NDArray[np.float64] | None:
    """Return the mean magnetic field, forward, left and up by gravity [T], shape (3,).

    None while the inertial unit or the compass has said nothing that is a number.
    """
    tilt, field = _tilt(readings), _mean(readings.mag, slice(1, 4))
    if tilt is None or field is None:
        return None
    roll, pitch = tilt
    return np.asarray(Rotation.from_euler("ZYX", [0.0, pitch, roll]).apply(field))


def _tilt(readings: SensorReadings) -> tuple[float, float] | None:
    """Return roll and pitch [rad] by gravity."""
    force = _mean(readings.imu, slice(4, 7))
    if force is None:
        return None
    pitch = float(np.arctan2(-force[0], np.hypot(force[1], force[2])))
    return float(np.arctan2(force[1], force[2])), pitch


def _place(readings: SensorReadings, reference: GeoReference) -> NDArray[np.float64] | None:
    """Return the place in the map [m], shape (3,); at the datum's height without an altitude."""
    if readings.gnss is None or not len(readings.gnss):
        return None
    rows = _latest(readings.gnss[check_fixes(readings.gnss).good])
    if not len(rows):
        return None
    known = np.isfinite(rows[:, 3]) & (reference.altitude is not None)
    ground = reference.altitude or 0.0
    geodetic = np.column_stack([rows[:, 1:3], np.where(known, rows[:, 3], ground)])
    places = reference.to_map(geodetic)
    height = places[known, 2].mean() if known.any() else 0.0
    return np.array([places[:, 0].mean(), places[:, 1].mean(), height])


def _latest(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rows whose stamps [s] lie in the last second."""
    return rows[rows[:, 0] > rows[-1, 0] - _WINDOW] if len(rows) else rows


def _mean(rows: NDArray[np.float64] | None, columns: slice) -> NDArray[np.float64] | None:
    """Return the mean of a sense's latest whole rows, None without any."""
    if rows is None:
        return None
    whole = _latest(rows[np.isfinite(rows).all(axis=1)])
    return whole[:, columns].mean(axis=0) if len(whole) else None
