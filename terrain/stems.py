"""Bushes and small trees on solid stems: what of a plant stops a robot, and a beam at any time.

As in ``terrain.plants``: the ground, a place and a source of randomness in, convex parts out. Stems
and branches are trunks of a few centimetres; crowns are leaves as those of other plants.
"""

import numpy as np
from numpy.typing import NDArray

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, ellipsoid, rod

_FOOT = 0.1
"""Depth of a stem under the ground [m]."""


def shrub(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a bush of 0.5 to 1.6 m on 2 to 6 stems, 2 to 6 cm thick, that lean outwards."""
    high, reach = rng.uniform(0.5, 1.6), rng.uniform(0.35, 0.9)
    foot = np.array([x, y, float(ground.height_at(x, y))])
    up = np.array([0.0, 0.0, high])
    crown = ellipsoid(SemanticClass.BUSH, foot + 0.5 * up, (reach, reach, 0.5 * high))
    parts = [crown]
    turn = rng.uniform(-np.pi, np.pi)
    count = int(rng.integers(2, 7))
    for k in range(count):
        yaw = turn + 2 * np.pi * k / count + rng.normal(0.0, 0.3)
        aside = np.array([np.cos(yaw), np.sin(yaw), 0.0])
        root = foot + rng.uniform(0.03, 0.12) * aside - np.array([0.0, 0.0, _FOOT])
        tip = foot + rng.uniform(0.3, 0.6) * reach * aside + 0.75 * up
        parts.append(rod(SemanticClass.TRUNK, root, tip, rng.uniform(0.01, 0.03)))
    return parts


def sapling(ground: Heightfield, x: float, y: float, rng: np.random.Generator) -> list[SceneObject]:
    """Return a small tree of 1.5 to 4.5 m: one stem of 4 to 20 cm, or a clump of up to 4.

    Half of them are clumps, whose stems are thinner. Each stem has 2 to 4 branches, 2 to 5 cm
    thick, and a crown of its own.
    """
    count = 1 if rng.random() < 0.5 else int(rng.integers(2, 5))
    turn = rng.uniform(-np.pi, np.pi)
    parts: list[SceneObject] = []
    for k in range(count):
        yaw = turn + 2 * np.pi * k / count + rng.normal(0.0, 0.3)
        away = rng.uniform(0.15, 0.4) if count > 1 else 0.0
        u, v = x + away * np.cos(yaw), y + away * np.sin(yaw)
        foot = np.array([u, v, float(ground.height_at(u, v))])
        thick = rng.uniform(0.02, 0.1) / (1.0 if count == 1 else 1.5)
        parts.extend(_stem(foot, yaw, thick, rng))
    return parts


def _stem(
    foot: NDArray[np.float64], yaw: float, radius: float, rng: np.random.Generator
) -> list[SceneObject]:
    """Return a stem that leans by a few degrees towards a heading [rad], with branches and crown.

    Args:
        foot: Place on the ground [m], shape (3,).
        yaw: Heading [rad].
        radius: Radius of the stem [m].
        rng: Source of its height, branches and crown.
    """
    high = rng.uniform(1.5, 3.0) + 15.0 * radius
    lean = rng.uniform(0.03, 0.15)
    axis = np.array([lean * np.cos(yaw), lean * np.sin(yaw), 1.0])
    parts = [rod(SemanticClass.TRUNK, foot - _FOOT * axis, foot + 0.8 * high * axis, radius)]
    begin = rng.uniform(0.25, 0.45) * high
    half = (high - begin) / 2
    reach = rng.uniform(0.4, 0.9)
    middle = foot + (begin + half) * axis
    parts.append(ellipsoid(SemanticClass.FOLIAGE, middle, (reach, reach, half)))
    for _ in range(int(rng.integers(2, 5))):
        heading, height = rng.uniform(-np.pi, np.pi), rng.uniform(0.3, 0.7) * high
        start = foot + height * axis
        aside = np.array([np.cos(heading), np.sin(heading), rng.uniform(0.3, 1.0)])
        thick = min(rng.uniform(0.01, 0.025), 0.7 * radius)
        parts.append(rod(SemanticClass.TRUNK, start, start + 0.7 * reach * aside, thick))
    return parts
