"""Solids around people and animals of a world: what is near each, and ways that go round it."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel
from worlds.agents import HURRY, STRAIGHT, Agents
from worlds.rooms.mover_motion import Movers, Solids

_LOOK_AHEAD = 1.5
"""Time for which the way ahead is looked at for solids [s]."""

_MARGIN = 0.1
"""Gap from solids that a way keeps ahead [m]."""

_SPACING = 0.25
"""Distance of the places at which a way ahead is tried [m]."""

_TURN, _TURNS = np.deg2rad(20.0), 8
"""Turn between two ways that are tried, and how many to each side."""


class Nearby(NamedTuple):
    """Indices of the circles and edges near each mover; those of mover m begin at ``starts[m]``.

    Attributes:
        circles: Indices of circles.
        circle_starts: Begin of each mover's circles, shape (m + 1,).
        edges: Indices of edges.
        edge_starts: Begin of each mover's edges, shape (m + 1,).
    """

    circles: NDArray[np.int64]
    circle_starts: NDArray[np.int64]
    edges: NDArray[np.int64]
    edge_starts: NDArray[np.int64]


@kernel
def overlapping(
    places: NDArray[np.float64], reaches: NDArray[np.float64], circles: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Return which circles overlap one of the circles around some places, shape (c,).

    Args:
        places: Places [m], shape (m, 2).
        reaches: Radius around each [m], shape (m,).
        circles: x, y, radius [m], shape (c, 3).
    """
    is_near = np.zeros(len(circles), dtype=np.bool_)
    for c in range(len(circles)):
        for m in range(len(places)):
            dx, dy = places[m, 0] - circles[c, 0], places[m, 1] - circles[c, 1]
            reach = reaches[m] + circles[c, 2]
            if dx * dx + dy * dy < reach * reach:
                is_near[c] = True
                break
    return is_near


