"""Contacts of wheels in MuJoCo: friction along and across a wheel, which turns with the robot.

MuJoCo's friction has two axes in the plane of a contact, and takes them from the map. A tyre slides
more easily along its axle: before the forces are computed, each contact of a wheel is turned so
that its first axis lies in the plane of the wheel and its second along the axle.

A sliding contact of MuJoCo is pushed off the ground, the faster it slides the more (the price of a
convex problem; Todorov 2014, "Convex and analytically-invertible dynamics with contacts and
constraints"). Wheels of a skid-steer robot always slide: they hopped, and it turned at half its
rate. The push rises with the rate at which friction takes slip away, so that this is slower here.
"""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

_SLIDING = 1e-6
"""Least length of a wheel's direction in the plane of a contact; below it the axle is upright."""


@kernel
def align_friction(
    frames: NDArray[np.float64],
    friction: NDArray[np.float64],
    friction_times: NDArray[np.float64],
    geoms: NDArray[np.int32],
    axles: NDArray[np.float64],
    wheel_of: NDArray[np.int64],
    lateral_friction_ratio: float,
    friction_time: float,
) -> None:
    """Turn the contacts of wheels, and lower their friction along the axle.

    Args:
        frames: Normal and two tangents of each contact, row by row, changed in place, shape (n, 9).
        friction: Coefficients of each contact, along both tangents first, changed in place,
            shape (n, 5).
        friction_times: MuJoCo's ``solreffriction``: time in which friction takes slip away [s] and
            its damping ratio, changed in place, shape (n, 2).
        geoms: Numbers of the two shapes of each contact, shape (n, 2).
        axles: Unit vector of each wheel's axle in the map, shape (4, 3).
        wheel_of: Wheel of each shape, -1 for others, shape (number of shapes,).
        lateral_friction_ratio: Friction along the axle as a share of that along the wheel.
        friction_time: Time in which friction takes slip away [s].
    """
    for k in range(len(frames)):
        wheel = max(wheel_of[geoms[k, 0]], wheel_of[geoms[k, 1]])
        if wheel < 0:
            continue
        nx, ny, nz = frames[k, 0], frames[k, 1], frames[k, 2]
        ax, ay, az = axles[wheel, 0], axles[wheel, 1], axles[wheel, 2]
        # Along the wheel: across both its axle and the normal.
        x, y, z = ay * nz - az * ny, az * nx - ax * nz, ax * ny - ay * nx
        size = np.sqrt(x * x + y * y + z * z)
        if size < _SLIDING:
            continue
        x, y, z = x / size, y / size, z / size
        frames[k, 3], frames[k, 4], frames[k, 5] = x, y, z
        frames[k, 6] = ny * z - nz * y
        frames[k, 7] = nz * x - nx * z
        frames[k, 8] = nx * y - ny * x
        friction[k, 1] = friction[k, 0] * lateral_friction_ratio
        friction_times[k, 0], friction_times[k, 1] = friction_time, 1.0
