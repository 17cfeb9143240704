"""Walkers of a natural world: where people, animals and vehicles begin, and what stops them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from terrain.classes import TRAITS
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from worlds.rooms.mover_placement import draw_movers
from worlds.rooms.movers import Behaviour, Mover, MoverPlan
from worlds.rooms.room import Room, RoomPlan
from worlds.traversability_map import TraversabilityMap
from worlds.vehicle_tracks import draw_track
from worlds.walker_config import (
    GROUP_SIZE,
    AnimalConfig,
    PeopleConfig,
    VehicleConfig,
    WalkerConfig,
    number_at,
    pace_at,
)
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

_BESIDE = 0.4
"""Half of the distance of two people of a group who walk side by side [m] (assumption)."""

_SLOTS = ((0.0, 0.0), (0.0, -2 * _BESIDE), (-2 * _BESIDE, 0.0), (-2 * _BESIDE, -2 * _BESIDE))
"""Places of a group's people, ahead and to the left of their leader [m]."""


def draw_walkers(
    config: WalkerConfig,
    room: Room,
    tasks: Sequence[Task],
    rng: np.random.Generator,
    truth: TraversabilityMap,
    difficulty: float = 0.5,
) -> tuple[Mover, ...]:
    """Return the walkers of a world, at free places away from the starts of its tasks.

    One that finds no place stays away.

    Args:
        config: Number, size and speed.
        room: Solids that they go round or turn back at; see ``solids_room``.
        tasks: Tasks of the world.
        rng: Source of randomness.
        truth: True map, along which vehicles drive.
        difficulty: Difficulty from 0 to 1: numbers and speeds rise with it.
    """
    # Before the others, with draws of their own: those that go straight are what they ever were.
    agent_rng = rng.spawn(1)[0]
    plans = tuple(_plan(config, rng) for _ in range(config.count))
    movers = list(draw_movers(_crowded(room, tasks, plans), rng))
    for mover in _vehicles(config.vehicles, room, tasks, agent_rng, truth, difficulty):
        if _is_free(mover, movers):
            movers.append(mover)
    for members in _envelopes(config, difficulty, agent_rng):
        taken = [(*each.place, each.plan.radius) for each in movers]
        room_now = _crowded(room, tasks, (_envelope(members),), taken)
        for envelope in draw_movers(room_now, agent_rng):
            movers += _unpacked(envelope, members, len(movers))
    return tuple(movers)


def _crowded(
    room: Room,
    tasks: Sequence[Task],
    plans: tuple[MoverPlan, ...],
    taken: Sequence[tuple[float, float, float]] = (),
) -> Room:
    """Return a room with movers that are to be placed, and circles around starts and others."""
    starts = [(task.start.x, task.start.y, _START_GAP) for task in tasks]
    circles = np.reshape([*starts, *taken], (-1, 3))
    return replace(room, circles=np.concatenate([room.circles, circles]), movers=plans)


def _plan(config: WalkerConfig, rng: np.random.Generator) -> MoverPlan:
    """Return one walker as data, its place and heading still open."""
    return _passing(_body(config, 1.0, rng), config.passing, rng)


def _body(
    config: WalkerConfig | PeopleConfig | AnimalConfig | VehicleConfig,
    pace: float,
    rng: np.random.Generator,
) -> MoverPlan:
    """Return a mover of random size and speed, which is there always.

    Args:
        config: Bounds.
        pace: Factor of the speed.
        rng: Source of randomness.
    """
    radius, height, speed = (
        float(rng.uniform(*bounds)) for bounds in (config.radius, config.height, config.speed)
    )
    return MoverPlan(radius=radius, height=height, speed=speed * pace)


def _passing(plan: MoverPlan, share: float, rng: np.random.Generator) -> MoverPlan:
    """Return a mover that by chance appears at a time of its own and vanishes again."""
    passes, begin, stay = rng.random() < share, rng.random(), rng.random()
    duration = _SHORTEST + stay * (_LONGEST - _SHORTEST)
    times = {"appears_at": begin * _LATEST, "duration": duration}
    return plan.model_copy(update=times) if passes else plan


