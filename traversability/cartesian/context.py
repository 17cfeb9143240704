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

_N_FEATURES = len(CONTEXT_FEATURES)

_OWN, _BESIDE_MEAN, _BESIDE_LEAST, _BESIDE_MOST = range(4)


@kernel
def add_context(
    features: NDArray[np.float32],
    log_odds: NDArray[np.float64],
    cells: NDArray[np.int64],
    due: NDArray[np.bool_] | None = None,
) -> NDArray[np.float32]:
    """Return the second stage's features of ground cells of one cloud, shape (k, c).

    Args:
        features: Features in the order of ``GROUND_FEATURES``, float32, shape (n, f).
        log_odds: Log odds of the first stage, shape (n,).
        cells: Ground cells, each once, int64, shape (n, 2).
        due: True for the k cells that are asked for, bool, shape (n,); None for all.

    Returns:
        Features in the order of ``CONTEXT_FEATURES``, float32.
    """
    asked = np.ones(len(cells), dtype=np.bool_) if due is None else due
    described = np.empty((np.count_nonzero(asked), _N_FEATURES), dtype=np.float32)
    if len(cells):
        _add_context(features, log_odds, cells, asked, described)
    return described


@kernel
def _add_context(
    features: NDArray[np.float32],
    log_odds: NDArray[np.float64],
    cells: NDArray[np.int64],
    due: NDArray[np.bool_],
    described: NDArray[np.float32],
) -> None:
    """Write the features of each cell that is due, and mean and extremes of its neighbours' odds.

    Args:
        features: Features of the first stage, shape (n, f).
        log_odds: Log odds of the first stage, shape (n,).
        cells: Ground cells, shape (n, 2).
        due: True for the k cells that are asked for, shape (n,).
        described: Output, shape (k, c).
    """
    # A map that just holds the cells, with a rim of one, so that each has eight neighbours.
    low0, low1 = cells[:, 0].min() - 1, cells[:, 1].min() - 1
    shape = (cells[:, 0].max() - low0 + 2, cells[:, 1].max() - low1 + 2)
    ground = np.full(shape, np.float32(NO_NEIGHBOUR), dtype=np.float32)
    for k in range(len(cells)):
        odds = min(max(log_odds[k], -MAX_LOG_ODDS), MAX_LOG_ODDS)
        ground[cells[k, 0] - low0, cells[k, 1] - low1] = odds
    count, n_known = 0, features.shape[1]
    for k in range(len(cells)):
        if due[k]:
            row = described[count]
            row[:n_known] = features[k]
            _gather_neighbours(ground, cells[k, 0] - low0, cells[k, 1] - low1, row[n_known:])
            count += 1


@kernel
def _gather_neighbours(
    ground: NDArray[np.float32], i: int, j: int, described: NDArray[np.float32]
) -> None:
    """Write the log odds of a cell, and mean and extremes of its neighbours'.

    Args:
        ground: Log odds on a grid, ``NO_NEIGHBOUR`` where it has no cell.
        i: Row of the cell, at least 1.
        j: Column of the cell, at least 1.
        described: Output, columns ``_OWN`` to ``_BESIDE_MOST``, shape (4,).
    """
    count, total, least, most = 0, 0.0, MAX_LOG_ODDS, NO_NEIGHBOUR
    for u in range(i - 1, i + 2):
        for v in range(j - 1, j + 2):
            odds = ground[u, v]
            if odds > NO_NEIGHBOUR and (u != i or v != j):
                count, total = count + 1, total + odds
                least, most = min(least, odds), max(most, odds)
    described[_OWN] = ground[i, j]
    if count:
        described[_BESIDE_MEAN] = total / count
        described[_BESIDE_LEAST], described[_BESIDE_MOST] = least, most
    else:
        described[_BESIDE_MEAN] = described[_BESIDE_LEAST] = described[_BESIDE_MOST] = NO_NEIGHBOUR
