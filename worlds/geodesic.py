"""Shortest ways of a disc to a goal in a room, from everywhere: lengths by lazy Theta*.

The search runs over a grid, but a way is not bound to it: it goes in straight lines from turning
point to turning point, so that lengths are those of the plane and not of a grid's eight directions.

Source: Nash, Koenig and Tovey 2010, Lazy Theta*, here from the goal to all nodes.
"""

from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from worlds.rooms import Room

_CELL = 0.05
"""Distance between nodes [m]."""

_TOUCH = 1e-9
"""Depth to which a disc may overlap an obstacle [m]: rounding must not forbid to touch."""


class GeodesicField(NamedTuple):
    """Lengths of the shortest ways to one goal, on a grid of nodes.

    Attributes:
        corner: Place of the first node [m], shape (2,).
        cell: Distance between nodes [m].
        turns: Point that the way from a node first goes to in a straight line: where it turns, or
            the goal [m], shape (nx, ny, 2).
        rests: Length of the way from there to the goal [m], infinite where there is none, shape
            (nx, ny).
    """

    corner: NDArray[np.float64]
    cell: float
    turns: NDArray[np.float64]
    rests: NDArray[np.float64]


def geodesic_field(room: Room, goal: tuple[float, float], radius: float) -> GeodesicField:
    """Return the lengths of a disc's shortest ways to a goal.

    A way turns at nodes of 5 cm: it is a few millimetres longer at each corner than the shortest.

    Args:
        room: Room.
        goal: Goal [m].
        radius: Radius of the disc [m].
    """
    half = np.array(room.half)
    counts = np.floor(2 * half / _CELL + 1e-6).astype(np.int64) + 1
    corner = np.asarray(-0.5 * _CELL * (counts - 1), dtype=np.float64)
    lines = [corner[axis] + _CELL * np.arange(counts[axis]) for axis in range(2)]
    nodes = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    clearance = room.clearance(nodes.reshape(-1, 2)).reshape(nodes.shape[:2])
    turns, rests = np.zeros(nodes.shape), np.full(nodes.shape[:2], np.inf)
    place = np.array(goal, dtype=np.float64)
    field = GeodesicField(corner, _CELL, turns, rests)
    _search(field, clearance >= radius - _TOUCH, place, room.boxes, room.circles, radius)
    _spread(field)
    return field


@kernel
def length_from(field: GeodesicField, x: float, y: float) -> float:
    """Return the length of the shortest way from a place [m], infinite if there is none.

    Args:
        field: Lengths to one goal.
        x: Place [m]; the disc must fit there.
        y: Place [m].
    """
    nx, ny = field.rests.shape
    i = min(max(int(np.rint((x - field.corner[0]) / field.cell)), 0), nx - 1)
    j = min(max(int(np.rint((y - field.corner[1]) / field.cell)), 0), ny - 1)
    turn = field.turns[i, j]
    return field.rests[i, j] + np.hypot(turn[0] - x, turn[1] - y)


@kernel
def _search(
    field: GeodesicField,
    free: NDArray[np.bool_],
    goal: NDArray[np.float64],
    boxes: NDArray[np.float64],
    circles: NDArray[np.float64],
    radius: float,
) -> None:
    """Write turning points and rests of all free nodes that can reach the goal."""
    nx, ny = free.shape
    turns, rests = field.turns, field.rests
    closed = np.zeros((nx, ny), dtype=np.bool_)
    lengths = np.full((nx, ny), np.inf)
    queue = [(0.0, 0, 0) for _ in range(0)]
    # The goal is no node: those around it begin.
    gi = int(np.floor((goal[0] - field.corner[0]) / field.cell))
    gj = int(np.floor((goal[1] - field.corner[1]) / field.cell))
    for i in range(max(gi - 1, 0), min(gi + 3, nx)):
        for j in range(max(gj - 1, 0), min(gj + 3, ny)):
            x, y = field.corner[0] + i * field.cell, field.corner[1] + j * field.cell
            if free[i, j] and is_clear(goal[0], goal[1], x, y, boxes, circles, radius):
                turns[i, j], rests[i, j] = goal, 0.0
                lengths[i, j] = np.hypot(goal[0] - x, goal[1] - y)
                heappush(queue, (lengths[i, j], i, j))
    while len(queue):
        length, i, j = heappop(queue)
        if closed[i, j] or length > lengths[i, j]:
            continue
        x, y = field.corner[0] + i * field.cell, field.corner[1] + j * field.cell
        turn = turns[i, j]
        # The straight line that a neighbour handed on was not looked at until now.
        if not is_clear(turn[0], turn[1], x, y, boxes, circles, radius):
            lengths[i, j] = _turn_at_neighbour(field, lengths, closed, i, j, boxes, circles, radius)
            if lengths[i, j] < np.inf:
                heappush(queue, (lengths[i, j], i, j))
            continue
        closed[i, j] = True
        for p in range(max(i - 1, 0), min(i + 2, nx)):
            for q in range(max(j - 1, 0), min(j + 2, ny)):
                if not free[p, q] or closed[p, q]:
                    continue
                px, py = field.corner[0] + p * field.cell, field.corner[1] + q * field.cell
                further = rests[i, j] + np.hypot(turn[0] - px, turn[1] - py)
                if further < lengths[p, q] - 1e-12:
                    lengths[p, q], turns[p, q], rests[p, q] = further, turn, rests[i, j]
                    heappush(queue, (further, p, q))
    for i in range(nx):
        for j in range(ny):
            if not closed[i, j]:
                rests[i, j] = np.inf


