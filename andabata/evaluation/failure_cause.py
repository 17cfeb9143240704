"""Cause of a failed drive, from the true world."""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.episode_monitor import Outcome
from terrain.classes import TRAITS
from worlds.traversability_map import Reason
from worlds.world import World

_REACH = 0.9
"""Largest distance from the body's middle at which a collision can be [m]."""

_SMALL = 0.15
"""Height below which a rock is a cause of its own [m]: few beams meet it."""


_WALKERS = {
    Contact.MOVER: "walker",
    Contact.HIT: "hit by walker",
    Contact.HIT_AT_REST: "hit by walker while standing",
}
"""Cause of a collision with a walker: the robot's motion, or the walker's."""


def touched_kind(
    world: World, place: NDArray[np.float64], walkers: NDArray[np.float64] | None, contact: Contact
) -> str:
    """Return the kind of the walker that a robot touches at the end of a drive.

    It is ``person``, ``animal``, ``vehicle``, or ``walker`` for one that goes straight; empty where
    no walker is touched.

    Args:
        world: World.
        place: Position of the robot, map [m], shape (2,) or more.
        walkers: Walkers then: x, y, z, radius, height [m], shape (m, 5); None without any.
        contact: Contact of the body.
    """
    if contact not in _WALKERS or walkers is None or not len(walkers):
        return ""
    gaps = np.hypot(*(walkers[:, :2] - place[:2]).T) - walkers[:, 3]
    return world.movers[int(np.argmin(np.where(walkers[:, 3] > 0.0, gaps, np.inf)))].kind


def failure_cause(
    world: World, place: NDArray[np.float64], outcome: Outcome, contact: Contact = Contact.NONE
) -> str:
    """Return the cause of a drive's end: an object's class, a kind of ground, or ``no way``.

    It is ``border`` at the world's edge, and ``own estimate`` where the robot declared a goal
    reached that was too far away.

    Args:
        world: World.
        place: Position of the robot at the end, map [m], shape (2,) or more.
        outcome: Outcome of the drive.
        contact: Contact of the body at the end.
    """
    if outcome is Outcome.GOAL:
        return ""
    if outcome is Outcome.FALSE_ARRIVAL:
        return "own estimate"
    if outcome is Outcome.COLLISION and contact in _WALKERS:
        return _WALKERS[contact]
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
    """Return the class of the solid object nearest a place."""
    best, name = _REACH, "ground"
    for each in world.objects:
        if not TRAITS[each.semantic].solid or TRAITS[each.semantic].traversable:
            continue
        low, high = each.vertices.min(axis=0), each.vertices.max(axis=0)
        aside = np.maximum(np.maximum(low[:2] - [x, y], [x, y] - high[:2]), 0.0)
        gap = float(np.hypot(*aside))
        if gap < best:
            best, name = gap, each.semantic.name.lower().replace("_", " ")
            middle = (low + high) / 2
            rises = float(high[2] - world.ground.height_at(middle[0], middle[1]))
            if rises < _SMALL:
                name = f"low {name}"
    return name
