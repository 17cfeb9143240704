"""Squares of nearest hits by brute force, for tests of what reads them."""

import numpy as np
from numpy.typing import ArrayLike

from andabata.navigation.planar.nearest_hits import NOWHERE, NearestHits, empty_hits


def hits_at(
    places: ArrayLike, cells: int = 128, cell: float = 0.05, reach: float = 0.7
) -> NearestHits:
    """Return the nearest hits of a square around the origin.

    Args:
        places: Hits [m], shape (k, 2).
        cells: Number of cells along the edge of the square.
        cell: Edge of a cell [m].
        reach: Distance from which on a hit does not count [m].
    """
    found = empty_hits(cells, cell, reach)
    found.corner[:] = -cells / 2 * cell
    middles = found.corner + (np.moveaxis(np.mgrid[:cells, :cells], 0, -1) + 0.5) * cell
    least = np.full((cells, cells), reach)
    for place in np.asarray(places, dtype=np.float64).reshape(-1, 2):
        away = np.linalg.norm(middles - place, axis=-1)
        found.places[away < least] = place
        least = np.minimum(least, away)
    found.places[least >= reach] = NOWHERE
    return found