@kernel
def _turn_at_neighbour(
    field: GeodesicField,
    lengths: NDArray[np.float64],
    closed: NDArray[np.bool_],
    i: int,
    j: int,
    boxes: NDArray[np.float64],
    circles: NDArray[np.float64],
    radius: float,
) -> float:
    """Let a node's way turn at the best finished neighbour; return its length, or infinity."""
    nx, ny = closed.shape
    x, y = field.corner[0] + i * field.cell, field.corner[1] + j * field.cell
    best = np.inf
    for p in range(max(i - 1, 0), min(i + 2, nx)):
        for q in range(max(j - 1, 0), min(j + 2, ny)):
            px, py = field.corner[0] + p * field.cell, field.corner[1] + q * field.cell
            further = lengths[p, q] + np.hypot(px - x, py - y)
            if closed[p, q] and further < best and is_clear(px, py, x, y, boxes, circles, radius):
                best = further
                field.turns[i, j, 0], field.turns[i, j, 1] = px, py
                field.rests[i, j] = lengths[p, q]
    return best


def _spread(field: GeodesicField) -> None:
    """Give nodes without a way, beside those with one, the turning point of the nearest."""
    # Places between a free and a blocked node, where the disc may fit, are read off either.
    before = np.isfinite(field.rests)
    turns, rests = field.turns.copy(), field.rests.copy()
    for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)):
        source = _shifted(before.shape, di, dj)
        target = _shifted(before.shape, -di, -dj)
        gains = before[source] & ~np.isfinite(field.rests[target])
        field.turns[target][gains] = turns[source][gains]
        field.rests[target][gains] = rests[source][gains]


def _shifted(shape: tuple[int, ...], di: int, dj: int) -> tuple[slice, slice]:
    """Return the part of a grid whose cells have a neighbour at (-di, -dj)."""
    return (
        slice(max(di, 0), shape[0] + min(di, 0)),
        slice(max(dj, 0), shape[1] + min(dj, 0)),
    )


@kernel
def is_clear(
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    boxes: NDArray[np.float64],
    circles: NDArray[np.float64],
    radius: float,
) -> bool:
    """Return True if a disc can drive straight from one point to another; exact.

    Args:
        x0: Begin [m].
        y0: Begin [m].
        x1: End [m].
        y1: End [m].
        boxes: Boxes of a room [m], shape (n, 4).
        circles: Circles of a room [m], shape (m, 3).
        radius: Radius of the disc [m].
    """
    x_low, x_high = min(x0, x1) - radius, max(x0, x1) + radius
    y_low, y_high = min(y0, y1) - radius, max(y0, y1) + radius
    least = (radius - _TOUCH) * (radius - _TOUCH)
    for box in boxes:
        # Most boxes are far from the line.
        if box[2] < x_low or box[0] > x_high or box[3] < y_low or box[1] > y_high:
            continue
        if _crosses(x0, y0, x1, y1, box):
            return False
        # Apart, a line and a box are nearest at a corner of the box or at an end of the line.
        for x, y in ((x0, y0), (x1, y1)):
            dx, dy = max(box[0] - x, 0.0, x - box[2]), max(box[1] - y, 0.0, y - box[3])
            if dx * dx + dy * dy < least:
                return False
        for x in (box[0], box[2]):
            for y in (box[1], box[3]):
                if _squared(x0, y0, x1, y1, x, y) < least:
                    return False
    for circle in circles:
        gap = radius + circle[2] - _TOUCH
        if _squared(x0, y0, x1, y1, circle[0], circle[1]) < gap * gap:
            return False
    return True


@kernel
def _crosses(x0: float, y0: float, x1: float, y1: float, box: NDArray[np.float64]) -> bool:
    """Return True if a straight line meets a box (slab test)."""
    enter, leave = 0.0, 1.0
    for axis in range(2):
        begin, move = (x0, x1 - x0) if axis == 0 else (y0, y1 - y0)
        if move == 0.0:
            if begin < box[axis] or begin > box[axis + 2]:
                return False
            continue
        one, other = (box[axis] - begin) / move, (box[axis + 2] - begin) / move
        enter, leave = max(enter, min(one, other)), min(leave, max(one, other))
    return enter <= leave


@kernel
def _squared(x0: float, y0: float, x1: float, y1: float, x: float, y: float) -> float:
    """Return the squared distance of a point from a straight line between two others [m2]."""
    ux, uy, vx, vy = x1 - x0, y1 - y0, x - x0, y - y0
    whole = ux * ux + uy * uy
    share = min(max((ux * vx + uy * vy) / whole, 0.0), 1.0) if whole > 0.0 else 0.0
    dx, dy = vx - share * ux, vy - share * uy
    return dx * dx + dy * dy
