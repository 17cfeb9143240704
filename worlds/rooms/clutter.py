"""Random cluttered rooms: boxes, walls, corners, pockets and cylinders of a drawn coverage.

Pieces keep a gap from each other, and from the walls around or stand at them, so that no way is
narrower than the gap, and all that is free outside of the pieces is one region.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from worlds.rooms.movers import MoverPlan
from worlds.rooms.room import Room, RoomPlan

COVERAGE = (0.08, 0.27)
"""Least and largest share of the floor that is covered: those of TD3's rooms are within it."""

_ATTEMPTS = 100
"""Number of layouts that are begun until one has its coverage."""

_PLACES = 64
"""Number of places that are tried at once for a piece."""

_MISSES = 40
"""Number of pieces that may find no place before a layout is begun anew."""

_REST = 0.25
"""Area that may be missing from a layout in the end [m2]; pieces may be larger by as much."""

_AT_WALL = 0.25
"""Share of the places of boxes and walls that stand at a wall of the room, along each axis."""

_KINDS = {"box": 0.4, "cylinder": 0.2, "wall": 0.15, "corner": 0.15, "pocket": 0.1}
"""Kinds of pieces and how often they are drawn."""


class _Piece(NamedTuple):
    """An obstacle of one or several parts, its lower left corner at the origin.

    Attributes:
        boxes: x_min, y_min, x_max, y_max [m], shape (n, 4).
        radius: Radius of the cylinder that it is in the place of boxes, 0 for boxes [m].
        size: Extent in x and y [m].
        area: Area [m2].
        may_lean: True if it may stand at a wall of the room.
    """

    boxes: NDArray[np.float64]
    radius: float
    size: tuple[float, float]
    area: float
    may_lean: bool


def random_cluttered_room(
    seed: int, half: float = 5.0, gap: float = 0.8, movers: tuple[int, int] | None = None
) -> Room:
    """Return a square room of a coverage between 8 and 27 %, the same for the same seed.

    Args:
        seed: Seed of the layout. The coverage is drawn from it, too.
        half: Half of the free space's edge [m].
        gap: Least width of a way [m].
        movers: Fewest and most moving obstacles, of 0.2 to 0.5 m and 0.2 to 0.8 m/s, at random
            places in each episode (assumption); None for none. The layout does not depend on it.

    Raises:
        ValueError: If no layout has its coverage.
    """
    rng = np.random.default_rng(seed)
    goal_area = rng.uniform(*COVERAGE) * (2 * half) ** 2
    crowd = [] if movers is None else _movers(np.random.default_rng([seed, 1]), *movers)
    name = f"clutter-{seed}" if movers is None else f"clutter-movers-{seed}"
    for _ in range(_ATTEMPTS):
        boxes, circles, missing = _layout(rng, half, gap, goal_area)
        if missing < _REST:
            plan = {"about": "random clutter", "half": (half, half), "movers": crowd}
            plan |= {"boxes": boxes.tolist(), "circles": circles.tolist()}
            return Room.of(name, RoomPlan.model_validate(plan))
    raise ValueError(f"room {name}: expected a layout of its coverage, got none; a smaller gap")


