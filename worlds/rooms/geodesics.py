"""Shortest ways of a disc through a room, from everywhere to a goal."""

from functools import lru_cache
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from worlds.rooms.room import CELL, Room, cell_clearances

HALF_DIAGONAL = CELL * np.sqrt(0.5)
"""Largest distance of a place from the middle of its cell [m]."""


class Ways(NamedTuple):
    """Clearance of a room's cells, and the shortest ways from them to a goal.

    Attributes:
        low: x and y of the first cell's outer corner [m], shape (2,).
        clearances: Distance of each cell's middle to the nearest obstacle [m], shape (n, m).
        corners: Next corner of the way from each cell to the goal: x, y and the length of the way
            from there on [m], shape (n, m, 3); infinite without a way.
    """

    low: NDArray[np.float64]
    clearances: NDArray[np.float64]
    corners: NDArray[np.float64]


@lru_cache(maxsize=64)
def ways_to(room: Room, goal: tuple[float, float], goal_radius: float, radius: float) -> Ways:
    """Return the ways of a disc to a goal from every cell of a room.

    Lengths are those of the disc's shortest ways, mostly below them: by 1 %, and around corners by
    up to 3 %. The way leads through cells whose middle it might touch something in, so a disc
    smaller by half a cell's diagonal decides which are free.

    Args:
        room: Room, without obstacles that appear.
        goal: Goal [m].
        goal_radius: Distance from the goal within which it counts as reached [m]; ways lead to its
            middle.
        radius: Radius of the disc [m].
    """
    low, clearances = -np.array(room.half), cell_clearances(room)
    corners = _corners(clearances, low, np.array(goal), goal_radius, radius - HALF_DIAGONAL)
    return Ways(low, clearances, corners)


@kernel
def remaining(x: float, y: float, ways: Ways) -> float:
    """Return the length of the shortest way from a place to the goal's middle [m]."""
    i, j = int((x - ways.low[0]) / CELL), int((y - ways.low[1]) / CELL)
    corner = ways.corners[i, j]
    return corner[2] + np.hypot(x - corner[0], y - corner[1])


@kernel
def _corners(
    clearances: NDArray[np.float64],
    low: NDArray[np.float64],
    goal: NDArray[np.float64],
    goal_radius: float,
    radius: float,
) -> NDArray[np.float64]:
    """Return the next corner of the shortest way of a disc from each cell, as ``Ways`` has it.

    Dijkstra's search over eight neighbours from the goal. A cell that sees the next corner of its
    neighbour's way goes there straight (Theta*, Nash et al. 2007), so that lengths are not those of
    ways along the grid.
    """
    n, m = clearances.shape
    best = np.full((n, m), np.inf)
    corners = np.full((n, m, 3), np.inf)
    waiting = [(np.inf, 0, 0)]  # It is popped last; numba takes the list's type from it.
    for i in range(n):
        for j in range(m):
            x, y = low[0] + (i + 0.5) * CELL, low[1] + (j + 0.5) * CELL
            away = np.hypot(x - goal[0], y - goal[1])
            if away < goal_radius + HALF_DIAGONAL and clearances[i, j] >= radius:
                best[i, j] = away
                corners[i, j] = goal[0], goal[1], 0.0
                heappush(waiting, (away, i, j))
    while len(waiting) > 1:
        length, i, j = heappop(waiting)
        if length > best[i, j]:
            continue
        here_x, here_y = low[0] + (i + 0.5) * CELL, low[1] + (j + 0.5) * CELL
        corner_x, corner_y, onward = corners[i, j]
        for a in range(max(i - 1, 0), min(i + 2, n)):
            for b in range(max(j - 1, 0), min(j + 2, m)):
                x, y = low[0] + (a + 0.5) * CELL, low[1] + (b + 0.5) * CELL
                straight = onward + np.hypot(x - corner_x, y - corner_y)
                # The way by the neighbour is no shorter: one test spares the look at both.
                if clearances[a, b] < radius or straight >= best[a, b]:
                    continue
                stepped = length + np.hypot(x - here_x, y - here_y)
                if _sees(clearances, low, radius, x, y, corner_x, corner_y):
                    best[a, b] = straight
                    corners[a, b] = corner_x, corner_y, onward
                elif stepped < best[a, b]:
                    best[a, b] = stepped
                    corners[a, b] = here_x, here_y, length
                else:
                    continue
                heappush(waiting, (best[a, b], a, b))
    return corners


@kernel
def _sees(
    clearances: NDArray[np.float64],
    low: NDArray[np.float64],
    radius: float,
    x: float,
    y: float,
    to_x: float,
    to_y: float,
) -> bool:
    """Return True if a disc can drive straight from (x, y) to another place [m]."""
    length = np.hypot(to_x - x, to_y - y)
    gone = 0.0
    while gone < length:
        share = gone / length
        i = int((x + share * (to_x - x) - low[0]) / CELL)
        j = int((y + share * (to_y - y) - low[1]) / CELL)
        spare = clearances[i, j] - radius
        if spare < 0.0:
            return False
        # As far as the clearance reaches nothing can be in the way.
        gone += max(spare - HALF_DIAGONAL, 0.5 * CELL)
    return True
