"""Rays as compiled code reads them: direction, parts and the nearest hit."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel

NO_CLASS = 255
"""Class of a ray without a hit."""


class Ray(NamedTuple):
    """A ray in the map frame.

    Attributes:
        x: Map x of the origin [m].
        y: Map y of the origin [m].
        z: Map z of the origin [m].
        dx: Component of the unit direction along x.
        dy: Component of the unit direction along y.
        dz: Component of the unit direction along z.
        ix: Inverse of ``dx``, infinite for a ray across x.
        iy: Inverse of ``dy``.
        iz: Inverse of ``dz``.
    """

    x: float
    y: float
    z: float
    dx: float
    dy: float
    dz: float
    ix: float
    iy: float
    iz: float


class Span(NamedTuple):
    """A part of a ray; empty if it ends before it begins.

    Attributes:
        begin: Range at which it begins [m].
        end: Range at which it ends [m].
    """

    begin: float
    end: float


class Hit(NamedTuple):
    """The nearest hit of a ray so far.

    Attributes:
        range: Range [m], infinite without a hit.
        kind: Semantic class, ``NO_CLASS`` without a hit.
    """

    range: float
    kind: np.int64


@inlined_kernel
def read_ray(rays: NDArray[np.float32], k: int) -> Ray:
    """Return one ray in double precision."""
    dx, dy, dz = np.float64(rays[k, 3]), np.float64(rays[k, 4]), np.float64(rays[k, 5])
    x, y, z = np.float64(rays[k, 0]), np.float64(rays[k, 1]), np.float64(rays[k, 2])
    return Ray(x, y, z, dx, dy, dz, 1.0 / dx, 1.0 / dy, 1.0 / dz)


@inlined_kernel
def clip(
    origin: float, inverse: float, low: float, high: float, begin: float, stop: float
) -> tuple[float, float]:
    """Return the part of ``begin`` to ``stop`` [m] in which one coordinate is between two bounds.

    Source: Kay and Kajiya 1986, "Ray tracing complex scenes" (slabs).
    """
    if np.isinf(inverse):  # The ray runs along the slab: it is inside all the way, or never.
        if origin < low or origin > high:
            stop = -1.0
    else:
        a, b = (low - origin) * inverse, (high - origin) * inverse
        begin, stop = max(begin, min(a, b)), min(stop, max(a, b))
    return begin, stop
