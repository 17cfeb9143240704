"""Vectors of three numbers for compiled code: tuples, which stay in registers.

All are compiled into their callers: as functions of their own they cost the plant of ray-cast
wheels a quarter more time.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel

Vector = tuple[float, float, float]
"""Three components."""


class Axes(NamedTuple):
    """Axes of a body in the map, the columns of its rotation.

    Attributes:
        forward: Unit vector of the body's x axis.
        left: Unit vector of the body's y axis.
        up: Unit vector of the body's z axis.
    """

    forward: Vector
    left: Vector
    up: Vector


@inlined_kernel
def dot(a: Vector, b: Vector) -> float:
    """Return the scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined_kernel
def cross(a: Vector, b: Vector) -> Vector:
    """Return the vector product."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@inlined_kernel
def added(a: Vector, b: Vector, scale: float) -> Vector:
    """Return ``a + scale * b``."""
    return a[0] + scale * b[0], a[1] + scale * b[1], a[2] + scale * b[2]


@inlined_kernel
def to_map(axes: Axes, x: float, y: float, z: float) -> Vector:
    """Return a vector of the body in the axes of the map."""
    forward, left, up = axes
    return (
        x * forward[0] + y * left[0] + z * up[0],
        x * forward[1] + y * left[1] + z * up[1],
        x * forward[2] + y * left[2] + z * up[2],
    )


@inlined_kernel
def axes_of(quaternion: NDArray[np.float64]) -> Axes:
    """Return the axes of a body by its unit quaternion x, y, z, w, shape (4,)."""
    x, y, z, w = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    return Axes(
        (1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)),
        (2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)),
        (2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)),
    )
