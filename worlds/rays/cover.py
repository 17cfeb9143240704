"""Where a beam stops in short grass and leaves.

The cover of the ground is a forest of blades, one to a column of 5 cm at the most. Which columns
have a blade, and how high, follows from the place: whoever looks twice sees the same leaves and the
same gaps.
"""

import numpy as np

from terrain.counter_rng import uniform
from terrain.kernel import inlined_kernel
from worlds.rays.ground import GridRay, cell_height
from worlds.rays.layout import Ground

COLUMN = 0.05
"""Edge of the column of a blade [m]."""

_DENSITY = 0.28
"""Share of the columns that have a blade: a mean free path of 0.15 m (assumption)."""

_LOWEST = 0.25
"""Height of the lowest blade as a share of the cover's."""

_STEP = 0.025
"""Distance between two places of a beam that are tested [m]."""

_MOST = 160
"""Largest number of places: a beam of one in 25 comes down through 15 cm of grass in as many."""

_HIGHEST = 0.16
"""Height above the ground over which there is no cover [m]."""

_KEY = np.uint64(0x636F766572)
"""Key of the random numbers of blades."""


@inlined_kernel
def blade_height(x: float, y: float) -> float:
    """Return the height of the blade at a place in the map as a share of the cover's, 0 for none.

    Args:
        x: Map x [m].
        y: Map y [m].
    """
    i, j = int(np.floor(x / COLUMN)), int(np.floor(y / COLUMN))
    column = np.uint64((i + 0x40000000) * 0x80000000 + (j + 0x40000000))
    chance = uniform(_KEY, column)
    return 0.0 if chance >= _DENSITY else _LOWEST + (1.0 - _LOWEST) * chance / _DENSITY


@inlined_kernel
def stop_in_cover(ground: Ground, ray: GridRay, hit: float) -> float:
    """Return the range at which a blade stops a beam on its way to what it would hit [m].

    From there back the beam is followed until it is above all cover.

    Args:
        ground: The ground, with cover.
        ray: The ray in coordinates of the ground's grid.
        hit: Range of its hit without cover [m], which is returned if no blade is in the way.
    """
    nx, ny = ground.cover.shape
    frame, stop = ground.frame, hit
    for k in range(_MOST):
        t = hit - k * _STEP
        u, v = ray.u + t * ray.du, ray.v + t * ray.dv
        if t <= 0 or u < 0 or v < 0 or u >= nx or v >= ny:
            break
        a, b = int(u), int(v)
        h00, h10 = np.float64(ground.heights[a, b]), np.float64(ground.heights[a + 1, b])
        h01, h11 = np.float64(ground.heights[a, b + 1]), np.float64(ground.heights[a + 1, b + 1])
        above = ray.z + t * ray.dz - cell_height(h00, h10, h01, h11, u - a, v - b)
        if above > _HIGHEST:
            break
        height = 0.01 * ground.cover[a, b]
        if above < height:
            x, y = frame.x_min + u * frame.cell, frame.y_min + v * frame.cell
            if above < height * blade_height(x, y):
                stop = t
    return stop
