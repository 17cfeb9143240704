"""Sums of the points in polar quarter cells, from which all features are computed.

Each cell is cut into two sectors by two rings, its quarters. Sums and extents of a quarter are all
that the features need, so the cloud is read twice and never sorted.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.grid import PolarGrid

COUNT, X, Y, Z, XX, YY, ZZ, XY, XZ, YZ, LOWEST, HIGHEST, NEAREST, FURTHEST = range(14)
"""Columns of a quarter's sums: number of points, sums and products of coordinates [m, m2], lowest
and highest z [m], nearest and furthest squared distance [m2]."""

_N_BINS = 4096
"""Bins of squared distance and of pseudo angle in the tables."""

_NO_QUARTER = np.int32(-1)
"""Quarter of a point that belongs to none."""

_MAX_ABS_Z = 1e3
"""Largest magnitude of a height that is a measurement [m]."""

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
        rings: Half ring of each bin of squared distance, ``-1 - first`` where an edge cuts the bin,
            int16, shape (4097,).
        ring_scale: Bins per unit of squared distance [1/m2].
        cosines: Cosines of the bearings of the half sectors' edges, shape (2 n_sectors + 1,).
        sines: Sines of the same bearings, shape (2 n_sectors + 1,).
        sectors: Half sector of each bin of pseudo angle, ``-1 - first`` where an edge cuts the bin,
            int16, shape (4097,).
        middles: Middle of each ring [m], shape (n_rings,).
    """

    squares: NDArray[np.float64]
    rings: NDArray[np.int16]
    ring_scale: float
    cosines: NDArray[np.float64]
    sines: NDArray[np.float64]
    sectors: NDArray[np.int16]
    middles: NDArray[np.float64]


@lru_cache(maxsize=16)
def polar_tables(grid: PolarGrid) -> PolarTables:
    """Return the look-up tables of a grid, computed once per grid."""
    edges = grid.ring_edges
    halves = np.empty(2 * grid.n_rings + 1)
    halves[::2], halves[1::2] = edges, np.sqrt(edges[:-1] * edges[1:])
    squares = halves * halves
    scale = _N_BINS / squares[-1]
    # A bin begins a little early, so that rounding in the kernel cannot put a point before it.
    begins = np.arange(_N_BINS + 1) / scale * (1 - 1e-12)
    rings = _unless_cut(np.maximum(np.searchsorted(squares, begins, side="right") - 1, 0))
    n = 2 * grid.n_sectors
    angles = -np.pi + np.arange(n + 1) * 2 * np.pi / n
    # The inverse of the pseudo angle: a point (x, y) with |x| + |y| = 1 at the begin of each bin.
    pseudo = np.arange(_N_BINS + 1) / _N_BINS * 4 - 2
    y = np.where(np.abs(pseudo) <= 1, pseudo, np.sign(pseudo) * 2 - pseudo)
    x = np.where(np.abs(pseudo) <= 1, 1, -1) * (1 - np.abs(y))
    bearings = np.arctan2(y, x)
    bearings[0] = -np.pi
    sectors = np.clip(np.floor((bearings + np.pi) / (2 * np.pi / n) - 1e-9), 0, n - 1)
    sectors = _unless_cut(sectors.astype(np.int64))
    return PolarTables(
        squares=squares,
        rings=rings.astype(np.int16),
        ring_scale=scale,
        cosines=np.asarray(np.round(np.cos(angles), 15), dtype=np.float64),  # Exact on the axes.
        sines=np.asarray(np.round(np.sin(angles), 15), dtype=np.float64),
        sectors=sectors.astype(np.int16),
        middles=(edges[:-1] + edges[1:]) / 2,
    )


