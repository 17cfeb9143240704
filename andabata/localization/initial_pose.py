"""Initial pose of a robot at rest from its own sensors: gravity, the compass and a fix."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from andabata.localization.fix_check import check_fixes
from andabata.machine.geo_reference import GeoReference
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings

_WINDOW = 1.0
"""Span of the latest rows of a sensor that are averaged [s]: before, the robot may have turned."""


def initial_pose(readings: SensorReadings, reference: GeoReference) -> Pose | None:
    """Return the pose of a robot at rest: tilt by gravity, heading by compass, position by a fix.

    Args:
        readings: Readings of the robot at rest.
        reference: Datum of the map, and the magnetic field there.

    Returns:
        Pose in the map, accurate to some metres and some ten degrees; None while one of the three
        sensors has sent nothing that can be used.
    """
    tilt, field = _tilt(readings), levelled_field(readings)
    position = _position(readings, reference)
    if tilt is None or field is None or position is None:
        return None
    # The levelled field and the field of the place differ by the yaw.
    north = np.arctan2(reference.flux[1], reference.flux[0])
    yaw = float(north - np.arctan2(field[1], field[0]))
    pose = Pose.from_euler(position, *tilt, yaw)
    if readings.antenna is None:
        return pose
    arm = Rotation.from_quat(pose.quaternion).apply(readings.antenna)
    return Pose(pose.position - arm, pose.quaternion)


def levelled_field(readings: SensorReadings) -> NDArray[np.float64] | None:
    """Return the mean magnetic field, forward, left and up by gravity [T], shape (3,).

    Args:
        readings: Readings of the robot at rest.

    Returns:
        Field, or None while inertial unit or compass have sent no finite row.
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


def _position(readings: SensorReadings, reference: GeoReference) -> NDArray[np.float64] | None:
    """Return the position in the map [m], shape (3,), at the datum's height without altitude."""
    if readings.gnss is None or not len(readings.gnss):
        return None
    rows = _latest(readings.gnss[check_fixes(readings.gnss).good])
    if not len(rows):
        return None
    known = np.isfinite(rows[:, 3]) & (reference.altitude is not None)
    ground = reference.altitude or 0.0
    geodetic = np.column_stack([rows[:, 1:3], np.where(known, rows[:, 3], ground)])
    positions = reference.to_map(geodetic)
    height = positions[known, 2].mean() if known.any() else 0.0
    return np.array([positions[:, 0].mean(), positions[:, 1].mean(), height])


def _latest(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the rows whose stamps [s] lie in the last second."""
    return rows[rows[:, 0] > rows[-1, 0] - _WINDOW] if len(rows) else rows


def _mean(rows: NDArray[np.float64] | None, columns: slice) -> NDArray[np.float64] | None:
    """Return the mean of a sensor's latest finite rows, None without any."""
    if rows is None:
        return None
    finite = _latest(rows[np.isfinite(rows).all(axis=1)])
    return finite[:, columns].mean(axis=0) if len(finite) else None
