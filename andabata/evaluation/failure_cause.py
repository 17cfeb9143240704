"""What a drive came to grief on, told from the true world."""

import numpy as np
from numpy.typing import NDArray

from andabata.tasks.episode_monitor import Outcome
from terrain.classes import TRAITS
from worlds.truth import Reason
from worlds.world import World

_REACH = 0.9
"""Farther than this from the body's middle nothing can have been met [m]."""

_SMALL = 0.15
"""Rocks lower than this are a hazard of their own [m]: few beams meet them."""


def failure_cause(world: World, place: NDArray[np.float64], outcome: Outcome) -> str:
    """Return what ended a drive: an object's class, a kind of ground, or ``no way``.

    Args:
        world: Where it ended.
        place: Of the robot then, map [m], shape (2,) or more.
        outcome: How it ended.
    """
    if outcome is Outcome.GOAL:
        return ""
    x, y = float(place[0]), float(place[1])
    if min(world.ground.width / 2 - abs(x), world.ground.depth / 2 - abs(y)) < _REACH:
        return "border"
    if outcome is Outcome.COLLISION:
        return _nearest_solid(world, x, y)
    if outcome is Outcome.TIMEOUT:
        return "no way"
    steps = np.arange(-_REACH, _REACH + 0.05, world.truth.cell)
    reasons = world.truth.reason_at(x + steps[:, None], y + steps[None, :])
    for reason in (Reason.SOLID, Reason.LOW, Reason.SLOPE, Reason.STEP, Reason.VEGETATION):
        if (reasons == reason).any():
            return reason.name.lower()
    return "free ground"


def _nearest_solid(world: World, x: float, y: float) -> str:
    """Return the class of the solid thing nearest a place."""
    best, name = _REACH, "ground"
    for thing in world.objects:
        if not TRAITS[thing.semantic].solid or TRAITS[thing.semantic].traversable:
            continue
        low, high = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
        aside = np.maximum(np.maximum(low[:2] - [x, y], [x, y] - high[:2]), 0.0)
        gap = float(np.hypot(*aside))
        if gap < best:
            best, name = gap, thing.semantic.name.lower().replace("_", " ")
            middle = (low + high) / 2
            rises = float(high[2] - world.ground.height_at(middle[0], middle[1]))
            if rises < _SMALL:
                name = f"low {name}"
    return name
