"""Motion of people, animals and vehicles: decisions once in a control period, steps each tick.

A person heads for a place, steps aside from whom it would meet, goes round solids, and heads for
another place when it arrives. Its velocity follows within a relaxation time (Helbing and Molnar
1995, equation 2). To step aside it adds a velocity away from the point of closest approach, which
grows as the gap there and the time to it shrink: anticipation as in Karamouzas et al. 2009, in one
term of ours (assumption). One that gives way does so for the robot too, whose true pose it sees;
one that does not walks on into it. Those of a group keep their place beside their leader, and it
waits for them. An animal runs straight, pauses and turns at random, and a vehicle drives along its
track; neither minds the robot. All numbers are assumptions.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel
from worlds.agent_surroundings import Nearby, free_for, gather, going_round
from worlds.agents import ANIMAL, COURSE, HURRY, PERSON, STRAIGHT, VEHICLE, Agents
from worlds.rooms.mover_motion import Movers, Solids, advance_one

_RELAXATION = 0.5
"""Time in which a person takes on another velocity [s] (Helbing and Molnar 1995)."""

_FORESIGHT = 3.0
"""Time to the closest approach up to which a person steps aside [s]."""

_COMFORT = 0.5
"""Gap that a person keeps from what it steps aside from [m]."""

_ELBOW_ROOM = 0.2
"""Gap that the people of a group keep from each other [m]."""

_ARRIVED = 1.5
"""Distance at which a place counts as reached [m]."""

_PATIENCE, _PROGRESS = 5.0, 0.3
"""Time after which a place is given up to which one came no nearer than this [s], [m]."""

_DETOUR, _DETOUR_SIZE = 3.0, 6.0
"""Duration of a detour of one who is cut off from its group [s], and its largest reach [m]."""

_SCATTERED = 2.5
"""Distance from the leader at which it waits for one of its group [m]."""

_CATCH_UP = 0.8
"""Time in which one of a group wants to be in its place [s]."""

_PAUSE_SHARE = 0.35
"""Share of an animal's decisions that are pauses."""

_PAUSE, _RUN = (0.5, 3.0), (1.0, 4.0)
"""Shortest and longest pause and run of an animal [s]."""

_SUDDEN = np.deg2rad(120.0)
"""Largest turn of an animal [rad]."""


class RobotMotion(NamedTuple):
    """True motion of the robot in the plane.

    Attributes:
        x: Place [m].
        y: Place [m].
        vx: Velocity [m/s].
        vy: Velocity [m/s].
        radius: Radius of its circle [m].
    """

    x: float
    y: float
    vx: float
    vy: float
    radius: float


@kernel
def decide(
    state: Movers,
    agents: Agents,
    solids: Solids,
    half: tuple[float, float],
    robot: RobotMotion,
    now: float,
    period: float,
) -> Nearby:
    """Set the velocity that each agent wants for a control period, and return what is near it.

    Args:
        state: Movers at the begin of the period.
        agents: Agents, changed in place.
        solids: Solids that may be met.
        half: Half of the extent in which people choose places [m].
        robot: Robot at the begin of the period.
        now: Time of the begin [s].
        period: Length of the period [s].
    """
    nearby = gather(state, agents, solids)
    count = state.radii.shape[1]
    new = np.zeros((count, 2))
    for m in range(count):
        kind = agents.kinds[m]
        if kind in (STRAIGHT, COURSE) or state.radii[0, m] <= 0.0:
            continue
        if kind == VEHICLE:
            vx, vy = _along_track(m, state, agents, period)
        elif kind == ANIMAL:
            vx, vy = _running(m, agents, now)
        else:
            vx, vy = _walking(m, state, agents, half, now)
            vx, vy = _stepping_aside(m, vx, vy, state, agents, robot)
        if kind != VEHICLE:
            vx, vy = going_round(m, vx, vy, state, agents, solids, nearby)
        if kind == PERSON:
            share = min(period / _RELAXATION, 1.0)
            vx = state.velocities[0, m, 0] + share * (vx - state.velocities[0, m, 0])
            vy = state.velocities[0, m, 1] + share * (vy - state.velocities[0, m, 1])
        new[m, 0], new[m, 1] = vx, vy
    for m in range(count):
        agents.wanted[m, 0], agents.wanted[m, 1] = new[m, 0], new[m, 1]
    return nearby


