"""What the squares around one are taken for: the second look at a cloud.

Alone, a square shows a step; whether it is a rock's, a wall's or that of a seam between sweeps is
seen in the squares beside it. Trees that know the odds of a square and of its neighbours judge it
again, which is auto-context (Tu and Bai 2010). Not in the papers (assumption).
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
"""What is known of a square at the second look, in order: its features, its log odds at the first,
and the mean, least and largest of those of its eight neighbours that have points."""

MAX_LOG_ODDS = 8.0
"""Log odds of the first look count up to this."""

NO_NEIGHBOUR = -9.0
"""Log odds where no neighbour has points: less than any."""


def add_context(
    features: NDArray[np.float32], odds: NDArray[np.float64], places: NDArray[np.int64]
) -> NDArray[np.float32]:
    """Return what the second look knows of the squares of one cloud, shape (n, c).

    Args:
        features: In the order of ``GROUND_FEATURES``, float32, shape (n, f).
        odds: Log odds of the first look, shape (n,).
        places: The squares, each once, int64, shape (n, 2).

    Returns:
        In the order of ``CONTEXT_FEATURES``, float32.
    """
    n, known = features.shape
    found = np.empty((n, len(CONTEXT_FEATURES)), dtype=np.float32)
    found[:, :known] = features
    if n:
        corner = places.min(axis=0) - 1
        ground = np.full(places.max(axis=0) - corner + 2, NO_NEIGHBOUR, dtype=np.float32)
        i, j = (places - corner).T
        ground[i, j] = np.clip(odds, -MAX_LOG_ODDS, MAX_LOG_ODDS)
        _gather(ground, i, j, found[:, known:])
    return found


@kernel
def _gather(ground, i, j, found):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the odds of squares and what those of their neighbours come to."""
    for k in range(len(i)):
        count, total, least, most = 0, 0.0, MAX_LOG_ODDS, NO_NEIGHBOUR
        for u in range(-1, 2):
            for v in range(-1, 2):
                odds = ground[i[k] + u, j[k] + v]
                if odds > NO_NEIGHBOUR and (u != 0 or v != 0):
                    count, total = count + 1, total + odds
                    least, most = min(least, odds), max(most, odds)
        row = found[k]
        row[0] = ground[i[k], j[k]]
        row[1], row[2], row[3] = (
            (total / count, least, most) if count else (NO_NEIGHBOUR, NO_NEIGHBOUR, NO_NEIGHBOUR)
        )
