"""How a body on four wheels stands on the ground."""

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def stand(heights, cell, xy_yaw, wheels):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return height [m], roll and pitch [rad] of a body on four wheels (least-squares plane)."""
    c, s = np.cos(xy_yaw[2]), np.sin(xy_yaw[2])
    nx, ny = heights.shape
    mean, rise_x, rise_y, square_x, square_y = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(wheels)):
        x = xy_yaw[0] + c * wheels[k, 0] - s * wheels[k, 1]
        y = xy_yaw[1] + s * wheels[k, 0] + c * wheels[k, 1]
        u = min(max(x / cell + (nx - 1) / 2, 0.0), nx - 1.0)
        v = min(max(y / cell + (ny - 1) / 2, 0.0), ny - 1.0)
        i, j = min(int(u), nx - 2), min(int(v), ny - 2)
        u, v = u - i, v - j
        if u + v <= 1.0:
            z = heights[i, j] + u * (heights[i + 1, j] - heights[i, j])
            z += v * (heights[i, j + 1] - heights[i, j])
        else:
            z = heights[i + 1, j + 1] + (1 - u) * (heights[i, j + 1] - heights[i + 1, j + 1])
            z += (1 - v) * (heights[i + 1, j] - heights[i + 1, j + 1])
        mean += z / len(wheels)
        rise_x += z * wheels[k, 0]
        rise_y += z * wheels[k, 1]
        square_x += wheels[k, 0] ** 2
        square_y += wheels[k, 1] ** 2
    slope_x, slope_y = rise_x / square_x, rise_y / square_y
    pitch = -np.arctan(slope_x)
    return mean, np.arctan(slope_y * np.cos(pitch)), pitch


@njit(cache=True, nogil=True)
def quaternion(roll, pitch, yaw):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return the quaternion x, y, z, w of roll, pitch, yaw [rad]."""
    cr, sr = np.cos(roll / 2), np.sin(roll / 2)
    cp, sp = np.cos(pitch / 2), np.sin(pitch / 2)
    cy, sy = np.cos(yaw / 2), np.sin(yaw / 2)
    return np.array(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ]
    )
