"""Quantile rule: a point is an obstacle if it stands out of a low quantile of its cell's heights.

The one-line baseline that the classifiers have to beat, and that data set cards quote.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.binning import cells_of_quarters, fill_quarters
from traversability.grid import PolarGrid

Points = NDArray[np.float32]
"""Points in ``base_footprint`` [m], shape (n, 3)."""

RULE_HEIGHT = 0.2
"""Height over the quantile above which a point is an obstacle in data set cards [m]; the best on
clouds like these."""

RULE_QUANTILE = 0.25
"""Quantile of a cell's heights in data set cards; the best on clouds like these."""


def quantile_rule(
    height: float, quantile: float, grid: PolarGrid
) -> Callable[[Points], NDArray[np.bool_]]:
    """Return the rule: a point is an obstacle ``height`` above the quantile of its cell's heights.

    Args:
        height: Height over the quantile above which a point is an obstacle [m].
        quantile: Quantile of the heights of a cell's points, 0 to 1; of the sorted heights, the one
            at or below it.
        grid: Polar grid of cells; points outside of it or above its cut are no obstacles.

    Returns:
        Function from points, float32, shape (n, 3), to which are obstacles, bool, shape (n,).
    """

    def obstacles(points: Points) -> NDArray[np.bool_]:
        """Return which points are obstacles."""
        bins = fill_quarters(points, grid).bins[: len(points)]
        return rule_obstacles(points, bins, height, quantile, grid)

    return obstacles


def rule_obstacles(
    points: Points, bins: NDArray[np.int32], height: float, quantile: float, grid: PolarGrid
) -> NDArray[np.bool_]:
    """Return which points of a cloud in quarters are obstacles by ``quantile_rule``, shape (n,).

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        bins: Quarter of each point, or -1; see ``Quarters``; shape (n,).
        height: Height over the quantile above which a point is an obstacle [m].
        quantile: Quantile of the heights of a cell's points, 0 to 1.
        grid: Polar grid of cells.
    """
    cells = cells_of_quarters(grid)
    # A NumPy sum keeps the limits float32, as the heights are.
    limits = _levels(points, bins, cells, quantile) + height
    is_obstacle = np.empty(len(points), dtype=np.bool_)
    _find_obstacles(points, bins, cells, limits, is_obstacle)
    return is_obstacle


@kernel
def _levels(
    points: NDArray[np.float32], bins: NDArray[np.int32], cells: NDArray[np.int64], quantile: float
) -> NDArray[np.float32]:
    """Return the quantile of each cell's heights [m], 0 without any, float32, shape (n_cells,).

    Args:
        points: Points [m], shape (n, 3).
        bins: Quarter of each point, or -1, shape (n,).
        cells: Cell of each quarter; the last one has the highest number.
        quantile: Quantile of the heights.
    """
    n_cells = cells[-1] + 1
    ends = np.zeros(n_cells + 1, dtype=np.int64)
    for k in range(len(points)):
        if bins[k] >= 0:
            ends[cells[bins[k]] + 1] += 1
    ends = np.cumsum(ends)
    # Heights cell by cell: a counting sort.
    heights, place = np.empty(ends[-1], dtype=np.float32), ends[:-1].copy()
    for k in range(len(points)):
        if bins[k] >= 0:
            cell = cells[bins[k]]
            heights[place[cell]] = points[k, 2]
            place[cell] += 1
    levels = np.zeros(n_cells, dtype=np.float32)
    for cell in range(n_cells):
        own = heights[ends[cell] : ends[cell + 1]]
        if len(own) > 0:
            levels[cell] = _ranked(own, int(quantile * (len(own) - 1)))
    return levels


@kernel
def _ranked(values: NDArray[np.float32], rank: int) -> np.float32:
    """Return the value at a rank from 0 of the sorted values, which are moved about.

    Source: Hoare 1961, "Algorithm 65: find", with partitions that guess no branch: in measured
    heights half of the guesses would be wrong.
    """
    low, high = 0, len(values) - 1
    while low < high:
        first, middle, last = values[low], values[(low + high) // 2], values[high]
        pivot = max(min(first, middle), min(max(first, middle), last))
        # Values below the pivot to the front, then those equal to it.
        below = low
        for k in range(low, high + 1):
            value = values[k]
            values[k], values[below] = values[below], value
            below += value < pivot
        if rank < below:
            high = below - 1
            continue
        equal = below
        for k in range(below, high + 1):
            value = values[k]
            values[k], values[equal] = values[equal], value
            equal += value <= pivot
        if rank < equal:
            return pivot
        low = max(equal, low + 1)  # Without an order, as with NaN, it comes to an end, too.
    return values[rank]


@kernel
def _find_obstacles(
    points: NDArray[np.float32],
    bins: NDArray[np.int32],
    cells: NDArray[np.int64],
    limits: NDArray[np.float32],
    is_obstacle: NDArray[np.bool_],
) -> None:
    """Write which points lie above the limit of their cell [m]."""
    for k in range(len(points)):
        is_obstacle[k] = bins[k] >= 0 and points[k, 2] > limits[cells[bins[k]]]
