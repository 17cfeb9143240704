"""Heights of a cell's points over the local ground, and steps between its smooth parts.

Plants, tufts and litter differ in how high their points reach over the ground; a kerb differs from
all of them in that what lies above and below it is smooth. Heights are counted in layers of a third
of the plants' limit, ``PolarGrid.max_traversable_vegetation``, and features are relative to it.
"""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel
from traversability.binning import COUNT, Quarters, X, Y, Z
from traversability.cell_columns import (
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
from traversability.quarter_planes import GRADIENT_X, GRADIENT_Y, LEVEL

_PER_LIMIT = 3
"""Layers up to the plants' limit."""

_BELOW = 2
"""Layers below the ground: noise, and the ground behind an edge."""

_COVERS = (
    (COVER_67, 2),
    (COVER_100, 3),
    (COVER_133, 4),
    (COVER_200, 6),
    (COVER_300, 9),
)
"""Columns of the shares above a height, and that height in layers."""

_FLAT_TOP = 0.4
"""Height over the ground, in limits, under which a quarter's points are not looked at one by one:
its mean and twice its scatter are lower."""

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
    quarters: Quarters, max_traversable_vegetation: float, cells: CellWorkspace
) -> None:
    """Write the features of heights, scatter and smooth steps of each described cell.

    Args:
        quarters: Points, quarter of each point and sums over the quarters.
        max_traversable_vegetation: Height of plants that the robot may cross [m].
        cells: Counts, planes, scatter and ground levels; features are written.
    """
    scale = _PER_LIMIT / max_traversable_vegetation
    cells.layers[:] = 0.0
    looked_at = _count_flat_quarters(quarters.sums, scale, cells)
    _count_points(quarters, looked_at, scale, cells)
    for sector in range(cells.counts.shape[0]):
        for ring in range(cells.counts.shape[1]):
            if cells.counts[sector, ring] >= MIN_DESCRIBED:
                out = cells.values[sector, ring]
                _write_heights(cells.layers[sector, ring], cells.counts[sector, ring], out)
                _write_scatter(quarters.sums, sector, ring, cells, out)
        _follow_ground(quarters.sums, sector, max_traversable_vegetation, cells)


