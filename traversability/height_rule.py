"""Height rule: a point is an obstacle where it stands out of a low quantile of its cell.

The one-line baseline that cards of data sets quote.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from traversability.binning import fill_quarters
from traversability.grid import PolarGrid

Points = NDArray[np.float32]


RULE_HEIGHT = 0.2


RULE_QUANTILE = 0.25
"""Settings of the rule that data set cards quote, the best on clouds like these [m]."""


def quantile_rule(
    height: float, quantile: float, grid: PolarGrid
) -> Callable[[Points], NDArray[np.bool_]]:
    """Return the one-line rule: a point is an obstacle ``height`` [m] above its cell's quantile."""

    def obstacles(points: Points) -> NDArray[np.bool_]:
        bins = fill_quarters(points, grid).bins[: len(points)]
        sector, ring = np.divmod(bins, 2 * grid.n_rings)
        cell = np.where(bins >= 0, sector // 2 * grid.n_rings + ring // 2, -1)
        order = np.lexsort((points[:, 2], cell))
        ranked = cell[order]
        begins = np.searchsorted(ranked, np.arange(grid.n_sectors * grid.n_rings))
        sizes = np.searchsorted(ranked, np.arange(grid.n_sectors * grid.n_rings), "right") - begins
        places = begins + (quantile * np.maximum(sizes - 1, 0)).astype(int)
        level = points[order[np.minimum(places, len(points) - 1)], 2]
        return np.asarray((cell >= 0) & (points[:, 2] > level[np.maximum(cell, 0)] + height))

    return obstacles
