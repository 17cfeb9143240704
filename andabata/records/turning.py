"""Turns of a robot as gyro, compass and wheels tell them, in the same windows of time."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from andabata.machine.robot import RobotModel

Rows = NDArray[np.float64]

_WINDOW = 1.0
"""Length of a window [s]."""

_HOLE = 0.5
"""A window in which a sense is silent for longer is left out [s]."""


@dataclass(frozen=True)
class Turning:
    """Turns about the vertical in windows of a second, in the units in which they came.

    Attributes:
        gyro: Integral of the angular velocity, shape (w,).
        compass: Turn of the heading [rad], zeros without a compass, shape (w,).
        wheels: Turn by the difference of the sides, as if they were in rad/s, zeros without
            wheels, shape (w,).
    """

    gyro: Rows
    compass: Rows
    wheels: Rows

    @classmethod
    def of(
        cls, imu: Rows, compass: Rows | None, wheels: Rows | None, robot: RobotModel
    ) -> "Turning":
        """Return the turns that rows of the senses tell.

        The vertical is that of the mean specific force: however the IMU is mounted, and as long as
        the compass is mounted the same way.

        Args:
            imu: Stamp, angular velocity and specific force, in order of time, shape (k, 7).
            compass: Stamp and field, shape (k, 4), or None.
            wheels: Stamp, left and right, shape (k, 3), or None.
            robot: Wheel radius and track.
        """
        given = [rows for rows in (imu, compass, wheels) if rows is not None and len(rows) > 1]
        if not given or imu[-1, 0] - imu[0, 0] < _WINDOW:
            return cls(*(np.zeros(0) for _ in range(3)))
        begin = max(rows[0, 0] for rows in given)
        end = min(rows[-1, 0] for rows in given)
        edges = _edges(given, begin, end)
        up = _up(imu)
        windows = np.zeros((3, len(edges)))
        windows[0] = _integral(imu[:, 0], imu[:, 1:4] @ up, edges)
        if compass is not None and len(compass) > 1:
            heading = _heading(compass[:, 1:4], up)
            windows[1] = _difference(compass[:, 0], heading, edges)
        if wheels is not None and len(wheels) > 1:
            yaw_rate = (wheels[:, 2] - wheels[:, 1]) * robot.wheel_radius / robot.effective_track
            windows[2] = _integral(wheels[:, 0], yaw_rate, edges)
        whole = np.isfinite(windows).all(axis=0)
        return cls(*windows[:, whole])

    def scaled(self, gyro: float, wheels: float) -> "Turning":
        """Return the turns with factors on the gyro's and the wheels'."""
        return replace(self, gyro=self.gyro * gyro, wheels=self.wheels * wheels)


def slope(a: Rows, b: Rows, least: float, alike: float) -> float | None:
    """Return by how much of ``a`` the other turns, None where too little is told.

    Args:
        a: Turns in windows, shape (w,).
        b: Those of another sense, shape (w,).
        least: Root of the summed squares of ``b`` below which it tells nothing.
        alike: Correlation of the two from which the slope is believed.
    """
    aa, bb, ab = float(a @ a), float(b @ b), float(a @ b)
    if np.sqrt(bb) < least or aa == 0.0 or abs(ab) < alike * np.sqrt(aa * bb):
        return None
    return ab / aa


def _edges(given: list[Rows], begin: float, end: float) -> Rows:
    """Return begin and end of windows in which no sense is silent, shape (w, 2)."""
    runs = [(begin, end)]
    for rows in given:
        stamps = rows[:, 0]
        holes = [(stamps[k], stamps[k + 1]) for k in np.flatnonzero(np.diff(stamps) > _HOLE)]
        ends = [-np.inf, *(at for hole in holes for at in hole), np.inf]
        runs = _common(runs, list(zip(ends[::2], ends[1::2], strict=True)))
    starts = np.concatenate([np.arange(a, b - _WINDOW, _WINDOW) for a, b in runs] or [np.zeros(0)])
    return np.column_stack([starts, starts + _WINDOW])


def _common(
    runs: list[tuple[float, float]], others: list[tuple[float, float]]
) -> list[tuple[float, float]]:
    """Return where both of two lists of runs are, each in order of time."""
    found, i, j = [], 0, 0
    while i < len(runs) and j < len(others):
        begin, end = max(runs[i][0], others[j][0]), min(runs[i][1], others[j][1])
        if begin < end:
            found.append((begin, end))
        if runs[i][1] < others[j][1]:
            i += 1
        else:
            j += 1
    return found


def _up(imu: Rows) -> Rows:
    """Return the upward direction in the IMU's frame, shape (3,)."""
    force = imu[np.isfinite(imu[:, 4:7]).all(axis=1), 4:7]
    mean = np.median(force, axis=0) if len(force) else np.zeros(3)
    norm = float(np.linalg.norm(mean))
    return np.asarray(mean / norm) if norm > 0 else np.array([0.0, 0.0, 1.0])


def _heading(vectors: Rows, up: Rows) -> Rows:
    """Return the heading that a field in the body's frame tells, unwrapped [rad]."""
    aside = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.8 else [0.0, 1.0, 0.0])
    aside /= np.linalg.norm(aside)
    ahead = np.cross(aside, up)
    # The field stays and the body turns: seen from it, the field turns the other way.
    return np.asarray(np.unwrap(-np.arctan2(vectors @ aside, vectors @ ahead)))


def _integral(stamps: Rows, rates: Rows, edges: Rows) -> Rows:
    """Return the integral of rates in windows."""
    steps = np.diff(stamps) * (rates[1:] + rates[:-1]) / 2
    return _difference(stamps, np.concatenate([[0.0], np.cumsum(steps)]), edges)


def _difference(stamps: Rows, values: Rows, edges: Rows) -> Rows:
    """Return how a value changes in windows."""
    begin, end = (np.interp(edges[:, k], stamps, values) for k in (0, 1))
    return np.asarray(end - begin)
