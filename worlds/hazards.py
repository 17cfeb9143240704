"""Small scenes with one hazard each, in front of a robot at the origin: what perception must see.

The hazards are those that others miss, and their harmless twins: a slope that can be driven, leaves
overhead and stones under the wheel must raise no alarm.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, ellipsoid, frustum, log, rock
from worlds.truth import TruthConfig, build_truth
from worlds.world import World

Heights = NDArray[np.float64]
_SIZE, _CELL = 26.0, 0.1


@dataclass(frozen=True)
class Hazard:
    """One kind of hazard.

    Attributes:
        name: For tables.
        harmless: Whether nothing of it is non-traversable.
        ground: Heights to add [m] at places ``ahead`` of the hazard's near edge and ``aside`` [m].
        things: What stands there: ``(place, rng) -> objects``; ``place`` gives the map point on
            bare ground for (ahead, aside).
    """

    name: str
    harmless: bool
    ground: Callable[[Heights, Heights], Heights] | None = None
    things: (
        Callable[
            [Callable[[float, float], NDArray[np.float64]], np.random.Generator], list[SceneObject]
        ]
        | None
    ) = None


def make_hazard(
    hazard: Hazard, distance: float, bearing: float, slope: float, rng: np.random.Generator
) -> World:
    """Return a scene whose hazard begins ``distance`` [m] from the origin, at ``bearing`` [rad].

    Args:
        hazard: Which.
        distance: Of its near edge [m].
        bearing: Where it lies [rad].
        slope: Of the whole ground [rad]; its direction is random.
        rng: Direction of the slope, sizes and bumps.
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
        u = distance + forward
        px = u * np.cos(bearing) - left * np.sin(bearing)
        py = u * np.sin(bearing) + left * np.cos(bearing)
        return np.array([px, py, float(ground.height_at(px, py))])

    things = tuple(hazard.things(place, rng)) if hazard.things is not None else ()
    truth = build_truth(ground, things, TruthConfig())
    surface = np.zeros((n - 1, n - 1), dtype=np.uint8)
    return World(f"hazard-{hazard.name}", 0, 0.0, ground, surface, things, (), truth)


def _ramp(ahead: Heights, run: float) -> Heights:
    """Return 0 before the edge, 1 from ``run`` [m] behind it on."""
    return np.clip(ahead / run, 0.0, 1.0)


def _ditch(ahead: Heights, aside: Heights) -> Heights:
    return -0.4 * (_ramp(ahead, 0.25) - _ramp(ahead - 0.95, 0.25)) * (np.abs(aside) < 4)


def _down_step(ahead: Heights, aside: Heights) -> Heights:
    return -0.15 * _ramp(ahead, _CELL)


def _drop(ahead: Heights, aside: Heights) -> Heights:
    return -0.5 * _ramp(ahead, 0.2)


def _crest(ahead: Heights, aside: Heights) -> Heights:
    return -np.tan(np.deg2rad(32.0)) * np.clip(ahead, 0.0, 3.0)


def _bank(ahead: Heights, aside: Heights) -> Heights:
    return np.tan(np.deg2rad(32.0)) * np.clip(ahead, 0.0, 2.0)


def _drivable(ahead: Heights, aside: Heights) -> Heights:
    """Eighteen degrees, reached over two metres."""
    climb = np.clip(ahead, 0.0, None)
    rounded = np.where(climb < 2.0, climb**2 / 4.0, climb - 1.0)
    return np.tan(np.deg2rad(18.0)) * np.minimum(rounded, 3.0)


_Place = Callable[[float, float], NDArray[np.float64]]


def _canopy(place: _Place, rng: np.random.Generator) -> list[SceneObject]:
    middle = place(1.2, 0.0) + np.array([0.0, 0.0, rng.uniform(2.1, 2.5)])
    return [ellipsoid(SemanticClass.FOLIAGE, middle, (1.2, 1.2, 0.6))]


def _thin_trunk(place: _Place, rng: np.random.Generator) -> list[SceneObject]:
    radius = rng.uniform(0.03, 0.06)
    foot = place(radius, 0.0) - [0.0, 0.0, 0.1]
    return [frustum(SemanticClass.TRUNK, foot, (radius, 0.8 * radius), 3.0, 8)]


def _fallen_trunk(place: _Place, rng: np.random.Generator) -> list[SceneObject]:
    radius = rng.uniform(0.08, 0.15)
    lift = np.array([0.0, 0.0, 0.8 * radius])
    return [log(place(radius, -1.5) + lift, place(radius, 1.5) + lift, radius)]


def _high_grass(place: _Place, rng: np.random.Generator) -> list[SceneObject]:
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
    return [
        rock(place(rng.uniform(0.2, 2.0), rng.uniform(-1.5, 1.5)), rng.uniform(0.12, 0.3, 3), rng)
        for _ in range(10)
    ]


def _one_rock(height: float, semantic: SemanticClass) -> Callable[..., list[SceneObject]]:
    """Return a maker of one round rock that stands ``height`` [m] out of the ground."""

    def make(place: _Place, rng: np.random.Generator) -> list[SceneObject]:
        body = ellipsoid(semantic, place(0.16, 0.0), (0.16, 0.16, height))
        return [replace(body, semantic=semantic)]

    return make


_ALL = (
    Hazard("ditch", False, _ditch),
    Hazard("drop", False, _drop),
    Hazard("down_step", False, _down_step),
    Hazard("crest", False, _crest),
    Hazard("bank", False, _bank),
    Hazard("thin_trunk", False, things=_thin_trunk),
    Hazard("fallen_trunk", False, things=_fallen_trunk),
    Hazard("high_grass", False, things=_high_grass),
    Hazard("rock_field", False, things=_rock_field),
    Hazard("rock_over_clearance", False, things=_one_rock(0.09, SemanticClass.ROCK)),
    Hazard("rock_under_clearance", True, things=_one_rock(0.035, SemanticClass.STONE)),
    Hazard("drivable_slope", True, _drivable),
    Hazard("canopy", True, things=_canopy),
    Hazard("bare_ground", True),
)

HAZARDS: Mapping[str, Hazard] = MappingProxyType({hazard.name: hazard for hazard in _ALL})
"""All hazards by name, the harmless ones last."""
