"""Contacts of a body with ray-cast wheels: where it is, how it moves, and the ground's surface."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.vectors import Axes, Vector, cross
from terrain.kernel import inlined_kernel
from worlds.walking import HeightGrid

DEEPEST = 0.05
"""Largest depth of a contact that presses [m]: a body put down inside of something is not shot
out."""

TORQUE, MOMENT = 3, 6
"""Columns of the loads of a body after its force [N]: torque [N m], and moment about the axle of
each wheel [N m]; in all 10."""


class Motion(NamedTuple):
    """Place and motion of a body.

    Attributes:
        place: Centre of mass in the map [m].
        axes: Axes of the body.
        velocity: Velocity of the centre of mass [m/s].
        spin: Angular velocity in the axes of the map [rad/s].
    """

    place: Vector
    axes: Axes
    velocity: Vector
    spin: Vector


class Touch(NamedTuple):
    """A contact.

    Attributes:
        depth: Overlap along the normal [m].
        normal: Unit vector out of what is touched.
        arm: Place from the centre of mass [m].
    """

    depth: float
    normal: Vector
    arm: Vector


@inlined_kernel
def surface(ground: HeightGrid, x: float, y: float) -> tuple[float, float, float]:
    """Return height [m] of the ground at a place [m], and its triangle's slopes along x and y.

    Beyond the border there is no ground: its height is minus infinity.
    """
    heights, cell = ground
    nx, ny = heights.shape
    u, v = x / cell + (nx - 1) / 2, y / cell + (ny - 1) / 2
    if not (0.0 <= u <= nx - 1.0 and 0.0 <= v <= ny - 1.0):
        return -np.inf, 0.0, 0.0
    i, j = min(int(u), nx - 2), min(int(v), ny - 2)
    u, v = u - i, v - j
    h10, h01 = np.float64(heights[i + 1, j]), np.float64(heights[i, j + 1])
    if u + v <= 1.0:
        corner = np.float64(heights[i, j])
        along_x, along_y = h10 - corner, h01 - corner
        z = corner + u * along_x + v * along_y
        return z, along_x / cell, along_y / cell
    corner = np.float64(heights[i + 1, j + 1])
    along_x, along_y = corner - h01, corner - h10
    z = corner - (1.0 - u) * along_x - (1.0 - v) * along_y
    return z, along_x / cell, along_y / cell


@inlined_kernel
def touch_ground(motion: Motion, arm: Vector, ground: HeightGrid) -> Touch:
    """Return the contact of one point of the body with the ground; its depth is 0 above it.

    Args:
        motion: Place and motion of the body.
        arm: The point from the centre of mass [m].
        ground: Heights and cell of the ground.
    """
    z, slope_x, slope_y = surface(ground, motion.place[0] + arm[0], motion.place[1] + arm[1])
    depth = z - motion.place[2] - arm[2]
    if depth <= 0.0:
        return Touch(0.0, motion.axes.up, arm)
    rise = 1.0 / np.sqrt(1.0 + slope_x * slope_x + slope_y * slope_y)
    return Touch(depth * rise, (-slope_x * rise, -slope_y * rise, rise), arm)


@inlined_kernel
def add_force(loads: NDArray[np.float64], force: Vector, arm: Vector) -> None:
    """Add a force [N] that acts at an arm from the centre of mass [m] to force and torque."""
    torque = cross(arm, force)
    for c in range(3):
        loads[c] += force[c]
        loads[TORQUE + c] += torque[c]