def sight(speeds: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far movers look ahead for solids [m], shape (m,).

    Args:
        speeds: Highest speed of each [m/s].
    """
    return speeds * _LOOK_AHEAD + _MARGIN


@kernel
def gather(state: Movers, agents: Agents, solids: Solids) -> Nearby:
    """Return which circles and edges each agent may meet while it looks ahead."""
    count = state.radii.shape[1]
    circle_starts = np.zeros(count + 1, dtype=np.int64)
    edge_starts = np.zeros(count + 1, dtype=np.int64)
    # Counted first, then written.
    circles, edges = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    for writes in (False, True):
        c_at = e_at = 0
        for m in range(count):
            if agents.kinds[m] != STRAIGHT and state.radii[0, m] > 0.0:
                x, y = state.places[0, m, 0], state.places[0, m, 1]
                reach = state.radii[0, m] + _MARGIN + HURRY * agents.speeds[m] * _LOOK_AHEAD
                for c in range(len(solids.circles)):
                    dx, dy = x - solids.circles[c, 0], y - solids.circles[c, 1]
                    far = reach + solids.circles[c, 2]
                    if dx * dx + dy * dy < far * far:
                        if writes:
                            circles[c_at] = c
                        c_at += 1
                for e in range(len(solids.edges)):
                    nx, ny = _from_edge(x, y, solids.edges[e])
                    if nx * nx + ny * ny < reach * reach:
                        if writes:
                            edges[e_at] = e
                        e_at += 1
            circle_starts[m + 1], edge_starts[m + 1] = c_at, e_at
        if not writes:
            circles = np.empty(c_at, dtype=np.int64)
            edges = np.empty(e_at, dtype=np.int64)
    return Nearby(circles, circle_starts, edges, edge_starts)


@inlined_kernel
def _from_edge(x: float, y: float, edge: NDArray[np.float64]) -> tuple[float, float]:
    """Return the vector from an edge's nearest point to a place [m]."""
    dx, dy = edge[2] - edge[0], edge[3] - edge[1]
    share = ((x - edge[0]) * dx + (y - edge[1]) * dy) / (dx * dx + dy * dy)
    share = min(max(share, 0.0), 1.0)
    return x - edge[0] - share * dx, y - edge[1] - share * dy


@kernel
def _clear_of_solids(
    m: int, x: float, y: float, radius: float, solids: Solids, nearby: Nearby
) -> tuple[bool, float, float]:
    """Return True if a circle overlaps no solid, and else the vector from the nearest one [m]."""
    deepest, nx, ny = 0.0, 0.0, 0.0
    for b in range(len(solids.boxes)):
        dx = x - min(max(x, solids.boxes[b, 0]), solids.boxes[b, 2])
        dy = y - min(max(y, solids.boxes[b, 1]), solids.boxes[b, 3])
        depth = radius - np.hypot(dx, dy)
        if depth > deepest:
            deepest, nx, ny = depth, dx, dy
    for k in range(nearby.circle_starts[m], nearby.circle_starts[m + 1]):
        circle = solids.circles[nearby.circles[k]]
        dx, dy = x - circle[0], y - circle[1]
        depth = radius + circle[2] - np.hypot(dx, dy)
        if depth > deepest:
            deepest, nx, ny = depth, dx, dy
    for k in range(nearby.edge_starts[m], nearby.edge_starts[m + 1]):
        dx, dy = _from_edge(x, y, solids.edges[nearby.edges[k]])
        depth = radius - np.hypot(dx, dy)
        if depth > deepest:
            deepest, nx, ny = depth, dx, dy
    return deepest <= 0.0, nx, ny


@kernel
def free_for(
    m: int, x: float, y: float, state: Movers, solids: Solids, nearby: Nearby
) -> tuple[bool, float, float]:
    """Return True if mover m may stand at a place, and else the vector from what is there [m]."""
    radius = state.radii[0, m]
    free, nx, ny = _clear_of_solids(m, x, y, radius, solids, nearby)
    if not free:
        return False, nx, ny
    for o in range(state.radii.shape[1]):
        dx, dy = x - state.places[0, o, 0], y - state.places[0, o, 1]
        reach = radius + state.radii[0, o]
        if o != m and state.radii[0, o] > 0.0 and dx * dx + dy * dy < reach * reach:
            return False, dx, dy
    return True, 0.0, 0.0


@kernel
def going_round(
    m: int,
    vx: float,
    vy: float,
    state: Movers,
    agents: Agents,
    solids: Solids,
    nearby: Nearby,
) -> tuple[float, float]:
    """Return a velocity turned as little as needed for a way ahead that is clear of solids."""
    speed = np.hypot(vx, vy)
    if speed < 1e-6:
        return vx, vy
    heading, length = np.arctan2(vy, vx), speed * _LOOK_AHEAD
    side = agents.sides[m]
    for attempt in range(2 * _TURNS + 1):
        # Straight on; then along the side that was chosen, whatever it takes, and the other one. A
        # new obstacle is passed on the side that needs the smaller turn.
        if side == 0.0:
            turn, way = (attempt + 1) // 2, 1.0 if attempt % 2 else -1.0
        else:
            turn = attempt if attempt <= _TURNS else attempt - _TURNS
            way = side if attempt <= _TURNS else -side
        angle = heading + way * turn * _TURN
        c, s = np.cos(angle), np.sin(angle)
        if _way_is_clear(m, c, s, length, state, solids, nearby):
            agents.sides[m] = way if turn > 0 else 0.0
            if turn > 0:
                agents.headings[m] = angle
            return speed * c, speed * s
    # Nowhere to go: an animal decides anew, a person heads for another place.
    agents.until[m] = 0.0
    return 0.3 * vx, 0.3 * vy


@kernel
def _way_is_clear(
    m: int,
    c: float,
    s: float,
    length: float,
    state: Movers,
    solids: Solids,
    nearby: Nearby,
) -> bool:
    """Return True if a straight way is clear of solids: direction c, s, and its length [m]."""
    x, y, radius = state.places[0, m, 0], state.places[0, m, 1], state.radii[0, m]
    count = int(np.ceil(length / _SPACING))
    for k in range(1, count + 1):
        away = length * k / count
        # Near the begin the margin may be used up already.
        margin = min(_MARGIN, 0.5 * away)
        free, _, _ = _clear_of_solids(
            m, x + c * away, y + s * away, radius + margin, solids, nearby
        )
        if not free:
            return False
    return True
