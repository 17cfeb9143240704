"""Trees, bushes, grass, rocks and fallen trunks, with sizes drawn from stated ranges.

All functions take the ground, a place in the map [m] and a source of randomness, and return the
convex parts of one object.
"""

from dataclasses import replace

import numpy as np

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, ellipsoid, frustum, log, rock


def tree(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a trunk 0.1 to 0.5 m thick with a crown; one in five has branches at 0.6 to 1.2 m."""
    z = float(ground.height_at(x, y))
    radius = 0.05 + 0.2 * rng.beta(1.5, 2.0)
    height = rng.uniform(3.0, 7.0)
    trunk = frustum(SemanticClass.TRUNK, (x, y, z - 0.3), (radius, 0.7 * radius), height, 8)
    foot = rng.uniform(0.6, 1.2) if rng.random() < 0.2 else rng.uniform(1.5, 2.6)
    reach = rng.uniform(0.8, 1.8)
    if rng.random() < 0.5:
        crown = frustum(
            SemanticClass.FOLIAGE, (x, y, z + foot), (reach, 0.05), height - foot + 1.0, 8
        )
    else:
        half = (height - foot) / 2
        crown = ellipsoid(SemanticClass.FOLIAGE, (x, y, z + foot + half), (reach, reach, half))
    return [trunk, crown]


def grass(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a clump of high grass, 0.2 to 1.2 m high."""
    height, radius = rng.uniform(0.2, 1.2), rng.uniform(0.2, 0.55)
    base = (x, y, float(ground.height_at(x, y)) - 0.1)
    return [frustum(SemanticClass.HIGH_GRASS, base, (radius, 0.7 * radius), height + 0.1, 7)]


def bush(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a bush, 0.4 to 1.4 m high."""
    height, radius = rng.uniform(0.4, 1.4), rng.uniform(0.3, 0.8)
    centre = (x, y, float(ground.height_at(x, y)) + 0.4 * height)
    return [ellipsoid(SemanticClass.BUSH, centre, (radius, radius, 0.6 * height))]


def boulder(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a rock of 0.05 to 1 m above the ground, log-uniformly distributed."""
    height = 0.05 * 20.0 ** rng.uniform(0.0, 1.0)
    radii = np.array([rng.uniform(0.7, 1.4), rng.uniform(0.7, 1.4), 1.0]) * height
    base = (x, y, float(ground.height_at(x, y)))
    return [rock(base, radii, rng)]


def stone(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a stone of 2 to 4.5 cm above the ground, which a wheel of 10 cm radius rolls over."""
    height = rng.uniform(0.02, 0.045)
    radii = np.array([rng.uniform(1.0, 3.0), rng.uniform(1.0, 3.0), 1.0]) * height
    body = rock((x, y, float(ground.height_at(x, y))), radii, rng)
    return [replace(body, semantic=SemanticClass.STONE)]


def fallen_trunk(
    ground: Heightfield, x: float, y: float, rng: np.random.Generator
) -> list[SceneObject]:
    """Return a fallen trunk, 2 to 6 m long."""
    length, radius = rng.uniform(2.0, 6.0), rng.uniform(0.08, 0.25)
    yaw = rng.uniform(0.0, np.pi)
    ends = np.array([[x, y], [x + length * np.cos(yaw), y + length * np.sin(yaw)]])
    heights = ground.height_at(ends[:, 0], ends[:, 1]) + 0.8 * radius
    points = np.column_stack([ends, heights])
    return [log(points[0], points[1], radius)]
