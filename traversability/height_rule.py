"""Quantile rule: a point is an obstacle if it stands out of a low quantile of its cell's heights.

The one-line baseline that the classifiers have to beat, and that data set cards quote.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

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
    n_cells = grid.n_sectors * grid.n_rings

    def obstacles(points: Points) -> NDArray[np.bool_]:
        """Return which points are obstacles."""
        bins = fill_quarters(points, grid).bins[: len(points)]
        sector, ring = np.divmod(bins, 2 * grid.n_rings)
        cell = np.where(bins >= 0, sector // 2 * grid.n_rings + ring // 2, -1)
        # Sorted by cell, each is a run; a small type is sorted by its digits, in linear time.
        small = cell.astype(np.min_scalar_type(-n_cells))
        order = np.argsort(small, kind="stable")
        heights, ends = points[order, 2], np.cumsum(np.bincount(cell + 1, minlength=n_cells + 1))
        level = np.zeros(n_cells, dtype=np.float32)
        for k, (begin, end) in enumerate(pairwise(ends.tolist())):
            if end > begin:
                place = int(quantile * (end - begin - 1))
                level[k] = np.partition(heights[begin:end], place)[place]
        return np.asarray((cell >= 0) & (points[:, 2] > level[np.maximum(cell, 0)] + height))

    return obstacles
