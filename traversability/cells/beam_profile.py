"""Gaps and rises along the beams, before and behind a cell, and those of its ring."""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel
from traversability.binning import COUNT, FURTHEST, NEAREST, X, Y, Z
from traversability.cells.columns import (
    BEND,
    DEPTH,
    DISTANCE,
    GAP_AFTER,
    GAP_AFTER_MEAN,
    GAP_BEFORE,
    MAX_SLOPE,
    MIN_DESCRIBED,
    RISE_AFTER,
    RISE_BEFORE,
    SEEN_BEYOND,
    SPACING,
)

_MIN_RUN = 0.02
"""Shortest distance between the mean points of two cells that a rise is divided by [m]."""


@kernel
def beam_gaps(
    sums: NDArray[np.float64],
    sector: int,
    ring: int,
    middles: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    """Write the gaps that beams leave behind and before a cell, and how deep its points reach.

    A gap is the stretch without points over the distance at which it begins. A beam that grazes an
    edge lands behind it after such a gap, so it grows with the drop (similar triangles).

    Args:
        sums: Sums of each quarter; see ``binning.Quarters``.
        sector: Sector of the cell.
        ring: Ring of the cell.
        middles: Middle of each ring [m], shape (n_rings,).
        out: Output, features of the cell.
    """
    rings = sums.shape[1]
    columns = 0
    low, high = np.inf, 0.0
    after_max = after_sum = before_sum = 0.0
    for a in range(2):
        i = 2 * sector + a
        near, far = 2 * ring, 2 * ring + 1
        furthest = np.sqrt(max(sums[i, near, FURTHEST], sums[i, far, FURTHEST]))
        if furthest == 0.0:
            continue
        nearest = np.sqrt(min(sums[i, near, NEAREST], sums[i, far, NEAREST]))
        # Behind: to the next point outwards, or within the cell where that gap is larger.
        k = far + 1
        while k < rings and sums[i, k, COUNT] == 0:
            k += 1
        after = MAX_SLOPE if k == rings else (np.sqrt(sums[i, k, NEAREST]) - furthest) / furthest
        if sums[i, near, COUNT] > 0 and sums[i, far, COUNT] > 0:
            inside = np.sqrt(sums[i, far, NEAREST]) - np.sqrt(sums[i, near, FURTHEST])
            after = max(after, inside / furthest)
        # Before: from the last point inwards, or from the middle of the first ring.
        k = near - 1
        while k >= 0 and sums[i, k, COUNT] == 0:
            k -= 1
        begin = middles[0] if k < 0 else np.sqrt(sums[i, k, FURTHEST])
        columns += 1
        low, high = min(low, nearest), max(high, furthest)
        after_max, after_sum = max(after_max, after), after_sum + after
        before_sum += max(nearest - begin, 0.0) / nearest
    out[GAP_AFTER], out[GAP_AFTER_MEAN] = after_max, after_sum / columns
    out[GAP_BEFORE] = before_sum / columns
    out[DEPTH] = high - low


@kernel
def profile(
    sums: NDArray[np.float64],
    counts: NDArray[np.int32],
    sector: int,
    ring: int,
    middles: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    """Write the rises from and to the neighbours along the sector, the bend there, the distance.

    Args:
        sums: Sums of each quarter; see ``binning.Quarters``.
        counts: Number of points of each cell, shape (n_sectors, n_rings).
        sector: Sector of the cell.
        ring: Ring of the cell.
        middles: Middle of each ring [m], shape (n_rings,).
        out: Output, features of the cell.
    """
    out[BEND] = out[RISE_BEFORE] = out[RISE_AFTER] = 0.0
    out[DISTANCE] = middles[ring]
    r0, z0 = _mean_point(sums, sector, ring)
    # Rise from the last described cell before, and how far it departs from the slope up to there.
    before = ring - 1
    while before >= 0 and counts[sector, before] < MIN_DESCRIBED:
        before -= 1
    if before >= 0:
        r1, z1 = _mean_point(sums, sector, before)
        rise = (z0 - z1) / max(r0 - r1, _MIN_RUN)
        out[RISE_BEFORE] = min(max(rise, -MAX_SLOPE), MAX_SLOPE)
        if before > 0 and counts[sector, before - 1] >= MIN_DESCRIBED:
            r2, z2 = _mean_point(sums, sector, before - 1)
            slope = min(max((z1 - z2) / max(r1 - r2, _MIN_RUN), -1.0), 1.0)
            out[BEND] = z0 - z1 - slope * (r0 - r1)
    # Rise to the next described cell behind.
    behind = ring + 1
    while behind < counts.shape[1] and counts[sector, behind] < MIN_DESCRIBED:
        behind += 1
    if behind < counts.shape[1]:
        r1, z1 = _mean_point(sums, sector, behind)
        rise = (z1 - z0) / max(r1 - r0, _MIN_RUN)
        out[RISE_AFTER] = min(max(rise, -MAX_SLOPE), MAX_SLOPE)


@kernel
def compare_with_ring(counts: NDArray[np.int32], values: NDArray[np.float32]) -> None:
    """Subtract each ring's median gaps from those of its cells, and write the ring's own features.

    How far apart the beams of a laser meet level ground depends on the laser and grows outwards;
    all sectors show it alike. A drop shows in some.

    Args:
        counts: Number of points of each cell, shape (n_sectors, n_rings).
        values: Features of each cell, changed in place, shape (n_sectors, n_rings, f).
    """
    sectors, rings = counts.shape
    beyond = np.zeros(sectors, dtype=np.bool_)
    here, gaps = np.empty(sectors, dtype=np.int64), np.empty(sectors)
    for ring in range(rings - 1, -1, -1):  # Inwards: what is seen beyond is known by then.
        n = 0
        for sector in range(sectors):
            if counts[sector, ring] >= MIN_DESCRIBED:
                here[n] = sector
                n += 1
        if n == 0:
            continue
        seen_beyond = beyond.sum() / sectors
        for feature in range(GAP_AFTER, GAP_BEFORE + 1):
            for k in range(n):
                gaps[k] = values[here[k], ring, feature]
            median = _median(gaps, n)
            for k in range(n):
                values[here[k], ring, feature] -= median
                if feature == GAP_AFTER_MEAN:
                    values[here[k], ring, SPACING] = median
        for k in range(n):
            values[here[k], ring, SEEN_BEYOND] = seen_beyond
            beyond[here[k]] = True


@inlined_kernel
def _median(values: NDArray[np.float64], n: int) -> float:
    """Return the upper median of the first ``n`` values, which it sorts in place.

    Insertion sort, the fastest for the few dozen values of a ring.
    """
    for k in range(1, n):
        value, place = values[k], k
        while place > 0 and values[place - 1] > value:
            values[place] = values[place - 1]
            place -= 1
        values[place] = value
    return values[n // 2]


@kernel
def _mean_point(sums: NDArray[np.float64], sector: int, ring: int) -> tuple[float, float]:
    """Return horizontal distance and height of the mean of a cell's points [m]."""
    n = x = y = z = 0.0
    for a in range(2):
        for b in range(2):
            i, j = 2 * sector + a, 2 * ring + b
            n, x = n + sums[i, j, COUNT], x + sums[i, j, X]
            y, z = y + sums[i, j, Y], z + sums[i, j, Z]
    return np.sqrt(x * x + y * y) / n, z / n
