"""Where a ray meets objects: convex ones, and porous ones that stop it at random.

Objects are convex: a ray is inside from the last plane that it enters through to the first that it
leaves through (Cyrus and Beck 1978).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.classes import TRAITS, SemanticClass
from terrain.kernel import borrowing_kernel, inlined_kernel
from worlds.rays.geometry import NO_CLASS, Hit, Ray, clip

RATES = np.full(256, np.inf)
"""Expected hits per metre inside of each semantic class [1/m]; infinite where opaque."""
for _semantic, _traits in TRAITS.items():
    RATES[_semantic] = _traits.hits_per_metre

_POROUS = np.array([int(kind) for kind in SemanticClass if np.isfinite(RATES[kind])])
"""Semantic classes that let rays through."""


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


@borrowing_kernel
def absorb(hit: Hit, optical_depth: float, crossings: Crossings) -> Hit:
    """Return the hit of a ray that porous objects stop at an optical depth.

    Between two borders of the objects that the ray is in, its depth grows by the sum of the rates
    of their classes, each class once: two overlapping bushes are one bush.

    Args:
        hit: Hit without the porous objects.
        optical_depth: Depth at which the ray ends.
        crossings: Porous objects that the ray crosses.
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
        if density > 0:
            if density * (border - here) > optical_depth:
                return Hit(here + optical_depth / density, np.int64(densest))
            optical_depth -= density * (border - here)
        here = border
    return hit