def _layout(
    rng: np.random.Generator, half: float, gap: float, goal_area: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return boxes, circles and the area that is missing [m2]."""
    boxes, circles, missing, misses = np.zeros((0, 4)), np.zeros((0, 3)), goal_area, 0
    waiting: list[_Piece] = []
    while missing >= _REST and misses < _MISSES:
        # The largest first, since what comes late has little room; others for those without any.
        waiting = waiting or sorted(_pieces(rng, missing), key=_footprint)
        piece = waiting.pop()
        place = _place(rng, piece, boxes, circles, half, gap)
        if place is None:
            misses += 1
            continue
        missing -= piece.area
        if piece.radius:
            circles = np.vstack([circles, [*(place + piece.radius), piece.radius]])
        else:
            boxes = np.vstack([boxes, piece.boxes + np.tile(place, 2)])
    return boxes, circles, missing


def _footprint(piece: _Piece) -> float:
    """Return the area of the rectangle around a piece [m2]."""
    return piece.size[0] * piece.size[1]


def _pieces(rng: np.random.Generator, goal_area: float) -> list[_Piece]:
    """Return random pieces of an area together, but for a rest."""
    pieces: list[_Piece] = []
    missing = goal_area
    while missing >= _REST:
        piece = _piece(rng)
        if piece.area <= missing + _REST:
            pieces.append(piece)
            missing -= piece.area
    return pieces


def _place(
    rng: np.random.Generator,
    piece: _Piece,
    boxes: NDArray[np.float64],
    circles: NDArray[np.float64],
    half: float,
    gap: float,
) -> NDArray[np.float64] | None:
    """Return where a piece's lower left corner keeps its gap to all others [m], or None."""
    size = np.array(piece.size)
    if size.max() > 2 * (half - gap):
        return None
    places = rng.uniform(gap - half, half - gap - size, (_PLACES, 2))
    if piece.may_lean:
        sides = np.where(rng.random((_PLACES, 2)) < 0.5, -half, half - size)
        places = np.where(rng.random((_PLACES, 2)) < _AT_WALL, sides, places)
    nearest = np.full(_PLACES, np.inf)
    if piece.radius:
        centres = places + piece.radius
        nearest = np.minimum(nearest, _to_boxes(centres, centres, boxes) - piece.radius)
        nearest = np.minimum(nearest, _to_circles(centres, centres, circles) - piece.radius)
    for box in piece.boxes:
        low, high = places + box[:2], places + box[2:]
        nearest = np.minimum(nearest, _to_boxes(low, high, boxes))
        nearest = np.minimum(nearest, _to_circles(low, high, circles))
    free = np.flatnonzero(nearest >= gap)
    return places[free[0]] if len(free) else None


def _to_boxes(
    low: NDArray[np.float64], high: NDArray[np.float64], boxes: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the distance of boxes from the nearest of others [m], shape (k,).

    Args:
        low: x_min and y_min of each [m], shape (k, 2).
        high: x_max and y_max of each [m], shape (k, 2).
        boxes: The others, shape (n, 4).
    """
    outside = np.maximum(low[:, None] - boxes[:, 2:], boxes[:, :2] - high[:, None])
    gaps = np.hypot(*np.maximum(outside, 0.0).transpose(2, 0, 1))
    return np.asarray(gaps.min(axis=1, initial=np.inf))


def _to_circles(
    low: NDArray[np.float64], high: NDArray[np.float64], circles: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the distance of boxes from the nearest of circles [m]; arguments as above."""
    middles = np.tile(circles[:, :2], 2)
    outside = np.maximum(low[:, None] - middles[:, 2:], middles[:, :2] - high[:, None])
    gaps = np.hypot(*np.maximum(outside, 0.0).transpose(2, 0, 1)) - circles[:, 2]
    return np.asarray(gaps.min(axis=1, initial=np.inf))


def _piece(rng: np.random.Generator) -> _Piece:
    """Return a random piece, turned by a random number of right angles."""
    kind = str(rng.choice(list(_KINDS), p=list(_KINDS.values())))
    if kind == "cylinder":
        radius = rng.uniform(0.2, 0.9)
        return _Piece(np.zeros((0, 4)), radius, (2 * radius,) * 2, math.pi * radius**2, False)
    if kind == "box":
        width, depth = rng.uniform(0.4, 2.2, 2)
        return _boxes([(0.0, 0.0, width, depth)], rng, True)
    length, thick = rng.uniform(1.0, 4.0), rng.uniform(0.1, 0.3)
    if kind == "wall":
        return _boxes([(0.0, 0.0, length, thick)], rng, True)
    if kind == "corner":
        width, depth, thick = *rng.uniform(1.0, 2.5, 2), rng.uniform(0.2, 0.8)
        return _boxes([(0.0, 0.0, width, thick), (0.0, thick, thick, depth)], rng, False)
    # A pocket is open on one side, and wide enough to drive in.
    width, depth, thick = rng.uniform(1.6, 3.0), rng.uniform(0.8, 2.0), rng.uniform(0.1, 0.3)
    sides = [(0.0, thick, thick, depth), (width - thick, thick, width, depth)]
    return _boxes([(0.0, 0.0, width, thick), *sides], rng, False)


def _boxes(
    boxes: Sequence[tuple[float, float, float, float]], rng: np.random.Generator, may_lean: bool
) -> _Piece:
    """Return a piece of boxes that touch each other but do not overlap, mirrored and turned."""
    rows = np.array(boxes)
    size = rows[:, 2:].max(axis=0)
    for axis in range(2):
        if rng.random() < 0.5:
            rows[:, [axis, axis + 2]] = size[axis] - rows[:, [axis + 2, axis]]
    if rng.random() < 0.5:
        rows, size = rows[:, [1, 0, 3, 2]], size[::-1]
    area = float(np.prod(rows[:, 2:] - rows[:, :2], axis=1).sum())
    return _Piece(rows, 0.0, (float(size[0]), float(size[1])), area, may_lean)


def _movers(rng: np.random.Generator, fewest: int, most: int) -> list[MoverPlan]:
    """Return random movers that begin anywhere."""
    return [
        MoverPlan(radius=rng.uniform(0.2, 0.5), speed=rng.uniform(0.2, 0.8))
        for _ in range(int(rng.integers(fewest, most + 1)))
    ]
