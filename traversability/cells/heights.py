"""Heights of a cell's points over the local ground, and steps between its smooth parts.

Plants, tufts and litter differ in how high their points reach over the ground; a kerb differs from
all of them in that what lies above and below it is smooth. Heights are counted in layers of a third
of the plants' limit, ``PolarGrid.max_traversable_vegetation``, and features are relative to it.
"""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel
from traversability.binning import COUNT, X, Y, Z
from traversability.cells.columns import (
    COVER_67,
    COVER_100,
    COVER_133,
    COVER_200,
    COVER_300,
    COVER_OVER_QUARTILE,
    HEIGHT_HIGH,
    HEIGHT_LOW,
    HEIGHT_MEDIAN,
    LAYERS,
    LOW_OVER_WAY,
    MEAN_OVER_WAY,
    MIN_DESCRIBED,
    SCATTER,
    SCATTER_LEAST,
    SMOOTH_STEP,
    CellWorkspace,
)
from traversability.cells.quarter_planes import (
    GRADIENT_X,
    GRADIENT_Y,
    LEVEL,
    MEAN_X,
    MEAN_Y,
    MEAN_Z,
)
from traversability.cells.relief import LAYERS_BELOW, LAYERS_PER_LIMIT

_COVERS = (
    (COVER_67, 2),
    (COVER_100, 3),
    (COVER_133, 4),
    (COVER_200, 6),
    (COVER_300, 9),
)
"""Columns of the shares above a height, and that height in layers."""

_TURN = 0.12
"""Change of slope from ring to ring that is still ground [rise over run]."""

_RISE = 0.05
"""Height over the extrapolated ground that is still ground [m]."""

_SMOOTH = 0.3
"""Largest scatter of a cell whose rise is the ground's, in limits; plants of the limit's height
have as much, and a rise of rougher cells may be that of plants."""

_ROUGH_RISE = 0.03
"""Height over the extrapolated ground up to which a rough cell is ground [m]."""

_MAX_WAY_SLOPE = 0.36
"""Steepest slope that the ground is extrapolated with: 20 degrees."""


@kernel
def describe_heights(
    sums: NDArray[np.float64], max_traversable_vegetation: float, cells: CellWorkspace
) -> None:
    """Write the features of heights, scatter and smooth steps of each described cell.

    Args:
        sums: Sums of each quarter; see ``binning.Quarters``.
        max_traversable_vegetation: Height of plants that the robot may cross [m].
        cells: Counts, means, planes, scatter, ground levels and layers; features are written.
    """
    for sector in range(cells.counts.shape[0]):
        for ring in range(cells.counts.shape[1]):
            if cells.counts[sector, ring] >= MIN_DESCRIBED:
                out = cells.values[sector, ring]
                _write_heights(cells.layers[sector, ring], cells.counts[sector, ring], out)
                _write_scatter(sums, sector, ring, cells, out)
        _follow_ground(sums, sector, max_traversable_vegetation, cells)


@kernel
def _write_heights(layers: NDArray[np.int32], n: int, out: NDArray[np.float32]) -> None:
    """Write shares above heights, and quantiles of the height in limits.

    Args:
        layers: Number of points in each layer of a cell, shape (LAYERS,).
        n: Number of points of the cell.
        out: Output, features of the cell.
    """
    # Most cells are flat: what lies above their highest layer need not be looked at.
    end = LAYERS
    while end > 0 and layers[end - 1] == 0:
        end -= 1
    layers = layers[:end]
    for column, height in _COVERS:
        out[column] = _above(layers, height + LAYERS_BELOW) / n
    quartile = _quantile(layers, 0.25 * n)
    out[HEIGHT_LOW] = _in_limits(quartile)
    out[HEIGHT_MEDIAN] = _in_limits(_quantile(layers, 0.5 * n))
    out[HEIGHT_HIGH] = _in_limits(_quantile(layers, 0.9 * n))
    out[COVER_OVER_QUARTILE] = _above(layers, quartile + LAYERS_PER_LIMIT) / n


@inlined_kernel
def _in_limits(height: float) -> float:
    """Return a height over the lowest layer, in layers, as one over the ground, in limits."""
    return (height - LAYERS_BELOW) / LAYERS_PER_LIMIT


@inlined_kernel
def _above(layers: NDArray[np.int32], height: float) -> float:
    """Return the number of points above a height in layers; within a layer they lie evenly."""
    first = int(height)
    if first >= len(layers):
        return 0.0
    total = layers[first] * (first + 1 - height)
    for layer in range(first + 1, len(layers)):
        total += layers[layer]
    return total


