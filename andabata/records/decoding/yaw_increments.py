"""Yaw increments of gyro, compass and wheels in the same windows of time."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from andabata.machine.robot import RobotModel

Rows = NDArray[np.float64]

Interval = tuple[float, float]
"""Begin and end [s]."""

_WINDOW = 1.0
"""Length of a window [s]."""

_LONGEST_SILENCE = 0.5
"""Longest silence of a sensor within a window [s]."""


@dataclass(frozen=True)
class YawIncrements:
    """Changes of the yaw angle in windows of a second, in the units of each sensor.

    Attributes:
        gyro: Integral of the angular velocity about the vertical, shape (w,).
        compass: Change of the heading [rad], zeros without a compass, shape (w,).
        wheels: Integral of the yaw rate of skid-steer kinematics, as if the wheel speeds were in
            rad/s; zeros without wheels, shape (w,).
    """

    gyro: Rows
    compass: Rows
    wheels: Rows

    @classmethod
    def from_rows(
        cls, imu: Rows, compass: Rows | None, wheels: Rows | None, robot: RobotModel
    ) -> "YawIncrements":
        """Return the yaw increments of rows of readings.

        The vertical is that of the median specific force, so that the IMU may be mounted anyhow, as
        long as the compass is mounted the same way.

        Args:
            imu: Stamp, angular velocity and specific force, in order of time, shape (k, 7).
            compass: Stamp and field, shape (k, 4), or None.
            wheels: Stamp, left and right, shape (k, 3), or None.
            robot: Robot with the wheel radius and track.
        """
        given = [rows for rows in (imu, compass, wheels) if rows is not None and len(rows) > 1]
        if not given or imu[-1, 0] - imu[0, 0] < _WINDOW:
            return cls(*(np.zeros(0) for _ in range(3)))
        begin = max(rows[0, 0] for rows in given)
        end = min(rows[-1, 0] for rows in given)
        edges = _window_edges(given, begin, end)
        up = up_direction(imu)
        increments = np.zeros((3, len(edges)))
        increments[0] = _integral(imu[:, 0], imu[:, 1:4] @ up, edges)
        if compass is not None and len(compass) > 1:
            heading = heading_of(compass[:, 1:4], up)
            increments[1] = _difference(compass[:, 0], heading, edges)
        if wheels is not None and len(wheels) > 1:
            yaw_rate = (wheels[:, 2] - wheels[:, 1]) * robot.wheel_radius / robot.effective_track
            increments[2] = _integral(wheels[:, 0], yaw_rate, edges)
        finite = np.isfinite(increments).all(axis=0)
        return cls(*increments[:, finite])

    def scaled(self, gyro: float, wheels: float) -> "YawIncrements":
        """Return the increments with factors on the gyro's and the wheels'."""
        return replace(self, gyro=self.gyro * gyro, wheels=self.wheels * wheels)


def fitted_slope(a: Rows, b: Rows, min_turn: float, min_correlation: float) -> float | None:
    """Return the least-squares slope of ``b`` over ``a`` through zero, None if it is uncertain.

    Args:
        a: Yaw increments of one sensor, shape (w,).
        b: Yaw increments of another sensor, shape (w,).
        min_turn: Least root of the summed squares of ``b``.
        min_correlation: Least correlation of the two, through zero.
    """
    aa, bb, ab = float(a @ a), float(b @ b), float(a @ b)
    if np.sqrt(bb) < min_turn or aa == 0.0 or abs(ab) < min_correlation * np.sqrt(aa * bb):
        return None
    return ab / aa


def correlation_of(a: Rows, b: Rows) -> float:
    """Return the correlation of two yaw increments, through zero; 0 where one of them is zero."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size > 0 else 0.0


def _window_edges(given: list[Rows], begin: float, end: float) -> Rows:
    """Return begin and end of windows in which no sensor is silent for long [s], shape (w, 2)."""
    runs = common_runs([rows[:, 0] for rows in given], begin, end)
    starts = np.concatenate([np.arange(a, b - _WINDOW, _WINDOW) for a, b in runs] or [np.zeros(0)])
    return np.column_stack([starts, starts + _WINDOW])


def common_runs(sensors: list[Rows], begin: float, end: float) -> list[Interval]:
    """Return the intervals between two times in which no sensor is silent for long.

    Args:
        sensors: Stamps of each sensor in order of time [s].
        begin: Begin of the first interval [s].
        end: End of the last interval [s].
    """
    runs = [(begin, end)]
    for stamps in sensors:
        silences = np.flatnonzero(np.diff(stamps) > _LONGEST_SILENCE)
        ends = [-np.inf, *(at for k in silences for at in (stamps[k], stamps[k + 1])), np.inf]
        runs = _intersection(runs, list(zip(ends[::2], ends[1::2], strict=True)))
    return runs


def _intersection(runs: list[Interval], others: list[Interval]) -> list[Interval]:
    """Return the intersection of two lists of intervals, each in order of time."""
    common, i, j = [], 0, 0
    while i < len(runs) and j < len(others):
        begin, end = max(runs[i][0], others[j][0]), min(runs[i][1], others[j][1])
        if begin < end:
            common.append((begin, end))
        if runs[i][1] < others[j][1]:
            i += 1
        else:
            j += 1
    return common


def up_direction(imu: Rows) -> Rows:
    """Return the upward direction in the IMU's frame, shape (3,)."""
    force = imu[np.isfinite(imu[:, 4:7]).all(axis=1), 4:7]
    median = np.median(force, axis=0) if len(force) else np.zeros(3)
    norm = float(np.linalg.norm(median))
    return np.asarray(median / norm) if norm > 0 else np.array([0.0, 0.0, 1.0])


def heading_of(vectors: Rows, up: Rows) -> Rows:
    """Return the heading from a magnetic field in the body's frame, unwrapped [rad], shape (k,)."""
    left = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.8 else [0.0, 1.0, 0.0])
    left /= np.linalg.norm(left)
    forward = np.cross(left, up)
    # The field is fixed to the world: in the turning body's frame it turns the other way.
    return np.asarray(np.unwrap(-np.arctan2(vectors @ left, vectors @ forward)))


def turned_angle(stamps: Rows, rates: Rows) -> Rows:
    """Return the integral of rates since the first stamp, by the trapezoidal rule, shape (k,)."""
    steps = np.diff(stamps) * (rates[1:] + rates[:-1]) / 2
    return np.concatenate([[0.0], np.cumsum(steps)])


def _integral(stamps: Rows, rates: Rows, edges: Rows) -> Rows:
    """Return the integral of rates over windows, by the trapezoidal rule, shape (w,)."""
    return _difference(stamps, turned_angle(stamps, rates), edges)


def _difference(stamps: Rows, values: Rows, edges: Rows) -> Rows:
    """Return the change of a value over windows, shape (w,)."""
    begin, end = (np.interp(edges[:, k], stamps, values) for k in (0, 1))
    return np.asarray(end - begin)
