"""One pass over the points of quarters with relief: the highest over the plane, and all by layer.

Most quarters are flat, and what their points would add is known from their sums: only the others'
points are looked at one by one.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import borrowing_kernel, inlined_kernel, kernel
from traversability.binning import COUNT, HIGHEST, LOWEST, Quarters, Z
from traversability.cells.columns import LAYERS, MIN_DESCRIBED, CellWorkspace
from traversability.cells.quarter_planes import GRADIENT_X, GRADIENT_Y, LEVEL, MEAN_X, MEAN_Y

BUMP_HEIGHT = 0.04
"""Height over the ground around from which on a point stops a wheel, or nearly [m]."""

FIRST, SECOND, THIRD, N_ABOVE = range(4)
"""Columns of a quarter's highest points: their heights [m], and the number above
``BUMP_HEIGHT``."""

LAYERS_PER_LIMIT = 3
"""Layers up to the plants' limit."""

LAYERS_BELOW = 2
"""Layers below the ground: noise, and the ground behind an edge."""

_MIN_RELIEF = 0.03
"""Height difference below which a quarter holds no bump [m]."""

_FLAT_TOP = 0.4
"""Height over the ground, in limits, under which a quarter's points are not looked at one by one:
its mean and twice its scatter are lower."""

_FOR_BUMPS, _FOR_LAYERS = 1, 2
"""Flags of what a quarter's points are looked at for."""


class _Relief(NamedTuple):
    """What the pass over the points needs to know of each quarter, flat over all quarters.

    Attributes:
        flags: Sum of the flags of what its points are looked at for, uint8, shape (k,).
        shifts: Height of its plane over the local ground [m], shape (k,).
        cells: Index of its cell, int64, shape (k,).
    """

    flags: NDArray[np.uint8]
    shifts: NDArray[np.float64]
    cells: NDArray[np.int64]


@kernel
def examine_relief(
    quarters: Quarters,
    bump_rings: int,
    max_traversable_vegetation: float,
    cells: CellWorkspace,
) -> NDArray[np.float64]:
    """Count all points in layers over the local ground, and find the highest of near quarters.

    Args:
        quarters: Points, quarter of each point and sums over the quarters.
        bump_rings: Number of rings whose quarters' highest points are found.
        max_traversable_vegetation: Height of plants that the robot may cross [m].
        cells: Counts, means, planes, scatter and ground levels; layers are written.

    Returns:
        The three highest points of each quarter over its plane [m], the highest first, and the
        number of points that are bumps, shape (k, 4); zero in rings beyond ``bump_rings``.
    """
    scale = LAYERS_PER_LIMIT / max_traversable_vegetation
    cells.layers[:] = 0
    relief = _survey(quarters.sums, bump_rings, scale, cells)
    tops = np.zeros((len(relief.flags), 4))
    layers = cells.layers.reshape(cells.counts.size, LAYERS)
    _examine(quarters, cells.planes.reshape(len(relief.flags), 3), relief, scale, tops, layers)
    return tops


@kernel
def _survey(
    sums: NDArray[np.float64], bump_rings: int, scale: float, cells: CellWorkspace
) -> _Relief:
    """Count quarters without relief in the layer of their mean; return what the others are.

    Args:
        sums: Sums of each quarter.
        bump_rings: Number of rings whose quarters' highest points are found.
        scale: Layers per metre [1/m].
        cells: Counts, means, planes, scatter and ground levels; layers are added to.
    """
    columns, rings = sums.shape[1], cells.counts.shape[1]
    total = sums.shape[0] * columns
    flags, shifts = np.zeros(total, dtype=np.uint8), np.empty(total)
    owners = np.empty(total, dtype=np.int64)
    for i in range(sums.shape[0]):
        for j in range(columns):
            place, n = i * columns + j, sums[i, j, COUNT]
            owners[place] = (i // 2) * rings + j // 2
            if n == 0 or cells.counts[i // 2, j // 2] < MIN_DESCRIBED:
                continue
            if j < 2 * bump_rings and sums[i, j, HIGHEST] - sums[i, j, LOWEST] >= _MIN_RELIEF:
                flags[place] += np.uint8(_FOR_BUMPS)
            plane, mean = cells.planes[i, j], cells.means[i, j]
            rise = plane[GRADIENT_X] * mean[MEAN_X] + plane[GRADIENT_Y] * mean[MEAN_Y]
            shifts[place] = plane[LEVEL] + rise - cells.levels[i, j]
            over = (sums[i, j, Z] / n - cells.levels[i, j]) * scale
            if over + 2 * cells.scatter[i, j] * scale > _FLAT_TOP * LAYERS_PER_LIMIT:
                flags[place] += np.uint8(_FOR_LAYERS)
            else:
                cells.layers[i // 2, j // 2, _layer(over)] += np.int32(n)
    return _Relief(flags, shifts, owners)


@inlined_kernel
def _layer(height: float) -> int:
    """Return the layer of a height over the ground that is counted in layers."""
    return min(max(int(height + LAYERS_BELOW), 0), LAYERS - 1)


@borrowing_kernel
def _examine(
    quarters: Quarters,
    planes: NDArray[np.float64],
    relief: _Relief,
    scale: float,
    tops: NDArray[np.float64],
    layers: NDArray[np.int32],
) -> None:
    """Look at the points of quarters with relief.

    The ground under a point goes through the ground under its quarter, parallel to the plane.

    Args:
        quarters: Points and the quarter of each.
        planes: Plane around each quarter, shape (k, 3).
        relief: Flags, heights of the planes and cells of the quarters.
        scale: Layers per metre [1/m].
        tops: Output; see ``examine_relief``.
        layers: Number of points in each layer of each cell, added to, shape (n_cells, LAYERS).
    """
    bins, flags = quarters.bins, relief.flags
    xs, ys, zs = quarters.columns[0], quarters.columns[1], quarters.columns[2]
    for k in range(len(xs)):
        if bins[k] < 0:
            continue
        place = np.uint64(bins[k])
        flag = flags[place]
        if flag == 0:
            continue
        rise = (
            zs[k]
            - planes[place, GRADIENT_X] * xs[k]
            - planes[place, GRADIENT_Y] * ys[k]
            - planes[place, LEVEL]
        )
        if flag & _FOR_LAYERS:
            height = (rise + relief.shifts[place]) * scale
            layers[np.uint64(relief.cells[place]), _layer(height)] += 1
        if not flag & _FOR_BUMPS:
            continue
        if rise > BUMP_HEIGHT:
            tops[place, N_ABOVE] += 1.0
        # Few points are among the highest of their quarter: the others change nothing.
        if rise > tops[place, THIRD]:
            first, second = tops[place, FIRST], tops[place, SECOND]
            tops[place, FIRST] = max(first, rise)
            tops[place, SECOND] = max(second, min(first, rise))
            tops[place, THIRD] = min(second, rise)
