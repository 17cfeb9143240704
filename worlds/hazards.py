"""Small worlds with one hazard each ahead of a robot at the origin, to test perception.

Besides hazards that are easily missed there are harmless counterparts, which must not be classified
as non-traversable: a drivable slope, leaves overhead and stones below the wheels' radius.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, ellipsoid, frustum, log, rock
from worlds.fields import plain_world
from worlds.world import World

Heights = NDArray[np.float64]
"""Heights or coordinates over the grid [m], shape (n, n)."""

_SIZE, _CELL = 26.0, 0.1


@dataclass(frozen=True)
class Hazard:
    """One kind of hazard.

    Attributes:
        name: Name in tables.
        harmless: True if all of it is traversable.
        ground: Function of coordinates ahead of the hazard's near edge and to its left [m] that
            returns heights to add [m]; None for level ground.
        objects: Function ``(place, rng)`` that returns objects, where ``place(ahead, left)`` is the
            map point on the ground [m]; None for no objects.
    """

    name: str
    harmless: bool
    ground: Callable[[Heights, Heights], Heights] | None = None
    objects: (
        Callable[
            [Callable[[float, float], NDArray[np.float64]], np.random.Generator], list[SceneObject]
        ]
        | None
    ) = None


def make_hazard(
    hazard: Hazard, distance: float, bearing: float, slope: float, rng: np.random.Generator
) -> World:
    """Return a world with one hazard.

    Args:
        hazard: Kind of hazard.
        distance: Distance of its near edge from the origin [m].
        bearing: Direction of the hazard from the origin [rad], 0 = east, counter-clockwise.
        slope: Slope of the whole ground [rad]; its direction is random.
        rng: Source of randomness for the slope's direction, sizes and roughness.
    """
    n = round(_SIZE / _CELL) + 1
    lines = (np.arange(n) - (n - 1) / 2) * _CELL
    x, y = np.meshgrid(lines, lines, indexing="ij")
    ahead = x * np.cos(bearing) + y * np.sin(bearing) - distance
    aside = y * np.cos(bearing) - x * np.sin(bearing)
    downhill = rng.uniform(-np.pi, np.pi)
    heights = np.tan(slope) * (x * np.cos(downhill) + y * np.sin(downhill))
    heights += 0.006 * np.sin(2.1 * x + rng.uniform(0, 6)) * np.sin(1.7 * y + rng.uniform(0, 6))
    if hazard.ground is not None:
        heights += hazard.ground(ahead, aside)
    ground = Heightfield(heights.astype(np.float32), _CELL)

    def place(forward: float, left: float) -> NDArray[np.float64]:
        """Return the map point on the ground at hazard coordinates [m], shape (3,)."""
        u = distance + forward
        px = u * np.cos(bearing) - left * np.sin(bearing)
        py = u * np.sin(bearing) + left * np.cos(bearing)
        return np.array([px, py, float(ground.height_at(px, py))])

    objects = tuple(hazard.objects(place, rng)) if hazard.objects is not None else ()
    return plain_world(f"hazard-{hazard.name}", ground, objects)


def _ramp(ahead: Heights, run: float) -> Heights:
    """Return 0 before the edge, rising to 1 at ``run`` [m] behind it."""
    return np.clip(ahead / run, 0.0, 1.0)


def _ditch(ahead: Heights, aside: Heights) -> Heights:
    """Return a ditch across, 0.4 m deep and 1.2 m wide."""
    return -0.4 * (_ramp(ahead, 0.25) - _ramp(ahead - 0.95, 0.25)) * (np.abs(aside) < 4)


def _down_step(ahead: Heights, aside: Heights) -> Heights:
    """Return a step down of 0.15 m."""
    return -0.15 * _ramp(ahead, _CELL)


def _drop(ahead: Heights, aside: Heights) -> Heights:
    """Return a drop of 0.5 m."""
    return -0.5 * _ramp(ahead, 0.2)


def _crest(ahead: Heights, aside: Heights) -> Heights:
    """Return a crest with a descent of 32 degrees behind it."""
    return -np.tan(np.deg2rad(32.0)) * np.clip(ahead, 0.0, 3.0)


def _bank(ahead: Heights, aside: Heights) -> Heights:
    """Return a bank that rises by 32 degrees."""
    return np.tan(np.deg2rad(32.0)) * np.clip(ahead, 0.0, 2.0)


def _drivable(ahead: Heights, aside: Heights) -> Heights:
    """Return a slope of 18 degrees that begins gradually, over 2 m."""
    climb = np.clip(ahead, 0.0, None)
    rounded = np.where(climb < 2.0, climb**2 / 4.0, climb - 1.0)
    return np.tan(np.deg2rad(18.0)) * np.minimum(rounded, 3.0)


_Place = Callable[[float, float], NDArray[np.float64]]


def _canopy(place: _Place, rng: np.random.Generator) -> list[SceneObject]:
    """Return leaves overhead, 1.5 m or more above the ground."""
    middle = place(1.2, 0.0) + np.array([0.0, 0.0, rng.uniform(2.1, 2.5)])
    return [ellipsoid(SemanticClass.FOLIAGE, middle, (1.2, 1.2, 0.6))]


def _thin_trunk(place: _Place, rng: np.random.Generator) -> list[SceneObject]:
    """Return a trunk 6 to 12 cm thick."""
    radius = rng.uniform(0.03, 0.06)
    foot = place(radius, 0.0) - [0.0, 0.0, 0.1]
    return [frustum(SemanticClass.TRUNK, foot, (radius, 0.8 * radius), 3.0, 8)]


def _fallen_trunk(place: _Place, rng: np.random.Generator) -> list[SceneObject]:
    """Return a fallen trunk across, 16 to 30 cm thick."""
    radius = rng.uniform(0.08, 0.15)
    lift = np.array([0.0, 0.0, 0.8 * radius])
    return [log(place(radius, -1.5) + lift, place(radius, 1.5) + lift, radius)]


def _high_grass(place: _Place, rng: np.random.Generator) -> list[SceneObject]:
    """Return three clumps of high grass side by side."""
    return [
        frustum(
            SemanticClass.HIGH_GRASS,
            place(0.35, left) - [0.0, 0.0, 0.05],
            (0.35, 0.25),
            rng.uniform(0.35, 0.7),
            8,
        )
        for left in (-0.7, 0.0, 0.7)
    ]


def _rock_field(place: _Place, rng: np.random.Generator) -> list[SceneObject]:
    """Return ten scattered rocks."""
    return [
        rock(place(rng.uniform(0.2, 2.0), rng.uniform(-1.5, 1.5)), rng.uniform(0.12, 0.3, 3), rng)
        for _ in range(10)
    ]


def _one_rock(height: float, semantic: SemanticClass) -> Callable[..., list[SceneObject]]:
    """Return a generator of one round rock whose top is ``height`` [m] above the ground."""

    def make(place: _Place, rng: np.random.Generator) -> list[SceneObject]:
        """Return the rock."""
        body = ellipsoid(semantic, place(0.16, 0.0), (0.16, 0.16, height))
        return [replace(body, semantic=semantic)]

    return make


_ALL = (
    Hazard("ditch", False, _ditch),
    Hazard("drop", False, _drop),
    Hazard("down_step", False, _down_step),
    Hazard("crest", False, _crest),
    Hazard("bank", False, _bank),
    Hazard("thin_trunk", False, objects=_thin_trunk),
    Hazard("fallen_trunk", False, objects=_fallen_trunk),
    Hazard("high_grass", False, objects=_high_grass),
    Hazard("rock_field", False, objects=_rock_field),
    Hazard("rock_over_clearance", False, objects=_one_rock(0.09, SemanticClass.ROCK)),
    Hazard("rock_under_clearance", True, objects=_one_rock(0.035, SemanticClass.STONE)),
    Hazard("drivable_slope", True, _drivable),
    Hazard("canopy", True, objects=_canopy),
    Hazard("bare_ground", True),
)

HAZARDS: Mapping[str, Hazard] = MappingProxyType({hazard.name: hazard for hazard in _ALL})
"""All hazards by name, the harmless ones last."""
