"""Park furniture: lamps, benches, tables and bins, with sizes drawn from stated ranges.

All functions take the ground, a place in the map [m] and a source of randomness, and return the
convex parts of one object.
"""

import numpy as np

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, box, frustum


def lamp(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a lamp on a post 6 to 12 cm thick."""
    z = float(ground.height_at(x, y))
    radius, height = rng.uniform(0.03, 0.06), rng.uniform(3.0, 4.5)
    post = frustum(SemanticClass.LAMP, (x, y, z - 0.2), (radius, radius), height + 0.2, 8)
    return [post, box(SemanticClass.LAMP, (x, y, z + height), (0.4, 0.4, 0.25))]


def bench(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a bench: a seat on two legs, with or without a back."""
    z, yaw = float(ground.height_at(x, y)), rng.uniform(-np.pi, np.pi)
    length, along = rng.uniform(1.2, 2.0), np.array([np.cos(yaw), np.sin(yaw)])
    seat = box(SemanticClass.BENCH, (x, y, z + 0.43), (length, 0.4, 0.06), yaw)
    parts = [seat]
    for side in (-0.4, 0.4):
        foot = np.array([x, y]) + side * length * along
        parts.append(box(SemanticClass.BENCH, (foot[0], foot[1], z + 0.1), (0.08, 0.35, 0.62), yaw))
    if rng.random() < 0.5:
        back = np.array([x, y]) + 0.18 * np.array([-along[1], along[0]])
        parts.append(
            box(SemanticClass.BENCH, (back[0], back[1], z + 0.65), (length, 0.05, 0.4), yaw)
        )
    return parts


def table(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a table on two trestles, its top 0.7 to 0.8 m high."""
    z, yaw = float(ground.height_at(x, y)), rng.uniform(-np.pi, np.pi)
    length, height = rng.uniform(1.2, 2.0), rng.uniform(0.7, 0.8)
    along = np.array([np.cos(yaw), np.sin(yaw)])
    parts = [box(SemanticClass.TABLE, (x, y, z + height - 0.025), (length, 0.8, 0.05), yaw)]
    for side in (-0.35, 0.35):
        foot = np.array([x, y]) + side * length * along
        middle = (foot[0], foot[1], z + height / 2 - 0.1)
        parts.append(box(SemanticClass.TABLE, middle, (0.08, 0.6, height + 0.1), yaw))
    return parts


def bin_(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a cylindrical bin, 0.7 to 1 m high."""
    base = (x, y, float(ground.height_at(x, y)) - 0.1)
    radius = rng.uniform(0.18, 0.3)
    return [frustum(SemanticClass.BIN, base, (radius, radius), rng.uniform(0.8, 1.1), 10)]