def _unless_cut(begins: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the number at each bin's begin, as ``-1 - number`` where an edge cuts the bin."""
    ends = np.append(begins[1:], -1)
    return np.where(begins == ends, begins, -1 - begins)


class Quarters(NamedTuple):
    """A cloud in quarters, and reusable memory for it: one instance serves all clouds of a robot.

    Attributes:
        bins: Quarter of each point, ``half_sector * 2 n_rings + half_ring``, or -1 for none; int32,
            as long as the longest cloud so far.
        cuts: Greatest height of each cell's points [m], shape (n_sectors, n_rings).
        sums: Columns ``COUNT`` to ``FURTHEST`` of each quarter, shape (2 n_sectors, 2 n_rings, 14).
    """

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
        points: Points in ``base_footprint`` [m], float32, shape (n, 3).
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
    lowest = np.empty_like(memory.cuts)
    _find_quarters(points, tables, memory.bins, lowest)
    if grid.cut == "ground":
        _cut_over_ground(lowest, tables.middles, grid.max_height, memory.cuts)
    else:
        memory.cuts.fill(grid.max_height)
    _add_points(points, memory)
    return memory


@kernel
def _find_quarters(
    points: NDArray[np.float32],
    tables: PolarTables,
    bins: NDArray[np.int32],
    lowest: NDArray[np.float64],
) -> None:
    """Write the quarter of each point, and the lowest z of each cell.

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        tables: Look-up tables of the grid.
        bins: Output, quarter of each point or -1, shape (n,) or longer.
        lowest: Output, lowest z of each cell [m], infinite where it has no points, shape
            (n_sectors, n_rings).
    """
    squares, cosines, sines = tables.squares, tables.cosines, tables.sines
    rings, sectors, ring_scale = tables.rings, tables.sectors, tables.ring_scale
    n_sectors, n_rings = len(cosines) - 1, len(squares) - 1
    nearest, furthest = squares[0], squares[n_rings]
    bin_scale = (len(sectors) - 1) / 4
    lowest[:] = np.inf
    flat = lowest.ravel()
    for k in range(len(points)):
        x, y, z = np.float64(points[k, 0]), np.float64(points[k, 1]), points[k, 2]
        square = x * x + y * y
        # Comparisons with NaN are false, so that one test leaves out all that is no measurement.
        if not (nearest <= square < furthest and -_MAX_ABS_Z < z < _MAX_ABS_Z):
            bins[k] = _NO_QUARTER
            continue
        # Half ring: from the table, and by comparison in the few bins that an edge cuts.
        ring = np.int64(rings[np.uint64(square * ring_scale)])
        if ring < 0:
            ring = -1 - ring
            ring += square >= squares[ring + 1]
        # Half sector, in the same way: a point is past an edge if it lies to the left of its ray.
        share = y / (abs(x) + abs(y))  # Grows with the bearing in each half plane.
        if x < 0:
            share = 2.0 - share if y >= 0 else -2.0 - share
        sector = np.int64(sectors[np.uint64((share + 2.0) * bin_scale)])
        if sector < 0:
            sector = -1 - sector
            after = sector + 1
            sector += after < n_sectors and cosines[after] * y - sines[after] * x >= 0
        bins[k] = sector * n_rings + ring
        # Two half sectors and two half rings make a cell.
        cell = np.uint64((sector >> 1) * (n_rings >> 1) + (ring >> 1))
        if z < flat[cell]:
            flat[cell] = z


@kernel
def _cut_over_ground(
    lowest: NDArray[np.float64],
    middles: NDArray[np.float64],
    max_height: float,
    cuts: NDArray[np.float64],
) -> None:
    """Follow the ground outwards along each sector and write the cuts above it.

    Args:
        lowest: Lowest z of each cell [m], shape (n_sectors, n_rings).
        middles: Middle of each ring [m], shape (n_rings,).
        max_height: Height of the cut above the ground [m].
        cuts: Output, greatest height of each cell's points [m], shape (n_sectors, n_rings).
    """
    for sector in range(lowest.shape[0]):
        ground, last = 0.0, 0.0
        for ring in range(lowest.shape[1]):
            here = lowest[sector, ring]
            # Without a point (infinite) or with a crown alone, the ground known so far goes on.
            if here <= ground + _MAX_RISE + _MAX_RISE_PER_METRE * (middles[ring] - last):
                ground, last = here, middles[ring]
            cuts[sector, ring] = ground + max_height


@kernel
def _add_points(points: NDArray[np.float32], quarters: Quarters) -> None:
    """Add each point below the cut to the sums of its quarter, and mark the others with -1.

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        quarters: Quarter of each point and cut of each cell; ``bins`` and ``sums`` are changed.
    """
    bins, cuts, sums = quarters.bins, quarters.cuts, quarters.sums
    sums[:, :, :LOWEST] = 0.0
    sums[:, :, LOWEST], sums[:, :, HIGHEST] = np.inf, -np.inf
    sums[:, :, NEAREST], sums[:, :, FURTHEST] = np.inf, 0.0
    # The cut of each cell four times, once per quarter: one look-up per point.
    rows = np.repeat(cuts, 2).reshape(cuts.shape[0], -1)
    limits = np.concatenate((rows, rows), axis=1).ravel()
    flat = sums.reshape(-1, sums.shape[2])
    for k in range(len(points)):
        if bins[k] < 0:
            continue
        place = np.uint64(bins[k])
        z = np.float64(points[k, 2])
        if z > limits[place]:
            bins[k] = _NO_QUARTER
            continue
        x, y = np.float64(points[k, 0]), np.float64(points[k, 1])
        square = x * x + y * y
        # First and second moments, of which mean and covariance follow.
        flat[place, COUNT] += 1.0
        flat[place, X] += x
        flat[place, Y] += y
        flat[place, Z] += z
        flat[place, XX] += x * x
        flat[place, YY] += y * y
        flat[place, ZZ] += z * z
        flat[place, XY] += x * y
        flat[place, XZ] += x * z
        flat[place, YZ] += y * z
        # Extents in height and in distance.
        flat[place, LOWEST] = min(flat[place, LOWEST], z)
        flat[place, HIGHEST] = max(flat[place, HIGHEST], z)
        flat[place, NEAREST] = min(flat[place, NEAREST], square)
        flat[place, FURTHEST] = max(flat[place, FURTHEST], square)
