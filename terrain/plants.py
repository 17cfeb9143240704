"""Trees, bushes, grass, rocks and fallen trunks, with sizes drawn from stated ranges.

All functions take the ground, a place in the map [m] and a source of randomness, and return the
convex parts of one object. A size that is given, in metres or radians, takes the place of the drawn
one and does not move the others.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, ellipsoid, frustum, log, rock, rod

_CLIMBED = 0.05
"""Height up to which a wheel climbs a root [m]."""


def tree(
    ground: Heightfield,
    x: float,
    y: float,
    rng: np.random.Generator,
    *,
    height: float | None = None,
    radius: float | None = None,
    crown_radius: float | None = None,
) -> list[SceneObject]:
    """Return a trunk 0.1 to 0.5 m thick with a crown; one in five has branches at 0.6 to 1.2 m.

    The crown begins higher on a higher tree; ``height`` is the trunk's, ``radius`` its foot's.
    """
    z = float(ground.height_at(x, y))
    thick = _size(radius, 0.05 + 0.2 * rng.beta(1.5, 2.0))
    drawn = rng.uniform(3.0, 7.0)
    high = _size(height, drawn)
    trunk = frustum(SemanticClass.TRUNK, (x, y, z - 0.3), (thick, 0.7 * thick), high, 8)
    foot = rng.uniform(0.6, 1.2) if rng.random() < 0.2 else rng.uniform(1.5, 2.6)
    foot *= high / drawn
    reach = _size(crown_radius, rng.uniform(0.8, 1.8))
    if rng.random() < 0.5:
        crown = frustum(
            SemanticClass.FOLIAGE, (x, y, z + foot), (reach, 0.05), high - foot + 1.0, 8
        )
    else:
        half = (high - foot) / 2
        crown = ellipsoid(SemanticClass.FOLIAGE, (x, y, z + foot + half), (reach, reach, half))
    return [trunk, crown]


def grass(
    ground: Heightfield,
    x: float,
    y: float,
    rng: np.random.Generator,
    *,
    height: float | None = None,
    radius: float | None = None,
) -> list[SceneObject]:
    """Return a clump of high grass, 0.2 to 1.2 m high."""
    high, reach = _size(height, rng.uniform(0.2, 1.2)), _size(radius, rng.uniform(0.2, 0.55))
    base = (x, y, float(ground.height_at(x, y)) - 0.1)
    return [frustum(SemanticClass.HIGH_GRASS, base, (reach, 0.7 * reach), high + 0.1, 7)]


def bush(
    ground: Heightfield,
    x: float,
    y: float,
    rng: np.random.Generator,
    *,
    height: float | None = None,
    radius: float | None = None,
) -> list[SceneObject]:
    """Return a bush, 0.4 to 1.4 m high."""
    high, reach = _size(height, rng.uniform(0.4, 1.4)), _size(radius, rng.uniform(0.3, 0.8))
    centre = (x, y, float(ground.height_at(x, y)) + 0.4 * high)
    return [ellipsoid(SemanticClass.BUSH, centre, (reach, reach, 0.6 * high))]


def boulder(
    ground: Heightfield,
    x: float,
    y: float,
    rng: np.random.Generator,
    *,
    height: float | None = None,
    radius: float | None = None,
) -> list[SceneObject]:
    """Return a rock of 0.05 to 1 m above the ground, log-uniformly distributed."""
    high = _size(height, 0.05 * 20.0 ** rng.uniform(0.0, 1.0))
    radii = np.array([rng.uniform(0.7, 1.4), rng.uniform(0.7, 1.4), 1.0]) * high
    radii[:2] = radii[:2] if radius is None else radius
    base = (x, y, float(ground.height_at(x, y)))
    return [rock(base, radii, rng)]


def stone(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a stone of 2 to 4.5 cm above the ground, which a wheel of 10 cm radius rolls over."""
    height = rng.uniform(0.02, 0.045)
    radii = np.array([rng.uniform(1.0, 3.0), rng.uniform(1.0, 3.0), 1.0]) * height
    body = rock((x, y, float(ground.height_at(x, y))), radii, rng)
    return [replace(body, semantic=SemanticClass.STONE)]


def fallen_trunk(
    ground: Heightfield,
    x: float,
    y: float,
    rng: np.random.Generator,
    *,
    length: float | None = None,
    radius: float | None = None,
    yaw: float | None = None,
) -> list[SceneObject]:
    """Return a fallen trunk, 2 to 6 m long, one end of which is at the place."""
    long, thick = _size(length, rng.uniform(2.0, 6.0)), _size(radius, rng.uniform(0.08, 0.25))
    angle = _size(yaw, rng.uniform(0.0, np.pi))
    ends = np.array([[x, y], [x + long * np.cos(angle), y + long * np.sin(angle)]])
    heights = ground.height_at(ends[:, 0], ends[:, 1]) + 0.8 * thick
    points = np.column_stack([ends, heights])
    return [log(points[0], points[1], thick)]


def root(ground: Heightfield, course: NDArray[np.float64], height: float) -> list[SceneObject]:
    """Return a root that lies half buried across the ground.

    Args:
        ground: The heightfield.
        course: Corners of its axis [m], shape (k, 2).
        height: Height above the ground [m]; up to 5 cm a wheel climbs it.
    """
    radius = 0.75 * height
    points = np.column_stack([course, ground.height_at(*course.T) + height - radius])
    kind = SemanticClass.ROOT if height <= _CLIMBED else SemanticClass.TRUNK
    return [rod(kind, a, b, radius, sides=8) for a, b in pairwise(points)]


def _size(given: float | None, drawn: float) -> float:
    """Return a size that is given, else the one that was drawn."""
    return drawn if given is None else given