@kernel
def stride(state: Movers, agents: Agents, solids: Solids, nearby: Nearby, dt: float) -> None:
    """Move movers for a tick: agents as they want, the others straight and back.

    Those on a course stay: see ``worlds.rooms.courses``.

    An agent slides along what it would overlap, or stays: none overlaps a solid or another. A
    vehicle stays on its track and waits.

    Args:
        state: Movers, changed in place.
        agents: Agents.
        solids: Solids that may be met.
        nearby: Solids near each agent.
        dt: Length of the tick [s].
    """
    boxes, circles, edges = solids
    for m in range(state.radii.shape[1]):
        if agents.kinds[m] == STRAIGHT:
            advance_one(0, m, state, boxes, circles, edges, dt)
            continue
        if agents.kinds[m] == COURSE or state.radii[0, m] <= 0.0:
            continue
        vx, vy = agents.wanted[m, 0], agents.wanted[m, 1]
        place = state.places[0, m]
        free, nx, ny = free_for(m, place[0] + vx * dt, place[1] + vy * dt, state, solids, nearby)
        if not free and agents.kinds[m] != VEHICLE:
            # What is left of the velocity along the surface.
            length = np.hypot(nx, ny)
            against = (vx * nx + vy * ny) / length if length > 0.0 else 0.0
            if against < 0.0:
                vx, vy = vx - against * nx / length, vy - against * ny / length
                x, y = place[0] + vx * dt, place[1] + vy * dt
                free, nx, ny = free_for(m, x, y, state, solids, nearby)
        if not free:
            vx, vy = 0.0, 0.0
        place[0], place[1] = place[0] + vx * dt, place[1] + vy * dt
        state.velocities[0, m, 0], state.velocities[0, m, 1] = vx, vy


@inlined_kernel
def _draw(m: int, agents: Agents) -> float:
    """Return the next random number of a mover."""
    value = agents.draws[m, agents.drawn[m] % agents.draws.shape[1]]
    agents.drawn[m] += 1
    return value


@kernel
def _along_track(m: int, state: Movers, agents: Agents, period: float) -> tuple[float, float]:
    """Return the velocity of a vehicle to its next corner; at the ends of a track it reverses."""
    x, y = state.places[0, m, 0], state.places[0, m, 1]
    corner = agents.tracks[m, agents.legs[m, 0]]
    if np.hypot(corner[0] - x, corner[1] - y) < 1e-6:
        if not 0 <= agents.legs[m, 0] + agents.legs[m, 1] < agents.corners[m]:
            agents.legs[m, 1] = -agents.legs[m, 1]
        agents.legs[m, 0] += agents.legs[m, 1]
        corner = agents.tracks[m, agents.legs[m, 0]]
    # It ends the period at the corner, and cuts none.
    away = np.hypot(corner[0] - x, corner[1] - y)
    return _towards(corner, x, y, min(agents.speeds[m], away / period))


@kernel
def _running(m: int, agents: Agents, now: float) -> tuple[float, float]:
    """Return the velocity of an animal; at the end of a run or a pause it decides anew."""
    if now >= agents.until[m]:
        if _draw(m, agents) < _PAUSE_SHARE and agents.paces[m] > 0.0:
            agents.paces[m] = 0.0
            agents.until[m] = now + _PAUSE[0] + _draw(m, agents) * (_PAUSE[1] - _PAUSE[0])
        else:
            agents.paces[m] = agents.speeds[m]
            agents.headings[m] += _SUDDEN * (2.0 * _draw(m, agents) - 1.0)
            agents.until[m] = now + _RUN[0] + _draw(m, agents) * (_RUN[1] - _RUN[0])
    pace, heading = agents.paces[m], agents.headings[m]
    return pace * np.cos(heading), pace * np.sin(heading)


@kernel
def _walking(
    m: int, state: Movers, agents: Agents, half: tuple[float, float], now: float
) -> tuple[float, float]:
    """Return the velocity of a person towards its aim, or to its place in a group."""
    x, y = state.places[0, m, 0], state.places[0, m, 1]
    if agents.leaders[m] != m:
        return _following(m, state, agents, now)
    away = np.hypot(agents.aims[m, 0] - x, agents.aims[m, 1] - y)
    if away < _ARRIVED or _gives_up(m, away, agents, now):
        agents.aims[m, 0] = half[0] * (2.0 * _draw(m, agents) - 1.0)
        agents.aims[m, 1] = half[1] * (2.0 * _draw(m, agents) - 1.0)
        agents.nearest[m], agents.until[m] = np.inf, now + _PATIENCE
    farthest, last = _SCATTERED, -1
    for o in range(state.radii.shape[1]):
        if o != m and agents.leaders[o] == m and state.radii[0, o] > 0.0:
            gap = np.hypot(state.places[0, o, 0] - x, state.places[0, o, 1] - y)
            if gap > farthest:
                farthest, last = gap, o
    if last >= 0:
        # Back to who was left behind, slowly.
        return _towards(state.places[0, last], x, y, 0.5 * agents.speeds[m])
    return _towards(agents.aims[m], x, y, agents.speeds[m])


@inlined_kernel
def _gives_up(m: int, away: float, agents: Agents, now: float) -> bool:
    """Return True if a person has come no nearer to its aim for too long [m], and note if it has.

    Args:
        m: Index of the person.
        away: Its distance from the aim [m].
        agents: Agents, changed in place.
        now: Time [s].
    """
    if away < agents.nearest[m] - _PROGRESS:
        agents.nearest[m] = away
        agents.until[m] = now + _PATIENCE
    return now >= agents.until[m]


