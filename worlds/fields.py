"""Small worlds with one field of plants ahead of a robot at the origin, to test perception.

A field is continuous: nothing of the ground behind its edge may be seen, and no single plant stands
out of it.
"""

from dataclasses import dataclass

import numpy as np

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, frustum
from terrain.stands import KINDS, TILE, tiles
from worlds.truth import TruthConfig, build_truth
from worlds.world import World

_SIZE, _CELL = 26.0, 0.1

_DEPTH, _HALF_WIDTH = 9.0, 9.0
"""Extent of a field from its edge, and to either side [m]."""


@dataclass(frozen=True)
class Field:
    """One field of plants.

    Attributes:
        kind: Semantic class, which says how many beams it stops.
        height: Height of the plants [m].
        distance: Distance of its edge from the robot [m].
        ramp: Stretch over which the plants reach their height [m]; 0 for an abrupt edge.
        gaps: Share of the field without plants.
        slope: Slope of the whole ground [rad].
        trunks: Number of trunks in it.
    """

    kind: SemanticClass
    height: float
    distance: float
    ramp: float
    gaps: float
    slope: float
    trunks: int


def draw_field(rng: np.random.Generator) -> Field:
    """Return a field of 0.2 to 1.2 m whose edge is 1.5 to 5 m away, a third of them on slopes."""
    return Field(
        kind=KINDS[int(rng.integers(len(KINDS)))],
        height=0.2 * 6.0 ** rng.uniform(0.0, 1.0),
        distance=rng.uniform(1.5, 5.0),
        ramp=rng.uniform(0.3, 2.0) * (rng.random() < 0.5),
        gaps=rng.uniform(0.0, 0.3) * (rng.random() < 0.3),
        slope=np.deg2rad(rng.uniform(0.0, 14.0)) * (rng.random() < 0.33),
        trunks=int(rng.integers(0, 5) * (rng.random() < 0.3)),
    )


def make_field(field: Field, bearing: float, rng: np.random.Generator) -> World:
    """Return a world with one field.

    Args:
        field: The field.
        bearing: Direction of the field from the origin [rad], 0 = east, counter-clockwise.
        rng: Source of the slope's direction, of heights, gaps and trunks.
    """
    ground = bare_ground(field.slope, rng)
    ahead, aside = (
        grid.ravel()
        for grid in np.meshgrid(
            np.arange(TILE / 2, _DEPTH, TILE), np.arange(-_HALF_WIDTH, _HALF_WIDTH, TILE)
        )
    )
    share = np.clip(ahead / field.ramp, 0.0, 1.0) if field.ramp else np.ones(len(ahead))
    heights = np.maximum(field.height * share * rng.uniform(0.85, 1.15, len(ahead)), 0.03)
    grown = rng.random(len(ahead)) >= field.gaps
    forward = field.distance + ahead
    c, s = np.cos(bearing), np.sin(bearing)
    places = np.column_stack([c * forward - s * aside, s * forward + c * aside])
    objects: list[SceneObject] = tiles(ground, field.kind, places[grown], heights[grown])
    for k in rng.integers(len(places), size=field.trunks):
        x, y = places[k]
        foot = (x, y, float(ground.height_at(x, y)) - 0.2)
        objects.append(frustum(SemanticClass.TRUNK, foot, (0.12, 0.1), 3.0, 8))
    return plain_world("field", ground, tuple(objects))


def bare_ground(slope: float, rng: np.random.Generator) -> Heightfield:
    """Return smooth ground of a slope [rad] in a random direction."""
    n = round(_SIZE / _CELL) + 1
    lines = (np.arange(n) - (n - 1) / 2) * _CELL
    x, y = np.meshgrid(lines, lines, indexing="ij")
    downhill = rng.uniform(-np.pi, np.pi)
    heights = np.tan(slope) * (x * np.cos(downhill) + y * np.sin(downhill))
    return Heightfield(heights.astype(np.float32), _CELL)


def plain_world(
    name: str, ground: Heightfield, objects: tuple[SceneObject, ...] = (), path: bool = False
) -> World:
    """Return a world without tasks.

    Args:
        name: Name of the world.
        ground: Its ground.
        objects: Objects on the ground.
        path: True for a path along the x axis, 2.4 m wide.
    """
    surface = np.zeros(tuple(n - 1 for n in ground.heights.shape), dtype=np.uint8)
    if path:
        middle = surface.shape[1] // 2
        surface[:, middle - 12 : middle + 12] = SemanticClass.PATH
    truth = build_truth(ground, objects, TruthConfig(), surface)
    return World(name, 0, 0.0, ground, surface, objects, (), truth)
