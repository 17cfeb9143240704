"""Nearest hits: for each cell around the robot, the place of the nearest obstacle.

Places, not distances of cells, are kept, so that a distance is exact to what the laser measured
wherever it is asked for. They spread from cell to cell in two sweeps (Danielsson 1980).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.planar.hit_layer import HitLayer
from terrain.kernel import kernel

NOWHERE = 1e6
"""Coordinate of the nearest hit where none is within reach [m]."""


class NearestHits(NamedTuple):
    """Nearest hits of a square, in the order of its cells.

    Attributes:
        places: Place of the hit nearest to the middle of each cell, ``NOWHERE`` if none is within
            reach [m], float32, shape (n, n, 2).
        corner: Place of the first cell's corner [m], shape (2,).
        box: First row, first column, and those behind the last, of the cells that can have a hit,
            shape (4,).
        cell: Edge of a cell [m].
        per_metre: Number of cells in a metre: looking up a place needs no division.
        reach: Distance from which on a hit does not count [m].
    """

    places: NDArray[np.float32]
    corner: NDArray[np.float64]
    box: NDArray[np.int64]
    cell: float
    per_metre: float
    reach: float


def empty_hits(cells: int, cell: float, reach: float) -> NearestHits:
    """Return a square without hits.

    Args:
        cells: Number of cells along its edge.
        cell: Edge of a cell [m].
        reach: Distance from which on a hit does not count [m].
    """
    places = np.full((cells, cells, 2), NOWHERE, dtype=np.float32)
    return NearestHits(places, np.zeros(2), np.zeros(4, dtype=np.int64), cell, 1.0 / cell, reach)


def find_nearest(hits: HitLayer, nearest: NearestHits) -> None:
    """Write the nearest obstacles of a hit layer into a square of as many cells.

    Args:
        hits: Hit layer.
        nearest: Result, changed in place.
    """
    nearest.corner[:] = (hits.centre - hits.config.cells // 2) * hits.config.cell
    _seed(hits.log_odds, hits.places, hits.centre, hits.config.lethal_log_odds, nearest)
    _sweep(nearest)


@kernel
def _seed(
    log_odds: NDArray[np.float32],
    within: NDArray[np.float32],
    centre: NDArray[np.int64],
    lethal: float,
    nearest: NearestHits,
) -> None:
    """Write the own hit of each obstacle's cell, nothing into the others, and their box."""
    n, cell = len(log_odds), nearest.cell
    low0, low1 = centre[0] - n // 2, centre[1] - n // 2
    top, left, bottom, right = nearest.box
    nearest.places[top:bottom, left:right] = NOWHERE
    top, left, bottom, right = n, n, -1, -1
    for i in range(n):
        row = (low0 + i) & (n - 1)
        for j in range(n):
            column = (low1 + j) & (n - 1)
            if log_odds[row, column] > lethal:
                nearest.places[i, j, 0] = (low0 + i + within[row, column, 0]) * cell
                nearest.places[i, j, 1] = (low1 + j + within[row, column, 1]) * cell
                top, left = min(top, i), min(left, j)
                bottom, right = max(bottom, i), max(right, j)
    # Most of the square is often far from all obstacles: it needs no sweep.
    far = int(nearest.reach / cell) + 1
    nearest.box[0], nearest.box[1] = max(top - far, 0), max(left - far, 0)
    nearest.box[2], nearest.box[3] = min(bottom + far + 1, n), min(right + far + 1, n)
    if bottom < 0:
        nearest.box[:] = 0


_BEFORE = ((-1, -1), (-1, 0), (-1, 1), (0, -1))
"""Neighbours that a sweep has been at: those of the row before, and the one before in the row."""


@kernel
def _sweep(nearest: NearestHits) -> None:
    """Spread places to the neighbours that they are nearest to, down the rows and up again.

    Each row is gone along, and back for the other neighbour of the same row.
    """
    places, cell, limit = nearest.places, nearest.cell, nearest.reach**2
    top, left, bottom, right = nearest.box
    for sweep in range(2):
        step = 1 - 2 * sweep
        for a in range(bottom - top):
            i = top + a if sweep == 0 else bottom - 1 - a
            u = nearest.corner[0] + (i + 0.5) * cell
            for along in range(2):
                turn = step * (1 - 2 * along)
                for b in range(right - left):
                    j = left + b if turn > 0 else right - 1 - b
                    v = nearest.corner[1] + (j + 0.5) * cell
                    own = (places[i, j, 0] - u) ** 2 + (places[i, j, 1] - v) ** 2
                    for k in range(3 * along, 4):
                        p, q = i + step * _BEFORE[k][0], j + turn * _BEFORE[k][1]
                        if not (top <= p < bottom and left <= q < right):
                            continue
                        x, y = places[p, q, 0], places[p, q, 1]
                        # Most cells are far from everything: nothing to compute.
                        if x == NOWHERE:
                            continue
                        there = (x - u) ** 2 + (y - v) ** 2
                        if there < own and there < limit:
                            places[i, j, 0], places[i, j, 1], own = x, y, there
