"""Rooms with people who head for places, step aside for each other, and half of them for the robot.

A room is a square of 12 m with a few pillars; the robot crosses it from one side to the other. As
in the crowds that learned navigation is judged in (Chen et al. 2019, "Crowd-Robot Interaction"),
people are as large and as fast as people and each heads for a goal; here it heads for another one
when it arrives, so that the crowd is there until the end. They go by the law of people of natural
worlds, ``worlds.agent_motion``. Numbers that are not named in it are assumptions.
"""

import math

import numpy as np

from worlds.rooms.barn import BarnWorld
from worlds.rooms.movers import MoverPlan
from worlds.rooms.room import Room, RoomPlan
from worlds.splits import refuse_judging

SIZES = (5, 10, 20)
"""Numbers of people that have a name."""

HALF = 6.0
"""Half of the edge of the square [m]."""

_START, _GOAL = (-5.0, 0.0, 0.0), (5.0, 0.0)
"""Start: x, y [m], yaw [rad], and goal [m]."""

_PILLARS = (0, 4)
"""Fewest and most pillars."""

_PILLAR_RADIUS = (0.15, 0.4)
"""Smallest and largest radius of a pillar [m]."""

_PILLARS_WITHIN = (3.0, 4.5)
"""Largest distance of a pillar from the middle in x and in y [m]: start and goal stay free."""

_RADIUS, _SPEED = (0.2, 0.3), (0.5, 1.3)
"""Smallest and largest radius [m] and usual speed [m/s] of people, those of natural worlds."""

_WAY = 1.6
"""Smallest gap between two pillars [m]: a robot and a person pass each other."""

_DRAWS = 100
"""Number of places that are drawn for a pillar."""


def crowd_room(seed: int, people: int, yielding: float = 0.5) -> Room:
    """Return a room with a crowd, the same for the same seed; people begin anywhere.

    Args:
        seed: Seed.
        people: Number of people.
        yielding: Share of them who give way to the robot, rounded to people.

    Raises:
        JudgingSeedError: If the seed judges a release.
    """
    refuse_judging(seed)
    rng = np.random.default_rng([seed, people])
    plan = RoomPlan(
        about=f"{people} people",
        half=(HALF, HALF),
        circles=_pillars(rng),
        start=_START,
        goals=(_GOAL,),
        movers=tuple(_person(rng, k < round(yielding * people)) for k in range(people)),
    )
    return Room.of(f"crowd-{people}-{seed}", plan)


def crowd_world(seed: int, people: int) -> BarnWorld:
    """Return the room of ``crowd_room`` with the straight line for its path."""
    return BarnWorld(crowd_room(seed, people), np.zeros((0, 2)))


def _pillars(rng: np.random.Generator) -> tuple[tuple[float, float, float], ...]:
    """Return x, y and radius of the pillars [m]."""
    pillars: list[tuple[float, float, float]] = []
    for _ in range(int(rng.integers(_PILLARS[0], _PILLARS[1] + 1))):
        radius = float(rng.uniform(*_PILLAR_RADIUS))
        for x, y in (rng.uniform(-1.0, 1.0, (_DRAWS, 2)) * _PILLARS_WITHIN).tolist():
            gaps = [math.hypot(x - ox, y - oy) - radius - other for ox, oy, other in pillars]
            if all(gap >= _WAY for gap in gaps):
                pillars.append((x, y, radius))
                break
    return tuple(pillars)


def _person(rng: np.random.Generator, yields: bool) -> MoverPlan:
    """Return a person of a drawn size and speed."""
    radius, speed = float(rng.uniform(*_RADIUS)), float(rng.uniform(*_SPEED))
    return MoverPlan(radius=radius, speed=speed, is_person=True, yields=yields)
