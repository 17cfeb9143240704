"""How a body on four wheels stands on the ground."""

import numpy as np

from terrain.kernel import kernel


@kernel
def stand(heights, cell, x0, y0, c, s, wheels):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return height [m], roll and pitch [rad] of a body on four wheels (least-squares plane).

    ``c`` and ``s`` are cosine and sine of its heading.
    """
    nx, ny = heights.shape
    mean, rise_x, rise_y, square_x, square_y = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(len(wheels)):
        x = x0 + c * wheels[k, 0] - s * wheels[k, 1]
        y = y0 + s * wheels[k, 0] + c * wheels[k, 1]
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
    if rise_x == 0.0 and rise_y == 0.0:
        return mean, 0.0, 0.0
    slope_x, slope_y = rise_x / square_x, rise_y / square_y
    pitch = -np.arctan(slope_x)
    return mean, np.arctan(slope_y * np.cos(pitch)), pitch


@kernel
def quaternion(roll, pitch, yaw):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return the quaternion x, y, z, w of roll, pitch, yaw [rad]."""
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
