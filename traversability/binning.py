"""Sums of the points in polar quarter cells, from which all features are computed.

Each cell is cut into two sectors by two rings, its quarters. Sums and extents of a quarter are all
that the features need, so the cloud is never sorted.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import borrowing_kernel, kernel
from traversability.grid import PolarGrid

COUNT, X, Y, Z, XX, YY, ZZ, XY, XZ, YZ, LOWEST, HIGHEST, NEAREST, FURTHEST = range(14)
"""Columns of a quarter's sums: number of points, sums and products of coordinates [m, m2], lowest
and highest z [m], nearest and furthest squared distance [m2]."""

_N_BINS = 4096
"""Bins of pseudo angle in the tables, and least number of bins of squared distance."""

_NO_QUARTER = np.int32(-1)
"""Quarter of a point that belongs to none."""

_MAX_ABS_Z = 1e3
"""Largest magnitude of a height that is a measurement [m]."""

_BLOCK = 512
"""Number of points at a time: what is known of them stays in the fastest cache from step to step,
and each step is simple enough for the compiler to pack."""

# The ground may rise by this much from ring to ring, plus this much a metre, and still be the
# ground: steeper than what is passable, so that banks are seen whole, and lower than a crown.
_MAX_RISE = 0.3
_MAX_RISE_PER_METRE = 0.75


class PolarTables(NamedTuple):
    """Look-up tables that give a point's quarter without a square root or an arc tangent.

    The pseudo angle of (x, y) is ``y / (|x| + |y|)`` continued over the left half plane: it grows
    with the bearing, from -2 to 2, and costs one division.

    Attributes:
        squares: Squared edges of the half rings [m2], shape (2 n_rings + 1,).
        rings: Half ring at the begin of each bin of squared distance; at most one edge cuts a bin.
            int16, shape (b + 1,), b at least 4096.
        ring_scale: Bins per unit of squared distance [1/m2].
        cosines: Cosines of the bearings of the half sectors' edges, shape (2 n_sectors + 1,).
        sines: Sines of the same bearings, shape (2 n_sectors + 1,).
        sectors: Half sector at the begin of each bin of pseudo angle; at most one edge cuts a bin.
            int16, shape (4097,).
        middles: Middle of each ring [m], shape (n_rings,).
        halves: Middle of each half ring [m], shape (2 n_rings,).
    """

    squares: NDArray[np.float64]
    rings: NDArray[np.int16]
    ring_scale: float
    cosines: NDArray[np.float64]
    sines: NDArray[np.float64]
    sectors: NDArray[np.int16]
    middles: NDArray[np.float64]
    halves: NDArray[np.float64]


@lru_cache(maxsize=16)
def polar_tables(grid: PolarGrid) -> PolarTables:
    """Return the look-up tables of a grid, computed once per grid."""
    edges = grid.ring_edges
    halves = np.empty(2 * grid.n_rings + 1)
    halves[::2], halves[1::2] = edges, np.sqrt(edges[:-1] * edges[1:])
    squares = halves * halves
    # Rings grow outwards: the inmost of many, or of far-reaching ones, is narrower than most bins.
    bins = max(_N_BINS, int(np.ceil(squares[-1] / np.diff(squares).min())) + 1)
    scale = bins / squares[-1]
    # A bin begins a little early, so that rounding in the kernel cannot put a point before it.
    begins = np.arange(bins + 1) / scale * (1 - 1e-12)
    rings = np.maximum(np.searchsorted(squares, begins, side="right") - 1, 0)
    n = 2 * grid.n_sectors
    angles = -np.pi + np.arange(n + 1) * 2 * np.pi / n
    # The inverse of the pseudo angle: a point (x, y) with |x| + |y| = 1 at the begin of each bin.
    pseudo = np.arange(_N_BINS + 1) / _N_BINS * 4 - 2
    y = np.where(np.abs(pseudo) <= 1, pseudo, np.sign(pseudo) * 2 - pseudo)
    x = np.where(np.abs(pseudo) <= 1, 1, -1) * (1 - np.abs(y))
    bearings = np.arctan2(y, x)
    bearings[0] = -np.pi
    sectors = np.clip(np.floor((bearings + np.pi) / (2 * np.pi / n) - 1e-9), 0, n - 1)
    return PolarTables(
        squares=squares,
        rings=rings.astype(np.int16),
        ring_scale=scale,
        cosines=np.asarray(np.round(np.cos(angles), 15), dtype=np.float64),  # Exact on the axes.
        sines=np.asarray(np.round(np.sin(angles), 15), dtype=np.float64),
        sectors=sectors.astype(np.int16),
        middles=(edges[:-1] + edges[1:]) / 2,
        halves=(halves[:-1] + halves[1:]) / 2,
    )


class Quarters(NamedTuple):
    """A cloud in quarters, and reusable memory for it: one instance serves all clouds of a robot.

    Attributes:
        columns: x, y and z of the points in ``base_footprint`` [m], float32, shape (3, n).
        bins: Quarter of each point, ``half_sector * 2 n_rings + half_ring``, or -1 for none; int32,
            as long as the longest cloud so far.
        cuts: Greatest height of each cell's points [m], shape (n_sectors, n_rings).
        sums: Columns ``COUNT`` to ``FURTHEST`` of each quarter, shape (2 n_sectors, 2 n_rings, 14).
    """

    columns: NDArray[np.float32]
    bins: NDArray[np.int32]
    cuts: NDArray[np.float64]
    sums: NDArray[np.float64]


@lru_cache(maxsize=16)
def cells_of_quarters(grid: PolarGrid) -> NDArray[np.int64]:
    """Return the cell of each quarter, ``sector * n_rings + ring``, shape (4 n_cells,).

    Args:
        grid: Polar grid whose cells are cut into quarters.
    """
    sectors, rings = np.divmod(np.arange(4 * grid.n_sectors * grid.n_rings), 2 * grid.n_rings)
    cells = sectors // 2 * grid.n_rings + rings // 2
    cells.setflags(write=False)
    return cells


def make_quarters(grid: PolarGrid, capacity: int = 0) -> Quarters:
    """Return memory for clouds of up to ``capacity`` points.

    Args:
        grid: Polar grid whose cells are cut into quarters.
        capacity: Number of points of the longest cloud.
    """
    return Quarters(
        columns=np.empty((3, 0), dtype=np.float32),
        bins=np.empty(capacity, dtype=np.int32),
        cuts=np.empty((grid.n_sectors, grid.n_rings)),
        sums=np.empty((2 * grid.n_sectors, 2 * grid.n_rings, 14)),
    )


def fill_quarters(
    points: NDArray[np.float32], grid: PolarGrid, memory: Quarters | None = None
) -> Quarters:
    """Return a cloud in quarters.

    Points that are not finite, beyond the rings or above the cut are left out. The cut is
    ``max_height`` above the base plane or, with ``grid.cut`` "ground", above the ground of the
    cell's place: its lowest point, where that is not too high to be ground (assumption).

    Args:
        points: Points in ``base_footprint`` [m], float32, shape (n, 3). They are copied unless all
            x lie together in memory, then all y, then all z.
        grid: Polar grid of cells.
        memory: Quarters to write into; new ones are made if None or too short.

    Raises:
        ValueError: If ``points`` has another shape or type.
    """
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype != np.float32:
        raise ValueError(
            f"points: expected float32 of shape (n, 3), got {points.dtype} {points.shape}"
        )
    if memory is None or len(memory.bins) < len(points):
        memory = make_quarters(grid, len(points))
    tables = polar_tables(grid)
    quarters = memory._replace(columns=np.ascontiguousarray(points.T))
    _add_points(quarters, tables)
    if grid.cut == "ground":
        _cut_over_ground(quarters.sums, tables.middles, grid.max_height, quarters.cuts)
    else:
        quarters.cuts.fill(grid.max_height)
    _leave_out_high_points(quarters)
    return quarters


@kernel
def _add_points(quarters: Quarters, tables: PolarTables) -> None:
    """Find the quarter of each point, whatever its height over the ground, and sum up quarters.

    Args:
        quarters: Points; ``bins`` and ``sums`` are written.
        tables: Look-up tables of the grid.
    """
    columns, sums = quarters.columns, quarters.sums
    for i in range(sums.shape[0]):
        for j in range(sums.shape[1]):
            _empty(sums[i, j])
    rows = sums.reshape(-1, sums.shape[2])
    rings, sectors = np.empty(_BLOCK, dtype=np.int32), np.empty(_BLOCK, dtype=np.int32)
    n = columns.shape[1]
    for first in range(0, n, _BLOCK):
        last = min(first + _BLOCK, n)
        # A row at a time: only of those does the compiler know that they are without gaps.
        x, y, z = columns[0][first:last], columns[1][first:last], columns[2][first:last]
        bins = quarters.bins[first:last]
        _find_table_bins(x, y, z, tables, rings, sectors)
        _look_up_quarters(x, y, tables, rings, sectors, bins)
        for k in range(last - first):
            if bins[k] >= 0:
                _add(rows[np.uint64(bins[k])], x[k], y[k], z[k])


@borrowing_kernel
def _find_table_bins(
    xs: NDArray[np.float32],
    ys: NDArray[np.float32],
    zs: NDArray[np.float32],
    tables: PolarTables,
    rings: NDArray[np.int32],
    sectors: NDArray[np.int32],
) -> None:
    """Write the bins of squared distance and of pseudo angle in which points lie.

    Args:
        xs: x of the points [m], shape (m,).
        ys: y of the points [m], shape (m,).
        zs: z of the points [m], shape (m,).
        tables: Look-up tables of the grid.
        rings: Output, bin of squared distance, -1 for what is no point of the grid, shape (m,) or
            longer.
        sectors: Output, bin of pseudo angle, shape (m,) or longer.
    """
    nearest, furthest = tables.squares[0], tables.squares[len(tables.squares) - 1]
    ring_scale, sector_scale = tables.ring_scale, (len(tables.sectors) - 1) / 4
    for k in range(len(xs)):
        x, y = np.float64(xs[k]), np.float64(ys[k])
        square = x * x + y * y
        # Comparisons with NaN are false, so that one test leaves out all that is no measurement.
        inside = (nearest <= square) & (square < furthest) & (abs(zs[k]) < np.float32(_MAX_ABS_Z))
        rings[k] = np.int32(square * ring_scale if inside else -1.0)
        share = y / (abs(x) + abs(y))  # Grows with the bearing in each half plane.
        behind = (2.0 if y >= 0 else -2.0) - share
        share = behind if x < 0 else share
        sectors[k] = np.int32((share + 2.0) * sector_scale if inside else 0.0)


@borrowing_kernel
def _look_up_quarters(
    xs: NDArray[np.float32],
    ys: NDArray[np.float32],
    tables: PolarTables,
    rings: NDArray[np.int32],
    sectors: NDArray[np.int32],
    bins: NDArray[np.int32],
) -> None:
    """Write the quarters of points whose bins in the tables are known.

    Args:
        xs: x of the points [m], shape (m,).
        ys: y of the points [m], shape (m,).
        tables: Look-up tables of the grid.
        rings: Bin of squared distance, -1 for what is no point of the grid, shape (m,) or longer.
        sectors: Bin of pseudo angle, shape (m,) or longer.
        bins: Output, quarter of each point or -1, shape (m,).
    """
    squares, cosines, sines = tables.squares, tables.cosines, tables.sines
    n_rings, last_sector = len(squares) - 1, np.int64(len(cosines) - 2)
    for k in range(len(bins)):
        if rings[k] < 0:
            bins[k] = _NO_QUARTER
            continue
        x, y = np.float64(xs[k]), np.float64(ys[k])
        # The table knows the half ring and the half sector at the begin of a bin; a comparison
        # tells whether the point lies beyond the edge that follows, which few bins have.
        ring = np.int64(tables.rings[np.uint64(rings[k])])
        ring += np.int64(x * x + y * y >= squares[np.uint64(ring + 1)])
        # A point is past the edge of a sector if it lies to the left of its ray.
        sector = np.int64(tables.sectors[np.uint64(sectors[k])])
        after = np.uint64(sector + 1)
        sector += np.int64(cosines[after] * y - sines[after] * x >= 0)
        # Nothing lies beyond the last edge.
        sector = sector if sector < last_sector else last_sector
        bins[k] = sector * n_rings + ring


@borrowing_kernel
def _empty(row: NDArray[np.float64]) -> None:
    """Write the sums of no points to the columns of a quarter, shape (14,)."""
    row[:LOWEST] = 0.0
    row[LOWEST], row[HIGHEST], row[NEAREST], row[FURTHEST] = np.inf, -np.inf, np.inf, 0.0


@borrowing_kernel
def _add(row: NDArray[np.float64], px: float, py: float, pz: float) -> None:
    """Add a point [m] to the columns of its quarter, shape (14,)."""
    x, y, z = np.float64(px), np.float64(py), np.float64(pz)
    square = x * x + y * y
    # First and second moments, of which mean and covariance follow.
    row[COUNT] += 1.0
    row[X] += x
    row[Y] += y
    row[Z] += z
    row[XX] += x * x
    row[YY] += y * y
    row[ZZ] += z * z
    row[XY] += x * y
    row[XZ] += x * z
    row[YZ] += y * z
    # Extents in height and in distance.
    row[LOWEST] = min(row[LOWEST], z)
    row[HIGHEST] = max(row[HIGHEST], z)
    row[NEAREST] = min(row[NEAREST], square)
    row[FURTHEST] = max(row[FURTHEST], square)


@kernel
def _cut_over_ground(
    sums: NDArray[np.float64],
    middles: NDArray[np.float64],
    max_height: float,
    cuts: NDArray[np.float64],
) -> None:
    """Follow the ground outwards along each sector and write the cuts above it.

    Args:
        sums: Sums of each quarter over all points; see ``Quarters``.
        middles: Middle of each ring [m], shape (n_rings,).
        max_height: Height of the cut above the ground [m].
        cuts: Output, greatest height of each cell's points [m], shape (n_sectors, n_rings).
    """
    for sector in range(cuts.shape[0]):
        ground, last = 0.0, 0.0
        for ring in range(cuts.shape[1]):
            here = np.inf
            for i in range(2 * sector, 2 * sector + 2):
                here = min(here, sums[i, 2 * ring, LOWEST], sums[i, 2 * ring + 1, LOWEST])
            # Without a point (infinite) or with a crown alone, the ground known so far goes on.
            if here <= ground + _MAX_RISE + _MAX_RISE_PER_METRE * (middles[ring] - last):
                ground, last = here, middles[ring]
            cuts[sector, ring] = ground + max_height


@kernel
def _leave_out_high_points(quarters: Quarters) -> None:
    """Mark points above their cell's cut with -1, and sum up the quarters that have some anew.

    Args:
        quarters: Quarters with all points, and cuts; ``bins`` and ``sums`` are changed.
    """
    bins, cuts, sums = quarters.bins, quarters.cuts, quarters.sums
    rows = sums.reshape(-1, sums.shape[2])
    limits = np.full(len(rows), np.inf)
    for i in range(sums.shape[0]):
        for j in range(sums.shape[1]):
            cut = cuts[i // 2, j // 2]
            if sums[i, j, HIGHEST] > cut:
                limits[i * sums.shape[1] + j] = cut
                _empty(sums[i, j])
    xs, ys, zs = quarters.columns[0], quarters.columns[1], quarters.columns[2]
    for k in range(len(xs)):
        if bins[k] < 0:
            continue
        place = np.uint64(bins[k])
        if zs[k] > limits[place]:
            bins[k] = _NO_QUARTER
        elif limits[place] < np.inf:
            _add(rows[place], xs[k], ys[k], zs[k])
