"""Auto-context: features of the second stage, from the first stage's verdict on the neighbours.

On its own, a ground cell shows a step; the cells beside it show whether that is a rock's, a wall's
or a seam between sweeps. Trees that are given the log odds of a cell and of its neighbours classify
it again (auto-context, Tu and Bai 2010). Not in the papers (assumption).
"""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.cartesian.features import GROUND_FEATURES

CONTEXT_FEATURES = (
    *GROUND_FEATURES,
    "alone",
    "beside_mean",
    "beside_least",
    "beside_most",
)
"""Features of a ground cell at the second stage, in order: those of the first, its log odds there,
and mean, smallest and largest log odds of those of its eight neighbours that have points."""

MAX_LOG_ODDS = 8.0
"""Largest magnitude of the first stage's log odds: larger ones are clipped."""

NO_NEIGHBOUR = -9.0
"""Log odds in place of a neighbour without points, less than any."""

_OWN, _BESIDE_MEAN, _BESIDE_LEAST, _BESIDE_MOST = range(4)


def add_context(
    features: NDArray[np.float32], log_odds: NDArray[np.float64], cells: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Return the second stage's features of the ground cells of one cloud, shape (n, c).

    Args:
        features: Features in the order of ``GROUND_FEATURES``, float32, shape (n, f).
        log_odds: Log odds of the first stage, shape (n,).
        cells: Ground cells, each once, int64, shape (n, 2).

    Returns:
        Features in the order of ``CONTEXT_FEATURES``, float32.
    """
    n, n_known = features.shape
    found = np.empty((n, len(CONTEXT_FEATURES)), dtype=np.float32)
    found[:, :n_known] = features
    if n:
        # A map that just holds the cells, with a rim of one, so that each has eight neighbours.
        corner = cells.min(axis=0) - 1
        ground = np.full(cells.max(axis=0) - corner + 2, NO_NEIGHBOUR, dtype=np.float32)
        i, j = (cells - corner).T
        ground[i, j] = np.clip(log_odds, -MAX_LOG_ODDS, MAX_LOG_ODDS)
        _gather_neighbours(ground, i, j, found[:, n_known:])
    return found


@kernel
def _gather_neighbours(
    ground: NDArray[np.float32],
    i: NDArray[np.int64],
    j: NDArray[np.int64],
    found: NDArray[np.float32],
) -> None:
    """Write the log odds of each cell, and mean and extremes of its neighbours'.

    Args:
        ground: Log odds on a grid, ``NO_NEIGHBOUR`` where it has no cell.
        i: Row of each cell, at least 1, shape (n,).
        j: Column of each cell, at least 1, shape (n,).
        found: Output, columns ``_OWN`` to ``_BESIDE_MOST``, shape (n, 4).
    """
    for k in range(len(i)):
        count, total, least, most = 0, 0.0, MAX_LOG_ODDS, NO_NEIGHBOUR
        for u in range(-1, 2):
            for v in range(-1, 2):
                odds = ground[i[k] + u, j[k] + v]
                if odds > NO_NEIGHBOUR and (u != 0 or v != 0):
                    count, total = count + 1, total + odds
                    least, most = min(least, odds), max(most, odds)
        row = found[k]
        row[_OWN] = ground[i[k], j[k]]
        if count:
            row[_BESIDE_MEAN] = total / count
            row[_BESIDE_LEAST], row[_BESIDE_MOST] = least, most
        else:
            row[_BESIDE_MEAN] = row[_BESIDE_LEAST] = row[_BESIDE_MOST] = NO_NEIGHBOUR
