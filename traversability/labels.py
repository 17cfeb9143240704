"""True states of cells from labelled points (Sanchez et al. 2023, section 3.4)."""

from enum import IntEnum

import numpy as np
from numba import njit
from numpy.typing import NDArray

from traversability.features import cell_of
from traversability.grid import PolarGrid

MIN_SHARE = 0.15
"""Share of non-traversable points that makes a cell non-traversable (paper: 15 %)."""


class CellState(IntEnum):
    """State of a cell: white, green and red in the paper's pictures."""

    EMPTY = 0
    TRAVERSABLE = 1
    NON_TRAVERSABLE = 2


def label_cells(
    points: NDArray[np.float32],
    nontraversable: NDArray[np.bool_],
    grid: PolarGrid,
    min_share: float = MIN_SHARE,
) -> NDArray[np.uint8]:
    """Return the true state of each cell.

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        nontraversable: Whether each belongs to something the robot must not drive on, shape (n,).
        grid: The cells; its height limit and least number of points hold here too.
        min_share: Share of non-traversable points from which a cell is non-traversable.

    Returns:
        ``CellState`` of each cell, uint8, shape (n_sectors, n_rings).

    Raises:
        ValueError: If there is not one label a point.
    """
    if nontraversable.shape != (len(points),):
        expected = (len(points),)
        raise ValueError(f"nontraversable: expected shape {expected}, got {nontraversable.shape}")
    edges = grid.ring_edges
    counts = np.zeros((2, grid.n_sectors, grid.n_rings), dtype=np.int64)
    _count(points, nontraversable, edges * edges, grid.max_height, counts)
    total = counts.sum(axis=0)
    bad = counts[1] >= min_share * total
    states = np.where(bad, CellState.NON_TRAVERSABLE, CellState.TRAVERSABLE)
    states[total < grid.min_points] = CellState.EMPTY
    return states.astype(np.uint8)


@njit(cache=True, nogil=True)
def _count(points, nontraversable, square_edges, max_height, counts):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Count good and bad points of each cell."""
    for k in range(len(points)):
        if not (points[k, 2] <= max_height and points[k, 2] > -np.inf):
            continue
        x, y = np.float64(points[k, 0]), np.float64(points[k, 1])
        sector, ring = cell_of(x, y, square_edges, counts.shape[1])
        if ring >= 0:
            counts[int(nontraversable[k]), sector, ring] += 1