Members = tuple[tuple[MoverPlan, Behaviour], ...]
"""People of a group, the leader first, or one person or animal."""


def _envelopes(
    config: WalkerConfig, difficulty: float, rng: np.random.Generator
) -> Iterator[Members]:
    """Return the groups, people alone and animals, the largest first."""
    people, pace = config.people, pace_at(difficulty)
    for _ in range(number_at(people.groups, difficulty)):
        yields, size = rng.random() < people.yielding, int(rng.integers(*GROUP_SIZE, endpoint=True))
        speed = _body(people, pace, rng).speed  # They keep together: one speed for all.
        yield tuple(
            (
                _body(people, pace, rng).model_copy(update={"speed": speed}),
                Behaviour(kind="person", seed=_seed(rng), yields=yields, slot=_SLOTS[k]),
            )
            for k in range(size)
        )
    for _ in range(number_at(people.alone, difficulty)):
        yields = rng.random() < people.yielding
        plan = _passing(_body(people, pace, rng), config.passing, rng)
        yield ((plan, Behaviour(kind="person", seed=_seed(rng), yields=yields)),)
    for _ in range(number_at(config.animals.count, difficulty)):
        plan = _body(config.animals, pace, rng)
        yield ((plan, Behaviour(kind="animal", seed=_seed(rng))),)


def _seed(rng: np.random.Generator) -> int:
    """Return a seed of a mover's own decisions."""
    return int(rng.integers(2**31))


def _envelope(members: Members) -> MoverPlan:
    """Return a mover as large as the place that some need together."""
    middle = np.mean([behaviour.slot for _, behaviour in members], axis=0)
    reach = max(math.dist(middle, behaviour.slot) + plan.radius for plan, behaviour in members)
    return MoverPlan(radius=reach, speed=members[0][0].speed)


def _unpacked(envelope: Mover, members: Members, first: int) -> list[Mover]:
    """Return the movers of an envelope that has found its place.

    Args:
        envelope: Mover as large as all of them.
        members: Movers, the leader first.
        first: Index that the leader has in the world.
    """
    heading = math.atan2(envelope.velocity[1], envelope.velocity[0])
    c, s = math.cos(heading), math.sin(heading)
    slots = np.array([behaviour.slot for _, behaviour in members])
    turned = (slots - slots.mean(axis=0)) @ np.array([[c, s], [-s, c]])
    places = turned + envelope.place
    movers = []
    for k, ((plan, behaviour), (x, y)) in enumerate(zip(members, places.tolist(), strict=True)):
        led = behaviour if k == 0 else behaviour.model_copy(update={"leader": first})
        movers.append(Mover((x, y), envelope.velocity, plan, led))
    return movers


def _vehicles(
    config: VehicleConfig,
    room: Room,
    tasks: Sequence[Task],
    rng: np.random.Generator,
    truth: TraversabilityMap,
    difficulty: float,
) -> Iterator[Mover]:
    """Return the vehicles that find a track, each at the begin of it."""
    for _ in range(number_at(config.count, difficulty)):
        plan = _body(config, pace_at(difficulty), rng)
        track = draw_track(plan.radius, config.track, room, truth, tasks, rng)
        if track:
            behaviour = Behaviour(kind="vehicle", seed=_seed(rng), track=track)
            (x, y), (to_x, to_y) = track[:2]
            share = plan.speed / math.dist(track[0], track[1])
            yield Mover(track[0], (share * (to_x - x), share * (to_y - y)), plan, behaviour)


def _is_free(mover: Mover, others: Sequence[Mover]) -> bool:
    """Return True if a mover overlaps no other."""
    return all(
        math.dist(mover.place, other.place) > mover.plan.radius + other.plan.radius
        for other in others
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
