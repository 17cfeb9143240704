"""Attitude of a body whose four wheels rest on the ground."""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

_X, _Y = range(2)
"""Columns of the wheels' contact points."""


@kernel
def fit_wheel_plane(
    heights: NDArray[np.float32],
    cell: float,
    x0: float,
    y0: float,
    c: float,
    s: float,
    wheels: NDArray[np.float64],
) -> tuple[float, float, float]:
    """Return height [m], roll and pitch [rad] of the least-squares plane under the wheels.

    Args:
        heights: Heights of the ground's nodes [m], centred on the map's origin, shape (nx, ny).
        cell: Distance between two nodes [m].
        x0: Place of the body in the map [m].
        y0: Place of the body in the map [m].
        c: Cosine of the heading.
        s: Sine of the heading.
        wheels: Contact points in the base frame, symmetric about its origin [m], shape (k, 2).
    """
    nx, ny = heights.shape
    mean, sum_xz, sum_yz, sum_xx, sum_yy = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(wheels)):
        # Wheel in the map, then in units of cells from the first node; the border is continued.
        x = x0 + c * wheels[k, _X] - s * wheels[k, _Y]
        y = y0 + s * wheels[k, _X] + c * wheels[k, _Y]
        u = min(max(x / cell + (nx - 1) / 2, 0.0), nx - 1.0)
        v = min(max(y / cell + (ny - 1) / 2, 0.0), ny - 1.0)
        i, j = min(int(u), nx - 2), min(int(v), ny - 2)
        u, v = u - i, v - j
        # Each cell is two triangles, as in the ray scene and in pybullet: interpolate in the one
        # that the wheel stands on.
        if u + v <= 1.0:
            z = heights[i, j] + u * (heights[i + 1, j] - heights[i, j])
            z += v * (heights[i, j + 1] - heights[i, j])
        else:
            z = heights[i + 1, j + 1] + (1 - u) * (heights[i, j + 1] - heights[i + 1, j + 1])
            z += (1 - v) * (heights[i + 1, j] - heights[i + 1, j + 1])
        mean += z / len(wheels)
        sum_xz += z * wheels[k, _X]
        sum_yz += z * wheels[k, _Y]
        sum_xx += wheels[k, _X] ** 2
        sum_yy += wheels[k, _Y] ** 2
    if sum_xz == 0.0 and sum_yz == 0.0:  # Level ground is frequent: no inverse tangents.
        return mean, 0.0, 0.0
    # The wheels are symmetric, so that both slopes are independent of each other and of the mean.
    slope_x, slope_y = sum_xz / sum_xx, sum_yz / sum_yy
    pitch = -np.arctan(slope_x)  # Nose up is a negative pitch (REP-103).
    return mean, np.arctan(slope_y * np.cos(pitch)), pitch


@kernel
def quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Return the quaternion x, y, z, w of roll, pitch, yaw [rad] (intrinsic z-y-x)."""
    sy, cy = np.sin(yaw / 2), np.cos(yaw / 2)
    if roll == 0.0 and pitch == 0.0:
        return 0.0, 0.0, sy, cy
    cr, sr = np.cos(roll / 2), np.sin(roll / 2)
    cp, sp = np.cos(pitch / 2), np.sin(pitch / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )
