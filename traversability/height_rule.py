"""Quantile rule: a point is an obstacle if it stands out of a low quantile of its cell's heights.

The one-line baseline that the classifiers have to beat, and that data set cards quote.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.binning import fill_quarters
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
        found = np.zeros(len(points), dtype=np.bool_)
        n_cells = grid.n_sectors * grid.n_rings
        _mark(points, bins, (n_cells, grid.n_rings), np.float32(height), quantile, found)
        return found

    return obstacles


@kernel
def _mark(
    points: Points,
    bins: NDArray[np.int32],
    shape: tuple[int, int],
    height: np.float32,
    quantile: float,
    found: NDArray[np.bool_],
) -> None:
    """Mark the points that are obstacles.

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        bins: Quarter of each point, or -1; see ``Quarters``.
        shape: Number of cells and of rings.
        height: Height over the quantile above which a point is an obstacle [m].
        quantile: Quantile of the heights of a cell's points, 0 to 1.
        found: Output: True for obstacles, shape (n,).
    """
    n_cells, n_rings = shape
    cells = np.empty(len(bins), dtype=np.int32)
    firsts = np.zeros(n_cells + 1, dtype=np.int64)
    for k in range(len(bins)):
        if bins[k] >= 0:
            # A quarter is half a sector by half a ring.
            sector, ring = divmod(bins[k], 2 * n_rings)
            cells[k] = sector // 2 * n_rings + ring // 2
            firsts[cells[k] + 1] += 1
    firsts = np.cumsum(firsts)
    # Each cell's points are a run of ``order``.
    filled, order = firsts.copy(), np.empty(firsts[n_cells], dtype=np.int64)
    for k in range(len(bins)):
        if bins[k] >= 0:
            order[filled[cells[k]]] = k
            filled[cells[k]] += 1
    for cell in range(n_cells):
        run = order[firsts[cell] : firsts[cell + 1]]
        if len(run):
            place = int(quantile * (len(run) - 1))
            level = np.partition(points[run, 2], place)[place] + height
            for k in run:
                found[k] = points[k, 2] > level
