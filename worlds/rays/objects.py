"""Where a ray meets objects: convex ones, and porous ones whose leaves stop it.

Objects are convex: a ray is inside from the last plane that it enters through to the first that it
leaves through (Cyrus and Beck 1978).

A plant is a lattice of cells of 8 cm, some of which hold leaves. Which ones follows from the place,
so that whoever looks twice sees the same leaves and gaps; one beam in seven slips through leaves
that stop the others. Grass and stalks stand upright: their cells are columns. In wind a share of
the cells changes now and then: whether one of them holds leaves follows from place and time.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.classes import TRAITS, SemanticClass
from terrain.counter_rng import uniform
from terrain.kernel import borrowing_kernel, inlined_kernel
from worlds.rays.geometry import NO_CLASS, Hit, Ray, clip
from worlds.rays.wind import Wind, stirred_chance

RATES = np.full(256, np.inf)
"""Expected hits per metre inside of each semantic class [1/m]; infinite where opaque."""
for _semantic, _traits in TRAITS.items():
    RATES[_semantic] = _traits.hits_per_metre

_POROUS = np.array([int(kind) for kind in SemanticClass if np.isfinite(RATES[kind])])
"""Semantic classes that let rays through."""


LEAF = 0.08
"""Edge of a cell of leaves [m]."""

_SAMPLE = 0.04
"""Distance between two places of a ray that are tested for leaves [m]."""

_LEAF_DEPTH = 2.0
"""Optical depth of a cell of leaves from side to side."""

_UPRIGHT = np.array(
    [
        kind in (SemanticClass.HIGH_GRASS, SemanticClass.STALKS, SemanticClass.MEADOW)
        for kind in range(256)
    ]
)
"""True for the semantic classes whose leaves are columns."""

_KEY = np.uint64(0x6C6561766573)
"""Key of the random numbers of leaves."""


class Crossings(NamedTuple):
    """Porous objects that one ray crosses, in the order in which they were found.

    Attributes:
        enters: Range at which the ray enters each [m], shape (n,).
        leaves: Range at which the ray leaves each [m], shape (n,).
        kinds: Semantic class of each, uint8, shape (n,).
    """

    enters: NDArray[np.float64]
    leaves: NDArray[np.float64]
    kinds: NDArray[np.uint8]


@inlined_kernel
def misses_box(ray: Ray, boxes: NDArray[np.float64], k: int, max_range: float) -> bool:
    """Return True if a ray does not cross the bounding box of object ``k`` within a range [m]."""
    begin, end = clip(ray.x, ray.ix, boxes[k, 0], boxes[k, 3], 0.0, max_range)
    begin, end = clip(ray.y, ray.iy, boxes[k, 1], boxes[k, 4], begin, end)
    begin, end = clip(ray.z, ray.iz, boxes[k, 2], boxes[k, 5], begin, end)
    return begin > end


@borrowing_kernel
def cross(planes: NDArray[np.float64], first: int, last: int, ray: Ray) -> tuple[float, float]:
    """Return the ranges [m] at which a ray enters and leaves a convex object.

    The ray misses the object if it leaves before it enters.
    """
    enter, leave = -np.inf, np.inf
    for p in range(first, last):
        nx, ny, nz = planes[p, 0], planes[p, 1], planes[p, 2]
        rate = nx * ray.dx + ny * ray.dy + nz * ray.dz
        depth = planes[p, 3] - (nx * ray.x + ny * ray.y + nz * ray.z)
        if rate < 0:
            enter = max(enter, depth / rate)
        elif rate > 0:
            leave = min(leave, depth / rate)
        elif depth < 0:  # Parallel to the face, and outside of it.
            leave = -np.inf
        if enter > leave:
            break
    return enter, leave


@inlined_kernel
def leaf_chance(ray: Ray, distance: float, kind: int, wind: Wind, time: float) -> float:
    """Return the random number of the cell of leaves at a range of a ray, from 0 to 1.

    Args:
        ray: The ray.
        distance: Range [m].
        kind: Semantic class of the plant.
        wind: Wind in the world.
        time: Time of the ray [s].
    """
    i = int(np.floor((ray.x + distance * ray.dx) / LEAF)) + 0x80000
    j = int(np.floor((ray.y + distance * ray.dy) / LEAF)) + 0x80000
    k = 0 if _UPRIGHT[kind] else int(np.floor((ray.z + distance * ray.dz) / LEAF)) + 0x80000
    cell = np.uint64(((i << 20) + j) * 0x100000 + k)
    chance = uniform(_KEY, cell)
    return stirred_chance(chance, cell, wind, time) if wind.share > 0.0 else chance


@borrowing_kernel
def absorb(
    ray: Ray, hit: Hit, optical_depth: float, crossings: Crossings, wind: Wind, time: float
) -> Hit:
    """Return the hit of a ray that porous objects stop at an optical depth.

    Between two borders of the objects that the ray is in, the share of cells with leaves follows
    from the sum of the rates of their classes, each class once: two overlapping bushes are one
    bush. The mean free path is that of the rates.

    Args:
        ray: The ray.
        hit: Hit without the porous objects.
        optical_depth: Depth at which the ray ends.
        crossings: Porous objects that the ray crosses.
        wind: Wind in the world.
        time: Time of the ray [s].
    """
    here = 0.0
    while here < hit.range:
        density, fastest, densest, border = 0.0, 0.0, NO_CLASS, hit.range
        for kind in _POROUS:
            inside = False
            for n in range(len(crossings.kinds)):
                if crossings.kinds[n] == kind and crossings.enters[n] <= here < crossings.leaves[n]:
                    inside, border = True, min(border, crossings.leaves[n])
                elif crossings.enters[n] > here:
                    border = min(border, crossings.enters[n])
            if inside:
                density += RATES[kind]
                # The densest class is the most likely to have stopped the ray.
                if RATES[kind] > fastest:
                    fastest, densest = RATES[kind], kind
        if density > 0 and optical_depth <= 0:  # At the first face, leaves or not.
            return Hit(here, np.int64(densest))
        if density > 0:
            # Of the rays through a cell with leaves some pass: the others make the rate.
            share = (1.0 - np.exp(-density * LEAF)) / (1.0 - np.exp(-_LEAF_DEPTH))
            while here < border:
                there = min(here + _SAMPLE, border)
                if leaf_chance(ray, (here + there) / 2, densest, wind, time) < share:
                    depth = (there - here) * _LEAF_DEPTH / LEAF
                    if depth > optical_depth:
                        distance = here + optical_depth * LEAF / _LEAF_DEPTH
                        return Hit(distance, np.int64(densest))
                    optical_depth -= depth
                here = there
        here = border
    return hit