@kernel
def _count_flat_quarters(
    sums: NDArray[np.float64], scale: float, cells: CellWorkspace
) -> NDArray[np.bool_]:
    """Count quarters without relief in the layer of their mean; return which ones have relief.

    Args:
        sums: Sums of each quarter.
        scale: Layers per metre [1/m].
        cells: Layers are added to.

    Returns:
        True for quarters whose points have to be counted one by one, flat over all quarters.
    """
    columns = sums.shape[1]
    found = np.zeros(sums.shape[0] * columns, dtype=np.bool_)
    for i in range(sums.shape[0]):
        for j in range(columns):
            n = sums[i, j, COUNT]
            if n == 0 or cells.counts[i // 2, j // 2] < MIN_DESCRIBED:
                continue
            mean = (sums[i, j, Z] / n - cells.levels[i, j]) * scale
            top = mean + 2 * cells.scatter[i, j] * scale
            if top > _FLAT_TOP * _PER_LIMIT:
                found[i * columns + j] = True
            else:
                cells.layers[i // 2, j // 2, _layer(mean)] += n
    return found


@inlined_kernel
def _layer(height: float) -> int:
    """Return the layer of a height over the ground that is counted in layers."""
    return min(max(int(np.floor(height)) + _BELOW, 0), LAYERS - 1)


@kernel
def _count_points(
    quarters: Quarters, looked_at: NDArray[np.bool_], scale: float, cells: CellWorkspace
) -> None:
    """Count the points of quarters with relief in layers over the ground.

    Args:
        quarters: Points and the quarter of each.
        looked_at: Quarters whose points are counted, shape (k,).
        scale: Layers per metre [1/m].
        cells: Planes and ground levels; layers are added to.
    """
    bins, slopes = quarters.bins, cells.planes.reshape(len(looked_at), 3)
    xs, ys, zs = quarters.columns[0], quarters.columns[1], quarters.columns[2]
    columns, rings = cells.levels.shape[1], cells.counts.shape[1]
    layers = cells.layers.reshape(cells.counts.size, LAYERS)
    # The ground under a point: through the ground under its quarter, parallel to its plane.
    grounds, owners = np.empty(len(looked_at)), np.empty(len(looked_at), dtype=np.int64)
    for quarter in range(len(looked_at)):
        i, j = quarter // columns, quarter % columns
        owners[quarter] = (i // 2) * rings + j // 2
        row = quarters.sums[i, j]
        if looked_at[quarter]:
            x, y = row[X] / row[COUNT], row[Y] / row[COUNT]
            rise = slopes[quarter, GRADIENT_X] * x + slopes[quarter, GRADIENT_Y] * y
            grounds[quarter] = cells.levels[i, j] - rise
    for k in range(len(xs)):
        if bins[k] < 0 or not looked_at[np.uint64(bins[k])]:
            continue
        place = np.uint64(bins[k])
        height = (
            zs[k]
            - slopes[place, GRADIENT_X] * xs[k]
            - slopes[place, GRADIENT_Y] * ys[k]
            - grounds[place]
        )
        layers[owners[place], _layer(height * scale)] += 1.0


@kernel
def _write_heights(layers: NDArray[np.float64], n: int, out: NDArray[np.float32]) -> None:
    """Write shares above heights, and quantiles of the height in limits.

    Args:
        layers: Number of points in each layer of a cell, shape (LAYERS,).
        n: Number of points of the cell.
        out: Output, features of the cell.
    """
    for column, height in _COVERS:
        out[column] = _above(layers, height + _BELOW) / n
    quartile = _quantile(layers, 0.25 * n)
    out[HEIGHT_LOW] = (quartile - _BELOW) / _PER_LIMIT
    out[HEIGHT_MEDIAN] = (_quantile(layers, 0.5 * n) - _BELOW) / _PER_LIMIT
    out[HEIGHT_HIGH] = (_quantile(layers, 0.9 * n) - _BELOW) / _PER_LIMIT
    out[COVER_OVER_QUARTILE] = _above(layers, quartile + _PER_LIMIT) / n


@inlined_kernel
def _above(layers: NDArray[np.float64], height: float) -> float:
    """Return the number of points above a height in layers; within a layer they lie evenly."""
    first = int(height)
    if first >= LAYERS:
        return 0.0
    total = layers[first] * (first + 1 - height)
    for layer in range(first + 1, LAYERS):
        total += layers[layer]
    return total


@inlined_kernel
def _quantile(layers: NDArray[np.float64], rank: float) -> float:
    """Return the height in layers below which ``rank`` points lie."""
    below = 0.0
    for layer in range(LAYERS):
        here = layers[layer]
        if here > 0.0 and below + here >= rank:
            return layer + max(rank - below, 0.0) / here
        below += here
    return float(LAYERS)


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
        cells: Planes and scatter of the quarters.
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
            off = _off_plane(sums[i, j], cells.planes[i, j])
            for di, dj in ((1, 0), (-1, 0), (0, 1), (0, -1)):
                a, b = (i + di) % sectors, j + dj
                if 0 <= b < rings and sums[a, b, COUNT] >= MIN_DESCRIBED:
                    other = _off_plane(sums[a, b], cells.planes[i, j])
                    step = max(step, abs(off - other) - spread - cells.scatter[a, b])
    out[SCATTER], out[SCATTER_LEAST] = np.sqrt(squares / n), least
    out[SMOOTH_STEP] = step


@inlined_kernel
def _off_plane(row: NDArray[np.float64], plane: NDArray[np.float64]) -> float:
    """Return the height of a quarter's mean point over a plane [m]."""
    n = row[COUNT]
    rise = plane[GRADIENT_X] * row[X] / n + plane[GRADIENT_Y] * row[Y] / n
    return float(row[Z] / n - rise - plane[LEVEL])


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
