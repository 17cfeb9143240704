"""Walkers of a natural world: how many, how large and how fast, and what they turn back at."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.spatial import ConvexHull

from terrain.classes import TRAITS
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from worlds.rooms.mover_placement import draw_movers
from worlds.rooms.movers import Mover, MoverPlan
from worlds.rooms.room import Room, RoomPlan
from worlds.world import Task

_MARGIN = 1.0
"""Distance from the border at which walkers turn back [m] (assumption)."""

_START_GAP = 6.0
"""Smallest distance of a walker's place from a start [m] (assumption): the robot stands for the
first turn of its laser, and sees nothing before."""

_ROUND = 0.6
"""Share of its circle that a footprint fills to count as round."""

_LATEST, _SHORTEST, _LONGEST = 150.0, 60.0, 240.0
"""Latest appearance and shortest and longest stay of walkers that come and go [s] (assumption)."""


class WalkerConfig(BaseModel):
    """Walkers of a world: upright cylinders that go straight and turn back at what stands.

    Attributes:
        count: Number of walkers, whatever the difficulty is.
        radius: Smallest and largest radius [m].
        height: Smallest and largest height [m].
        speed: Lowest and highest speed, constant for each walker [m/s].
        passing: Share of walkers that appear at a time of their own and vanish again.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    count: int = Field(default=0, ge=0, le=200)
    radius: tuple[float, float] = (0.2, 0.3)
    height: tuple[float, float] = (1.5, 1.9)
    speed: tuple[float, float] = (0.4, 1.2)
    passing: float = Field(default=0.25, ge=0, le=1)


def draw_walkers(
    config: WalkerConfig, room: Room, tasks: Sequence[Task], rng: np.random.Generator
) -> tuple[Mover, ...]:
    """Return the walkers of a world, at free places away from the starts of its tasks.

    Args:
        config: Number, size and speed.
        room: Solids that they turn back at; see ``solids_room``.
        tasks: Tasks of the world.
        rng: Source of randomness.
    """
    plans = tuple(_plan(config, rng) for _ in range(config.count))
    starts = [(task.start.x, task.start.y, _START_GAP) for task in tasks]
    crowded = Room(
        name=room.name,
        half=room.half,
        boxes=room.boxes,
        circles=np.concatenate([room.circles, np.reshape(starts, (-1, 3))]),
        movers=plans,
        edges=room.edges,
    )
    return draw_movers(crowded, rng)


def _plan(config: WalkerConfig, rng: np.random.Generator) -> MoverPlan:
    """Return one walker as data, its place and heading still open."""
    radius, height, speed = (
        float(rng.uniform(*bounds)) for bounds in (config.radius, config.height, config.speed)
    )
    passes, begin, stay = rng.random() < config.passing, rng.random(), rng.random()
    return MoverPlan(
        radius=radius,
        height=height,
        speed=speed,
        appears_at=begin * _LATEST if passes else 0.0,
        duration=_SHORTEST + stay * (_LONGEST - _SHORTEST) if passes else None,
    )


def solids_room(ground: Heightfield, objects: Sequence[SceneObject]) -> Room:
    """Return what walkers turn back at: solid objects as seen from above, and the border.

    Trunks and other round footprints are circles; the others are outlines. What the robot may
    drive over walkers step over, and what has no body they walk through, as wheels do.

    Args:
        ground: Ground of the world.
        objects: Objects of the world.
    """
    circles: list[tuple[float, float, float]] = []
    outlines: list[tuple[tuple[float, float], ...]] = []
    for each in objects:
        traits = TRAITS[each.semantic]
        if traits.solid and not traits.traversable:
            _add_footprint(each.vertices[:, :2].astype(np.float64), circles, outlines)
    plan = RoomPlan(
        about="what walkers turn back at",
        half=(ground.width / 2 - _MARGIN, ground.depth / 2 - _MARGIN),
        circles=tuple(circles),
        outlines=tuple(outlines),
    )
    return Room.of("solids", plan)


def _add_footprint(
    corners: NDArray[np.float64],
    circles: list[tuple[float, float, float]],
    outlines: list[tuple[tuple[float, float], ...]],
) -> None:
    """Add the footprint of corners [m], shape (k, 2), to circles or to outlines."""
    hull = ConvexHull(corners)
    outline = corners[hull.vertices]  # Counter-clockwise.
    x, y = (outline.min(axis=0) + outline.max(axis=0)) / 2
    radius = float(np.hypot(outline[:, 0] - x, outline[:, 1] - y).max())
    # In the plane the hull's volume is its area.
    if hull.volume > _ROUND * math.pi * radius**2:
        circles.append((float(x), float(y), radius))
    else:
        outlines.append(tuple((float(a), float(b)) for a, b in outline))
