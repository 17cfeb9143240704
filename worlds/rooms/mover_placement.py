"""Moving obstacles of an episode: where those of a room begin, and which way they go."""

import math
from collections.abc import Sequence

import numpy as np

from worlds.rooms.movers import Behaviour, Mover, MoverPlan
from worlds.rooms.room import Room, RoomTask

START_GAP = 1.0
"""Smallest gap between the robot's start and a mover at a drawn place [m] (assumption)."""

STANDING_GAP = 0.8
"""Smallest gap between a mover that stands at a drawn place and all else [m] (assumption): ways
around it stay open, so that it closes none."""

_DRAWS, _TRIES = 32, 16
"""Number of places that are drawn at once for a mover, and how often."""


def draw_movers(
    room: Room, rng: np.random.Generator, task: RoomTask | None = None, radius: float = 0.0
) -> tuple[Mover, ...]:
    """Return the moving obstacles of an episode, those with a place of their own first.

    Drawn places are free of all obstacles and other movers, and ``START_GAP`` away from the robot's
    start; one that stands keeps ``STANDING_GAP`` from the goal and from all else. One that finds no
    place in 512 draws stays away for the episode.

    Args:
        room: Room.
        rng: Source of randomness.
        task: Start and goal of the robot; None keeps neither free.
        radius: Radius of the robot [m].
    """
    movers = [_mover(plan, plan.place, rng) for plan in room.movers if plan.place is not None]
    for plan in room.movers:
        place = None if plan.place else _drawn_place(plan, room, rng, task, radius, movers)
        if place is not None:
            movers.append(_mover(plan, place, rng))
    return tuple(movers)


def _mover(plan: MoverPlan, place: tuple[float, float], rng: np.random.Generator) -> Mover:
    """Return a mover at a place [m]."""
    velocity = _velocity(plan, rng)
    if not plan.is_person:
        return Mover(place, velocity, plan)
    seed = int(rng.integers(2**63))
    return Mover(place, velocity, plan, Behaviour(kind="person", seed=seed, yields=plan.yields))


def _drawn_place(
    plan: MoverPlan,
    room: Room,
    rng: np.random.Generator,
    task: RoomTask | None,
    radius: float,
    others: Sequence[Mover],
) -> tuple[float, float] | None:
    """Return a free place of a mover [m], None if none was found."""
    gap = 0.0 if plan.speed else STANDING_GAP
    kept_free: list[tuple[tuple[float, float], float]] = []
    if task is not None:
        kept_free.append(((task.start.x, task.start.y), radius + START_GAP))
        if not plan.speed:
            kept_free.append((task.goal, radius + gap))
    for other in others:
        own_gap = 0.0 if other.plan.speed else STANDING_GAP
        kept_free.append((other.place, other.plan.radius + max(gap, own_gap)))
    centres = np.array([centre for centre, _ in kept_free]).reshape(-1, 2)
    reaches = np.array([reach for _, reach in kept_free]) + plan.radius
    for _ in range(_TRIES):
        places = rng.uniform(-1.0, 1.0, (_DRAWS, 2)) * room.half
        away = np.hypot(*(places[:, None] - centres).transpose(2, 0, 1))
        is_free = (away > reaches).all(axis=1) & (room.clearance(places) > plan.radius + gap)
        if is_free.any():
            x, y = places[is_free.argmax()].tolist()
            return x, y
    return None


def _velocity(plan: MoverPlan, rng: np.random.Generator) -> tuple[float, float]:
    """Return the velocity with which a mover begins [m/s]."""
    if not plan.speed:
        return 0.0, 0.0
    heading = plan.heading_deg
    bearing = rng.uniform(-math.pi, math.pi) if heading is None else math.radians(heading)
    return plan.speed * math.cos(bearing), plan.speed * math.sin(bearing)
