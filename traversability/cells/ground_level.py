"""The local ground under the points of each quarter: a surface that plants and rocks stand on.

Height over a plane through a cell's own points does not show what a field of plants is: the plane
lies in the plants, too. The ground is therefore taken from the low points of all quarters around,
as the lower envelope of cones: a quarter's low point bounds the ground of another one from above
by what ground can rise between the two (assumption; on level ground and on slopes that can be
driven on, the envelope is the ground itself).
"""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel
from traversability.binning import COUNT, LOWEST, XX, XY, XZ, YY, YZ, ZZ, X, Y, Z
from traversability.cells.columns import MIN_DESCRIBED, CellWorkspace
from traversability.cells.quarter_planes import GRADIENT_X, GRADIENT_Y

MAX_GRADE = 0.3
"""Rise over run of the cones. Steeper ground (17 degrees) seems to stand above itself by the rest;
a smaller one would leave the ground under wide plants unknown for longer."""

_LOW_SPREADS = 1.5
"""Standard deviations of a quarter's heights from their mean down to its low point: range noise
puts the lowest of many points far below the ground."""

_MIN_LOW_POINTS = 2
"""Number of points from which on a quarter bounds the ground of others."""


@kernel
def ground_levels(
    sums: NDArray[np.float64], halves: NDArray[np.float64], cells: CellWorkspace
) -> None:
    """Write the scatter of each quarter's points, and the level of the ground under them.

    Args:
        sums: Sums of each quarter; see ``binning.Quarters``.
        halves: Middle of each half ring [m], shape (2 n_rings,).
        cells: Planes around the quarters; ``scatter`` and ``levels`` are written.
    """
    scatter, levels = cells.scatter, cells.levels
    for i in range(sums.shape[0]):
        for j in range(sums.shape[1]):
            scatter[i, j], levels[i, j] = 0.0, np.inf
            if sums[i, j, COUNT] > 0 and cells.counts[i // 2, j // 2] >= MIN_DESCRIBED:
                scatter[i, j] = _scatter(sums[i, j], cells.planes[i, j])
                if sums[i, j, COUNT] >= _MIN_LOW_POINTS:
                    mean = sums[i, j, Z] / sums[i, j, COUNT]
                    levels[i, j] = max(sums[i, j, LOWEST], mean - _LOW_SPREADS * scatter[i, j])
    _lower_envelope(halves, levels)


@inlined_kernel
def _scatter(row: NDArray[np.float64], plane: NDArray[np.float64]) -> float:
    """Return the standard deviation of a quarter's heights along its plane's gradient [m]."""
    n = row[COUNT]
    x, y, z = row[X] / n, row[Y] / n, row[Z] / n
    gx, gy = plane[GRADIENT_X], plane[GRADIENT_Y]
    xz, yz, xy = row[XZ] / n - x * z, row[YZ] / n - y * z, row[XY] / n - x * y
    xx, yy, zz = row[XX] / n - x * x, row[YY] / n - y * y, row[ZZ] / n - z * z
    variance = zz - 2 * (gx * xz + gy * yz) + gx * gx * xx + 2 * gx * gy * xy + gy * gy * yy
    return float(np.sqrt(max(variance, 0.0)))


@kernel
def _lower_envelope(halves: NDArray[np.float64], levels: NDArray[np.float64]) -> None:
    """Lower each level to what the levels around allow.

    Sweeps in both directions along the sectors and around the rings, as a distance transform does
    (Rosenfeld and Pfaltz 1966).

    Args:
        halves: Middle of each half ring [m].
        levels: Low points of the quarters, infinite where unknown; changed in place.
    """
    sectors, rings = levels.shape
    outwards, around = np.empty(rings), np.empty(rings)
    for j in range(rings):
        outwards[j] = MAX_GRADE * (halves[j] - halves[max(j - 1, 0)])
        around[j] = MAX_GRADE * halves[j] * 2 * np.pi / sectors
    for turn in range(2):
        lowered = False
        for i in range(sectors):
            row = levels[i]
            for j in range(1, rings):
                bound = row[j - 1] + outwards[j]
                if bound < row[j]:
                    row[j], lowered = bound, True
            for j in range(rings - 2, -1, -1):
                bound = row[j + 1] + outwards[j + 1]
                if bound < row[j]:
                    row[j], lowered = bound, True
        if turn > 0 and not lowered:
            break
        # Twice around: the first time the sector before the first one is not final.
        for k in range(1, 2 * sectors):
            _lower(levels[k % sectors], levels[(k - 1) % sectors], around)
        for k in range(2 * sectors - 2, -1, -1):
            _lower(levels[k % sectors], levels[(k + 1) % sectors], around)


@inlined_kernel
def _lower(
    row: NDArray[np.float64], beside: NDArray[np.float64], rises: NDArray[np.float64]
) -> None:
    """Lower the levels of a half sector to what the one beside it allows."""
    for j in range(len(row)):
        row[j] = min(row[j], beside[j] + rises[j])
