"""Bumps: points of near cells that rise over the plane of the ground around."""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.binning import HIGHEST, LOWEST, Quarters
from traversability.cell_columns import BUMP, BUMP_POINTS, BUMP_THIRD, MIN_DESCRIBED, CellWorkspace
from traversability.quarter_planes import GRADIENT_X, GRADIENT_Y, LEVEL

BUMP_RANGE = 3.2
"""Cells whose middle is nearer than this are searched for bumps [m]."""

_MIN_RELIEF = 0.03
"""Height difference below which a quarter holds no bump [m]."""

_BUMP_HEIGHT = 0.04
"""Height over the ground around from which on a point stops a wheel, or nearly [m]."""

# Columns of a quarter's highest points.
_FIRST, _SECOND, _THIRD, _N_ABOVE = range(4)


@kernel
def find_bumps(
    quarters: Quarters,
    middles: NDArray[np.float64],
    cells: CellWorkspace,
) -> None:
    """Write how far near cells rise over the plane of the ground around, and by how many points.

    A rock that stops a wheel is low beside what a slope rises in a cell, and has few points beside
    the cell's own: moments do not show it. One point over the plane is noise; the third highest of
    a quarter is not.

    Args:
        quarters: Points, quarter of each point and sums over the quarters.
        middles: Middle of each ring [m], shape (n_rings,).
        cells: Counts and planes of the cells; bumps are written to their features.
    """
    rings = 0
    while rings < cells.counts.shape[1] and middles[rings] < BUMP_RANGE:
        rings += 1
    # Most quarters are too flat to hold a bump: their points are skipped.
    tops = _highest_points(quarters, _with_relief(quarters.sums, rings), cells.planes)
    _write_bumps(tops, quarters.sums.shape[1], rings, cells)


@kernel
def _with_relief(sums: NDArray[np.float64], rings: int) -> NDArray[np.bool_]:
    """Return which quarters of the first rings may hold a bump, flat over all quarters."""
    columns = sums.shape[1]
    found = np.zeros(sums.shape[0] * columns, dtype=np.bool_)
    for i in range(sums.shape[0]):
        for j in range(2 * rings):
            found[i * columns + j] = sums[i, j, HIGHEST] - sums[i, j, LOWEST] >= _MIN_RELIEF
    return found


@kernel
def _highest_points(
    quarters: Quarters,
    wanted: NDArray[np.bool_],
    planes: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Return the three highest points of each quarter over its plane, and how many are bumps.

    Args:
        quarters: Points and the quarter of each.
        wanted: Quarters that are looked into, shape (k,).
        planes: Plane around each quarter; see ``CellWorkspace``.

    Returns:
        Heights [m], the highest first, and the number of points, shape (k, 4).
    """
    bins, slopes = quarters.bins, planes.reshape(len(wanted), 3)
    xs, ys, zs = quarters.columns[0], quarters.columns[1], quarters.columns[2]
    tops = np.zeros((len(wanted), 4))
    for k in range(len(xs)):
        if bins[k] < 0 or not wanted[np.uint64(bins[k])]:
            continue
        place = np.uint64(bins[k])
        rise = (
            zs[k]
            - slopes[place, GRADIENT_X] * xs[k]
            - slopes[place, GRADIENT_Y] * ys[k]
            - slopes[place, LEVEL]
        )
        if rise > _BUMP_HEIGHT:
            tops[place, _N_ABOVE] += 1.0
        # Few points are among the highest of their quarter: the others change nothing.
        if rise > tops[place, _THIRD]:
            first, second = tops[place, _FIRST], tops[place, _SECOND]
            tops[place, _FIRST] = max(first, rise)
            tops[place, _SECOND] = max(second, min(first, rise))
            tops[place, _THIRD] = min(second, rise)
    return tops


@kernel
def _write_bumps(tops: NDArray[np.float64], columns: int, rings: int, cells: CellWorkspace) -> None:
    """Write to each cell the highest bump of its quarters, and the points of all.

    Args:
        tops: Highest points of each quarter, as ``_highest_points`` returns them.
        columns: Number of half rings of the grid.
        rings: Number of rings that are written to.
        cells: Counts of the cells; bumps are written to their features.
    """
    for sector in range(cells.counts.shape[0]):
        for ring in range(rings):
            if cells.counts[sector, ring] < MIN_DESCRIBED:
                continue
            out = cells.values[sector, ring]
            out[BUMP] = out[BUMP_THIRD] = out[BUMP_POINTS] = 0.0
            for a in range(2):
                for b in range(2):
                    top = tops[(2 * sector + a) * columns + 2 * ring + b]
                    out[BUMP] = max(out[BUMP], top[_FIRST])
                    out[BUMP_THIRD] = max(out[BUMP_THIRD], top[_THIRD])
                    out[BUMP_POINTS] += top[_N_ABOVE]
