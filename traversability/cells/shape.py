"""Kernels that turn the sums of a cell's quarters into the cell's own features.

The paper's five features are a principal component analysis of the cell's points. The others
describe the ground on the scale of a wheelbase: planes around each quarter, gaps along the beams,
and bumps over those planes (assumption). ``features.OWN_FEATURES`` names the columns.
"""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.binning import COUNT, HIGHEST, LOWEST, XX, XY, XZ, YY, YZ, ZZ, Quarters, X, Y, Z
from traversability.cells.beam_profile import beam_gaps, compare_with_ring, profile
from traversability.cells.bumps import rings_with_bumps, write_bumps
from traversability.cells.columns import (
    HEIGHT_DIFFERENCE,
    MAX_SLOPE,
    MEAN_ABOVE_LOWEST,
    MIN_DESCRIBED,
    MIN_HEIGHT,
    ORIENTATION,
    PLANARITY,
    QUARTER_HEIGHT,
    ROUGHNESS,
    TILT,
    CellWorkspace,
)
from traversability.cells.covariance import Covariance, eigenvalues, gradient, normal_z_squared
from traversability.cells.ground_level import ground_levels
from traversability.cells.heights import describe_heights
from traversability.cells.quarter_planes import ground_shape, mean_points
from traversability.cells.relief import examine_relief

_CELL_NOISE = 1e-3
"""Spread of points along a beam by range noise alone, squared [m2]."""


@kernel
def describe_cells(
    quarters: Quarters,
    middles: NDArray[np.float64],
    halves: NDArray[np.float64],
    max_traversable_vegetation: float,
    cells: CellWorkspace,
) -> None:
    """Write the number of points and the own features of each cell.

    Args:
        quarters: Points, quarter of each point and sums over the quarters.
        middles: Middle of each ring [m], shape (n_rings,).
        halves: Middle of each half ring [m], shape (2 n_rings,).
        max_traversable_vegetation: Height of plants that the robot may cross [m].
        cells: Buffers that are filled.
    """
    sums, counts = quarters.sums, cells.counts
    _count_points(sums, counts)
    mean_points(sums, cells.means)
    for sector in range(counts.shape[0]):
        for ring in range(counts.shape[1]):
            if counts[sector, ring] >= MIN_DESCRIBED:
                out = cells.values[sector, ring]
                _principal_axes(sums, sector, ring, out)
                ground_shape(sums, cells.means, cells.planes, sector, ring, middles, out)
                beam_gaps(sums, sector, ring, middles, out)
                profile(sums, counts, sector, ring, middles, out)
    # These compare cells with each other, so all of them have to be described before.
    compare_with_ring(counts, cells.values)
    ground_levels(sums, halves, cells)
    rings = rings_with_bumps(middles)
    write_bumps(examine_relief(quarters, rings, max_traversable_vegetation, cells), rings, cells)
    describe_heights(sums, max_traversable_vegetation, cells)


@kernel
def _count_points(sums: NDArray[np.float64], counts: NDArray[np.int32]) -> None:
    """Write the number of points of each cell."""
    for sector in range(counts.shape[0]):
        for ring in range(counts.shape[1]):
            total = 0.0
            for a in range(2):
                for b in range(2):
                    total += sums[2 * sector + a, 2 * ring + b, COUNT]
            counts[sector, ring] = np.int32(total)


@kernel
def _principal_axes(
    sums: NDArray[np.float64], sector: int, ring: int, out: NDArray[np.float32]
) -> None:
    """Write the paper's five features, and what comes from the same sums."""
    # The cell's moments are the sums of its four quarters'.
    n = x = y = mean = xx = yy = zz = xy = xz = yz = 0.0
    lowest, highest, quarter_height = np.inf, -np.inf, 0.0
    for a in range(2):
        for b in range(2):
            i, j = 2 * sector + a, 2 * ring + b
            n, x, y = n + sums[i, j, COUNT], x + sums[i, j, X], y + sums[i, j, Y]
            mean = mean + sums[i, j, Z]
            xx, yy, zz = xx + sums[i, j, XX], yy + sums[i, j, YY], zz + sums[i, j, ZZ]
            xy, xz, yz = xy + sums[i, j, XY], xz + sums[i, j, XZ], yz + sums[i, j, YZ]
            if sums[i, j, COUNT] > 0:
                low, high = sums[i, j, LOWEST], sums[i, j, HIGHEST]
                lowest, highest = min(lowest, low), max(highest, high)
                quarter_height = max(quarter_height, high - low)
    # Covariance of the cell's points: E[ab] - E[a] E[b].
    x, y, mean = x / n, y / n, mean / n
    xx, yy, zz = xx / n - x * x, yy / n - y * y, zz / n - mean * mean
    xy, xz, yz = xy / n - x * y, xz / n - x * mean, yz / n - y * mean
    covariance = Covariance(xx, yy, zz, xy, xz, yz)
    axes = eigenvalues(covariance)
    # The paper's five (section 3.3 names them; ``features.cell_features`` has the formulas).
    out[ROUGHNESS] = np.sqrt(axes.l3)
    out[ORIENTATION] = np.sqrt(normal_z_squared(covariance, axes))
    out[PLANARITY] = (axes.l2 - axes.l3) / axes.l1 if axes.l1 > 0 else 0.0
    out[MIN_HEIGHT], out[HEIGHT_DIFFERENCE] = lowest, highest - lowest
    # Ours, from the same sums.
    out[MEAN_ABOVE_LOWEST], out[QUARTER_HEIGHT] = mean - lowest, quarter_height
    slope_x, slope_y = gradient(xx, yy, xy, xz, yz, _CELL_NOISE)
    out[TILT] = min(np.sqrt(slope_x * slope_x + slope_y * slope_y), MAX_SLOPE)