@inlined_kernel
def _towards(place: NDArray[np.float64], x: float, y: float, speed: float) -> tuple[float, float]:
    """Return the velocity from x, y towards a place [m] at a speed [m/s]."""
    share = speed / max(np.hypot(place[0] - x, place[1] - y), 1e-6)
    return share * (place[0] - x), share * (place[1] - y)


@kernel
def _following(m: int, state: Movers, agents: Agents, now: float) -> tuple[float, float]:
    """Return the velocity of one of a group, to its place beside the leader."""
    leader = agents.leaders[m]
    x, y = state.places[0, m, 0], state.places[0, m, 1]
    lx, ly = state.places[0, leader, 0], state.places[0, leader, 1]
    heading = np.arctan2(agents.aims[leader, 1] - ly, agents.aims[leader, 0] - lx)
    c, s = np.cos(heading), np.sin(heading)
    ahead, left = agents.slots[m, 0], agents.slots[m, 1]
    dx, dy = lx + c * ahead - s * left - x, ly + s * ahead + c * left - y
    gap = np.hypot(dx, dy)
    if now < agents.detours[m]:
        return _towards(agents.aims[m], x, y, agents.speeds[m])
    if gap < _ARRIVED:
        agents.nearest[m], agents.until[m] = gap, now + _PATIENCE
    elif _gives_up(m, gap, agents, now):
        agents.aims[m, 0] = x + _DETOUR_SIZE * (2.0 * _draw(m, agents) - 1.0)
        agents.aims[m, 1] = y + _DETOUR_SIZE * (2.0 * _draw(m, agents) - 1.0)
        agents.detours[m] = now + _DETOUR
        agents.nearest[m], agents.until[m] = np.inf, now + _DETOUR + _PATIENCE
    vx, vy = state.velocities[0, leader, 0], state.velocities[0, leader, 1]
    vx, vy = vx + dx / _CATCH_UP, vy + dy / _CATCH_UP
    return _capped(vx, vy, HURRY * agents.speeds[m])


@inlined_kernel
def _capped(vx: float, vy: float, most: float) -> tuple[float, float]:
    """Return a velocity, shortened to a largest speed [m/s]."""
    speed = np.hypot(vx, vy)
    share = most / speed if speed > most else 1.0
    return share * vx, share * vy


@kernel
def _stepping_aside(
    m: int, vx: float, vy: float, state: Movers, agents: Agents, robot: RobotMotion
) -> tuple[float, float]:
    """Return a person's velocity with what it adds to avoid others and, if it yields, the robot."""
    x, y, radius = state.places[0, m, 0], state.places[0, m, 1], state.radii[0, m]
    ax, ay = 0.0, 0.0
    for o in range(state.radii.shape[1]):
        if o == m or state.radii[0, o] <= 0.0:
            continue
        dx, dy = state.places[0, o, 0] - x, state.places[0, o, 1] - y
        rx, ry = state.velocities[0, o, 0] - vx, state.velocities[0, o, 1] - vy
        if agents.leaders[o] == agents.leaders[m]:
            # Those of a group keep together, and only out of each other's way.
            px, py = _push(dx, dy, 0.0, 0.0, radius + state.radii[0, o] + _ELBOW_ROOM)
        else:
            px, py = _push(dx, dy, rx, ry, radius + state.radii[0, o] + _COMFORT)
        ax, ay = ax + px, ay + py
    if agents.yields[m]:
        reach = radius + robot.radius + _COMFORT
        px, py = _push(robot.x - x, robot.y - y, robot.vx - vx, robot.vy - vy, reach)
        ax, ay = ax + px, ay + py
    # Twice its usual speed is what it takes to turn back from its way altogether.
    speed = agents.speeds[m]
    return _capped(vx + 2.0 * speed * ax, vy + 2.0 * speed * ay, HURRY * speed)


@inlined_kernel
def _push(dx: float, dy: float, rx: float, ry: float, reach: float) -> tuple[float, float]:
    """Return how strongly to step aside, 0 to 1, as a vector away from the closest approach.

    Args:
        dx: Place of the other from here [m].
        dy: Place of the other from here [m].
        rx: Velocity of the other against one's own [m/s].
        ry: Velocity of the other against one's own [m/s].
        reach: Gap of the centres below which one steps aside [m].
    """
    px, py = 0.0, 0.0
    square = rx * rx + ry * ry
    time = -(dx * rx + dy * ry) / square if square > 1e-9 else 0.0
    time = max(time, 0.0)
    if time < _FORESIGHT:
        mx, my = dx + rx * time, dy + ry * time
        gap = np.hypot(mx, my)
        if gap < reach:
            share = (1.0 - gap / reach) * (1.0 - time / _FORESIGHT)
            if gap > 1e-3:
                px, py = -share * mx / gap, -share * my / gap
            elif square > 1e-9:
                # Head on: each keeps to its right.
                px, py = -share * ry / np.sqrt(square), share * rx / np.sqrt(square)
    return px, py