@inlined_kernel
def _quantile(layers: NDArray[np.int32], rank: float) -> float:
    """Return the height in layers below which ``rank`` points lie."""
    below = 0.0
    for layer in range(len(layers)):
        here = layers[layer]
        if here > 0 and below + here >= rank:
            return layer + max(rank - below, 0.0) / here
        below += here
    return float(len(layers))


@kernel
def _write_scatter(
    sums: NDArray[np.float64],
    sector: int,
    ring: int,
    cells: CellWorkspace,
    out: NDArray[np.float32],
) -> None:
    """Write the scatter about the planes of a cell's quarters, and steps between smooth ones.

    A step is the distance of two neighbouring quarters' means, seen along a plane through both,
    less the scatter of each: what blades or litter make up is no step.

    Args:
        sums: Sums of each quarter.
        sector: Sector of the cell.
        ring: Ring of the cell.
        cells: Means, planes and scatter of the quarters.
        out: Output, features of the cell.
    """
    sectors, rings = sums.shape[0], sums.shape[1]
    n, squares, least, step = 0.0, 0.0, np.inf, 0.0
    for i in range(2 * sector, 2 * sector + 2):
        for j in range(2 * ring, 2 * ring + 2):
            here, spread = sums[i, j, COUNT], cells.scatter[i, j]
            if here == 0:
                continue
            n, squares = n + here, squares + here * spread * spread
            least = min(least, spread)
            plane = cells.planes[i, j]
            off = _off_plane(cells.means[i, j], plane)
            left, right = (i + 1 if i + 1 < sectors else 0), (i - 1 if i > 0 else sectors - 1)
            for a, b in ((left, j), (right, j), (i, j + 1), (i, j - 1)):
                if 0 <= b < rings and sums[a, b, COUNT] >= MIN_DESCRIBED:
                    other = _off_plane(cells.means[a, b], plane)
                    step = max(step, abs(off - other) - spread - cells.scatter[a, b])
    out[SCATTER], out[SCATTER_LEAST] = np.sqrt(squares / n), least
    out[SMOOTH_STEP] = step


@inlined_kernel
def _off_plane(mean: NDArray[np.float64], plane: NDArray[np.float64]) -> float:
    """Return the height of a quarter's mean point over a plane [m]."""
    rise = plane[GRADIENT_X] * mean[MEAN_X] + plane[GRADIENT_Y] * mean[MEAN_Y]
    return float(mean[MEAN_Z] - rise - plane[LEVEL])


@kernel
def _follow_ground(
    sums: NDArray[np.float64], sector: int, max_traversable_vegetation: float, cells: CellWorkspace
) -> None:
    """Write how far a sector's cells lie over the ground that is extrapolated from before them.

    The ground begins under the robot. A smooth cell whose low points fit to the slope so far, or to
    one that bends gradually, is ground, and the slope follows it; above others the slope goes on.

    Args:
        sums: Sums of each quarter.
        sector: Sector whose cells are followed outwards.
        max_traversable_vegetation: Height of plants that the robot may cross [m].
        cells: Counts and ground levels; features are written.
    """
    ground, at, slope = 0.0, 0.0, 0.0
    for ring in range(cells.counts.shape[1]):
        if cells.counts[sector, ring] < MIN_DESCRIBED:
            continue
        n = x = y = z = low = 0.0
        for i in range(2 * sector, 2 * sector + 2):
            for j in range(2 * ring, 2 * ring + 2):
                here = sums[i, j, COUNT]
                if here > 0:
                    n, x, y = n + here, x + sums[i, j, X], y + sums[i, j, Y]
                    z, low = z + sums[i, j, Z], low + here * cells.levels[i, j]
        distance, low = np.sqrt(x * x + y * y) / n, low / n
        run = max(distance - at, 0.1)
        expected = ground + slope * run
        out = cells.values[sector, ring]
        out[MEAN_OVER_WAY] = min(max(z / n - expected, -2.0), 2.0)
        out[LOW_OVER_WAY] = min(max(low - expected, -2.0), 2.0)
        smooth = out[SCATTER] <= _SMOOTH * max_traversable_vegetation
        if low - expected <= (_RISE + _TURN * run if smooth else _ROUGH_RISE):
            steep = 0.5 * slope + 0.5 * (low - ground) / run
            slope = min(max(steep, -_MAX_WAY_SLOPE), _MAX_WAY_SLOPE)
            ground, at = low, distance
