"""Kernels that turn the sums of a cell's quarters into the cell's own features.

The paper's five features are a principal component analysis of the cell's points. The others
describe the ground on the scale of a wheelbase: planes around each quarter, gaps along the beams,
and bumps over those planes (assumption). ``features.OWN_FEATURES`` names the columns.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel
from traversability.binning import (
    COUNT,
    FURTHEST,
    HIGHEST,
    LOWEST,
    NEAREST,
    XX,
    XY,
    XZ,
    YY,
    YZ,
    ZZ,
    Quarters,
    X,
    Y,
    Z,
)
from traversability.grid import PolarGrid

(
    ROUGHNESS,
    ORIENTATION,
    PLANARITY,
    MIN_HEIGHT,
    HEIGHT_DIFFERENCE,
    MEAN_ABOVE_LOWEST,
    QUARTER_HEIGHT,
    TILT,
    SLOPE_MAX,
    SLOPE_MEAN,
    STEP_MAX,
    STEP_SECOND,
    STEP_MEAN,
    ABOVE_PLANE,
    BELOW_PLANE,
    LOWEST_AROUND,
    HIGHEST_AROUND,
    GAP_AFTER,
    GAP_AFTER_MEAN,
    GAP_BEFORE,
    BEND,
    RISE_BEFORE,
    RISE_AFTER,
    DISTANCE,
    BUMP,
    BUMP_THIRD,
    BUMP_POINTS,
    SPACING,
    SEEN_BEYOND,
    DEPTH,
) = range(30)
"""Columns of a cell's own features, in the order of ``features.OWN_FEATURES``."""

MIN_DESCRIBED = 3
"""Cells with fewer points have no features: three points make a plane."""

BUMP_RANGE = 3.2
"""Cells whose middle is nearer than this are searched for bumps [m]."""

_REACH = 0.3
"""Horizontal reach of the planes around quarters [m]: half a wheelbase and a little, since the
window of the true slope is 0.5 m wide."""

_FULL_WEIGHT = 4.0
"""Number of points that make a quarter's mean as good as any other."""

_MAX_SLOPE = 3.0
"""Largest slope and gap that features hold: beyond, they carry no more information."""

_CELL_NOISE = 1e-3
"""Spread of points along a beam by range noise alone, squared [m2]."""

_WINDOW_NOISE = 2e-3
"""Spread of the means of quarters by range noise [m2]; their heights lie along beams, too."""

_MIN_RELIEF = 0.03
"""Height difference below which a quarter holds no bump [m]."""

_BUMP_HEIGHT = 0.04
"""Height over the ground around from which on a point stops a wheel, or nearly [m]."""

_MIN_RUN = 0.02
"""Shortest distance between the mean points of two cells that a rise is divided by [m]."""

# Columns of ``CellWorkspace.means``, ``CellWorkspace.planes`` and of a quarter's highest points.
_WEIGHT, _MEAN_X, _MEAN_Y, _MEAN_Z, _LOW, _HIGH = range(6)
_GRADIENT_X, _GRADIENT_Y, _LEVEL = range(3)
_FIRST, _SECOND, _THIRD, _N_ABOVE = range(4)


class CellWorkspace(NamedTuple):
    """Arrays that cell descriptions are written to; one instance serves all clouds of a robot.

    Attributes:
        counts: Number of points of each cell, int32, shape (n_sectors, n_rings).
        values: Features of each cell, own ones first, float32, shape (n_sectors, n_rings, f); left
            as they are where a cell has fewer than ``MIN_DESCRIBED`` points.
        means: Weight, mean x, y, z, lowest and highest z [m] of each quarter, float64, shape
            (2 n_sectors, 2 n_rings, 6).
        planes: Gradient along x and y and height at the origin [m] of the plane around each
            quarter, float64, shape (2 n_sectors, 2 n_rings, 3).
    """

    counts: NDArray[np.int32]
    values: NDArray[np.float32]
    means: NDArray[np.float64]
    planes: NDArray[np.float64]


class QuarterPlane(NamedTuple):
    """The plane through the ground around a quarter.

    Attributes:
        slope: Steepness of the plane, rise over run, up to ``_MAX_SLOPE``.
        step: Distance between the highest and the lowest mean point, seen along z from the plane
            [m].
        level: Height of the plane at the quarter's mean point [m].
        lowest: Lowest z within reach [m].
        highest: Highest z within reach [m].
    """

    slope: float
    step: float
    level: float
    lowest: float
    highest: float


class Covariance(NamedTuple):
    """Covariance of points [m2], or of their rows and columns.

    Attributes:
        xx: Variance of x [m2].
        yy: Variance of y [m2].
        zz: Variance of z [m2].
        xy: Covariance of x and y [m2].
        xz: Covariance of x and z [m2].
        yz: Covariance of y and z [m2].
    """

    xx: float
    yy: float
    zz: float
    xy: float
    xz: float
    yz: float


class Eigenvalues(NamedTuple):
    """Eigenvalues of a covariance, none of them negative.

    Attributes:
        l1: Largest one [m2].
        l2: Middle one [m2].
        l3: Smallest one, the variance along the normal [m2].
    """

    l1: float
    l2: float
    l3: float


def make_workspace(grid: PolarGrid, n_features: int) -> CellWorkspace:
    """Return a zeroed workspace for the cells of a grid.

    Args:
        grid: Polar grid of cells.
        n_features: Number of features of a cell.
    """
    sectors, rings = grid.n_sectors, grid.n_rings
    return CellWorkspace(
        counts=np.zeros((sectors, rings), dtype=np.int32),
        values=np.zeros((sectors, rings, n_features), dtype=np.float32),
        means=np.zeros((2 * sectors, 2 * rings, 6)),
        planes=np.zeros((2 * sectors, 2 * rings, 3)),
    )


@kernel
def describe_cells(
    points: NDArray[np.float32],
    quarters: Quarters,
    middles: NDArray[np.float64],
    cells: CellWorkspace,
) -> None:
    """Write the number of points and the own features of each cell.

    Args:
        points: Points in ``base_footprint`` [m], float32, shape (n, 3).
        quarters: Quarter of each point and sums over the quarters.
        middles: Middle of each ring [m], shape (n_rings,).
        cells: Buffers that are filled.
    """
    sums, counts = quarters.sums, cells.counts
    _count_points(sums, counts)
    _mean_points(sums, cells.means)
    for sector in range(counts.shape[0]):
        for ring in range(counts.shape[1]):
            if counts[sector, ring] >= MIN_DESCRIBED:
                out = cells.values[sector, ring]
                _principal_axes(sums, sector, ring, out)
                _ground_shape(sums, cells.means, cells.planes, sector, ring, middles, out)
                _beam_gaps(sums, sector, ring, middles, out)
                _profile(sums, counts, sector, ring, middles, out)
    # These compare cells with each other, so all of them have to be described before.
    _compare_with_ring(counts, cells.values)
    _find_bumps(points, quarters, middles, cells)


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
def _mean_points(sums: NDArray[np.float64], means: NDArray[np.float64]) -> None:
    """Write weight, mean point, lowest and highest z of each quarter; see ``CellWorkspace``."""
    for i in range(sums.shape[0]):
        for j in range(sums.shape[1]):
            n = sums[i, j, COUNT]
            means[i, j, _WEIGHT] = min(n, _FULL_WEIGHT)
            if n > 0:
                means[i, j, _MEAN_X] = sums[i, j, X] / n
                means[i, j, _MEAN_Y] = sums[i, j, Y] / n
                means[i, j, _MEAN_Z] = sums[i, j, Z] / n
                means[i, j, _LOW], means[i, j, _HIGH] = sums[i, j, LOWEST], sums[i, j, HIGHEST]


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
    slope_x, slope_y = _gradient(xx, yy, xy, xz, yz, _CELL_NOISE)
    out[TILT] = min(np.sqrt(slope_x * slope_x + slope_y * slope_y), _MAX_SLOPE)


@kernel
def _gradient(
    xx: float, yy: float, xy: float, xz: float, yz: float, noise: float
) -> tuple[float, float]:
    """Return rise over run along x and y of the least-squares plane, where points support one.

    Across an arc of points nothing is known: what spreads it outwards is range noise, which moves
    points along their beam, so that a plane through them would be as steep as the beam. A direction
    in which the points' variance is well under ``noise`` [m2] counts as level; well above it, this
    is the plain solution ``A^-1 b``. (Tikhonov: ``(A^2 + noise^2)^-1 A b``.)
    """
    axx, ayy = xx * xx + xy * xy + noise * noise, yy * yy + xy * xy + noise * noise
    axy = xy * (xx + yy)
    bx, by = xx * xz + xy * yz, xy * xz + yy * yz
    determinant = axx * ayy - axy * axy
    return (ayy * bx - axy * by) / determinant, (axx * by - axy * bx) / determinant


@kernel
def _ground_shape(
    sums: NDArray[np.float64],
    means: NDArray[np.float64],
    planes: NDArray[np.float64],
    sector: int,
    ring: int,
    middles: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    """Write the shape of the ground around a cell's quarters, the worst and the mean of the four.

    Around each quarter a plane is laid through the mean points of the quarters within reach; slope
    is its steepness, step the range of what is above and below it. Where the whole cell is smaller
    than the reach, two quarters at opposite corners carry as much information as four.
    """
    small = middles[ring] * 4 * np.pi / sums.shape[0] < _REACH
    number, last = 0, (0, 0)
    slope_max = slope_sum = step_max = step_second = step_sum = 0.0
    above = below = sunk = risen = 0.0
    for a in range(2):
        for b in range(2):
            i, j = 2 * sector + a, 2 * ring + b
            if small and a != b and number:
                planes[i, j] = planes[last]
            if sums[i, j, COUNT] == 0 or (small and a != b and number):
                continue
            plane = _fit_plane(sums, means, i, j, planes[i, j])
            number, last = number + 1, (i, j)
            slope_max, slope_sum = max(slope_max, plane.slope), slope_sum + plane.slope
            # The second largest step tells an edge, which all quarters show, from a single outlier.
            step = plane.step
            step_sum += step
            step_second = max(step_second, min(step, step_max))
            step_max = max(step_max, step)
            # Own points against the plane, and against the lowest and highest around.
            low, high = sums[i, j, LOWEST], sums[i, j, HIGHEST]
            above, below = max(above, high - plane.level), max(below, plane.level - low)
            sunk, risen = max(sunk, low - plane.lowest), max(risen, plane.highest - low)
    out[SLOPE_MAX], out[SLOPE_MEAN] = slope_max, slope_sum / number
    out[STEP_MAX], out[STEP_SECOND], out[STEP_MEAN] = step_max, step_second, step_sum / number
    out[ABOVE_PLANE], out[BELOW_PLANE] = above, below
    out[LOWEST_AROUND], out[HIGHEST_AROUND] = sunk, risen


@kernel
def _fit_plane(
    sums: NDArray[np.float64],
    means: NDArray[np.float64],
    i: int,
    j: int,
    plane: NDArray[np.float64],
) -> QuarterPlane:
    """Return the plane through the mean points of the quarters around quarter (i, j).

    Args:
        sums: Sums of each quarter; see ``Quarters``.
        means: Means of each quarter; see ``CellWorkspace``.
        i: Half sector of the quarter.
        j: Half ring of the quarter.
        plane: Output, gradient along x and y and height at the origin [m], shape (3,).
    """
    sectors, rings = sums.shape[0], sums.shape[1]
    x0, y0, z0 = means[i, j, _MEAN_X], means[i, j, _MEAN_Y], means[i, j, _MEAN_Z]
    square = x0 * x0 + y0 * y0
    radius = np.sqrt(square)
    # The window sideways: as many half sectors as the reach is wide here.
    side = max(1, int(_REACH / (radius * 2 * np.pi / sectors)))
    stride = 1 + side // 3  # Narrow columns: every second one will do, the own among them.
    side -= side % stride
    # The window outwards: at least the neighbours, and all whose points come within reach.
    inner, outer = max(radius - _REACH, 0.0), radius + _REACH
    inner, outer = inner * inner, outer * outer
    first, last = max(j - 1, 0), min(j + 1, rings - 1)
    while first > 0 and sums[i, first, FURTHEST] > inner:
        first -= 1
    while last < rings - 1 and 0 < sums[i, last, NEAREST] < outer:
        last += 1
    # Weighted moments of the mean points, counted from the quarter's own for precision.
    n = sx = sy = sz = sxx = syy = sxy = sxz = syz = 0.0
    lowest, highest = np.inf, -np.inf
    for step in range(-side, side + 1, stride):
        column = (i + step) % sectors
        for k in range(first, last + 1):
            w = means[column, k, _WEIGHT]
            if w == 0.0:
                continue
            x, y = means[column, k, _MEAN_X] - x0, means[column, k, _MEAN_Y] - y0
            z = means[column, k, _MEAN_Z] - z0
            n += w
            sx, sy, sz = sx + w * x, sy + w * y, sz + w * z
            sxx, syy, sxy = sxx + w * x * x, syy + w * y * y, sxy + w * x * y
            sxz, syz = sxz + w * x * z, syz + w * y * z
            lowest = min(lowest, means[column, k, _LOW])
            highest = max(highest, means[column, k, _HIGH])
    # Least-squares plane from the covariance.
    mx, my, mz = sx / n, sy / n, sz / n
    gx, gy = _gradient(
        sxx / n - mx * mx,
        syy / n - my * my,
        sxy / n - mx * my,
        sxz / n - mx * mz,
        syz / n - my * mz,
        _WINDOW_NOISE,
    )
    level = z0 + mz - gx * mx - gy * my
    plane[_GRADIENT_X], plane[_GRADIENT_Y], plane[_LEVEL] = gx, gy, level - gx * x0 - gy * y0
    # Step: the range of what is left beside the plane.
    under, over = np.inf, -np.inf
    for step in range(-side, side + 1, stride):
        column = (i + step) % sectors
        for k in range(first, last + 1):
            if means[column, k, _WEIGHT] > 0.0:
                rise = gx * (means[column, k, _MEAN_X] - x0) + gy * (means[column, k, _MEAN_Y] - y0)
                off = means[column, k, _MEAN_Z] - rise
                under, over = min(under, off), max(over, off)
    slope = min(np.sqrt(gx * gx + gy * gy), _MAX_SLOPE)
    return QuarterPlane(slope, over - under, level, lowest, highest)


@kernel
def _find_bumps(
    points: NDArray[np.float32],
    quarters: Quarters,
    middles: NDArray[np.float64],
    cells: CellWorkspace,
) -> None:
    """Write how far near cells rise over the plane of the ground around, and by how many points.

    A rock that stops a wheel is low beside what a slope rises in a cell, and has few points beside
    the cell's own: moments do not show it. One point over the plane is noise; the third highest of
    a quarter is not.
    """
    bins, sums, counts = quarters.bins, quarters.sums, cells.counts
    rings = 0
    while rings < counts.shape[1] and middles[rings] < BUMP_RANGE:
        rings += 1
    # Most quarters are too flat to hold a bump: their points are skipped.
    columns = sums.shape[1]
    has_relief = np.zeros(sums.shape[0] * columns, dtype=np.bool_)
    for i in range(sums.shape[0]):
        for j in range(2 * rings):
            has_relief[i * columns + j] = sums[i, j, HIGHEST] - sums[i, j, LOWEST] >= _MIN_RELIEF
    # The three highest points of each quarter over its plane, and how many rise like a bump.
    slopes = cells.planes.reshape(len(has_relief), 3)
    tops = np.zeros((len(has_relief), 4))
    for k in range(len(points)):
        if bins[k] < 0 or not has_relief[np.uint64(bins[k])]:
            continue
        place = np.uint64(bins[k])
        rise = (
            points[k, 2]
            - slopes[place, _GRADIENT_X] * points[k, 0]
            - slopes[place, _GRADIENT_Y] * points[k, 1]
            - slopes[place, _LEVEL]
        )
        if rise > _BUMP_HEIGHT:
            tops[place, _N_ABOVE] += 1.0
        # Few points are among the highest of their quarter: the others change nothing.
        if rise > tops[place, _THIRD]:
            first, second = tops[place, _FIRST], tops[place, _SECOND]
            tops[place, _FIRST] = max(first, rise)
            tops[place, _SECOND] = max(second, min(first, rise))
            tops[place, _THIRD] = min(second, rise)
    # A cell has the highest bump of its quarters, and the points of all.
    for sector in range(counts.shape[0]):
        for ring in range(rings):
            if counts[sector, ring] < MIN_DESCRIBED:
                continue
            out = cells.values[sector, ring]
            out[BUMP] = out[BUMP_THIRD] = out[BUMP_POINTS] = 0.0
            for a in range(2):
                for b in range(2):
                    top = tops[(2 * sector + a) * columns + 2 * ring + b]
                    out[BUMP] = max(out[BUMP], top[_FIRST])
                    out[BUMP_THIRD] = max(out[BUMP_THIRD], top[_THIRD])
                    out[BUMP_POINTS] += top[_N_ABOVE]


@kernel
def _beam_gaps(
    sums: NDArray[np.float64],
    sector: int,
    ring: int,
    middles: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    """Write the gaps that beams leave behind and before a cell, and how deep its points reach.

    A gap is the stretch without points over the distance at which it begins. A beam that grazes an
    edge lands behind it after such a gap, so it grows with the drop (similar triangles).
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
        after = _MAX_SLOPE if k == rings else (np.sqrt(sums[i, k, NEAREST]) - furthest) / furthest
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
def _profile(
    sums: NDArray[np.float64],
    counts: NDArray[np.int32],
    sector: int,
    ring: int,
    middles: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    """Write the rises from and to the neighbours along the sector, the bend there, the distance."""
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
        out[RISE_BEFORE] = min(max(rise, -_MAX_SLOPE), _MAX_SLOPE)
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
        out[RISE_AFTER] = min(max(rise, -_MAX_SLOPE), _MAX_SLOPE)


@kernel
def _compare_with_ring(counts: NDArray[np.int32], values: NDArray[np.float32]) -> None:
    """Subtract each ring's median gaps from those of its cells, and write the ring's own features.

    How far apart the beams of a laser meet level ground depends on the laser and grows outwards;
    all sectors show it alike. A drop shows in some.
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


@kernel
def eigenvalues(covariance: Covariance) -> Eigenvalues:
    """Return the eigenvalues of a covariance in closed form.

    The largest comes from the trigonometric solution of the cubic (Smith 1961, "Eigenvalues of a
    symmetric 3 x 3 matrix"); sum and product of the other two follow from trace and determinant,
    which keeps the smallest one exact on flat ground.
    """
    xx, yy, zz, xy, xz, yz = covariance
    trace = xx + yy + zz
    q = trace / 3
    off = xy * xy + xz * xz + yz * yz
    a, b, c = xx - q, yy - q, zz - q
    p = np.sqrt(max((a * a + b * b + c * c + 2 * off) / 6, 0.0))
    if p <= 1e-15 * max(q, 1e-300):  # A ball, or a single place: no direction stands out.
        ball = max(q, 0.0)
        return Eigenvalues(ball, ball, ball)
    half_det = (a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)) / 2
    angle = np.arccos(min(max(half_det / (p * p * p), -1.0), 1.0)) / 3
    l1 = q + 2 * p * np.cos(angle)
    # l2 + l3 and l2 l3, so a quadratic; l3 from the product, which does not cancel.
    det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    rest = max(trace - l1, 0.0)
    product = max(det / l1, 0.0)
    root = np.sqrt(max(rest * rest - 4 * product, 0.0))
    l2 = (rest + root) / 2
    l3 = product / l2 if l2 > 0 else 0.0
    return Eigenvalues(l1, l2, min(l3, l2))


@kernel
def normal_z_squared(covariance: Covariance, axes: Eigenvalues) -> float:
    """Return the squared z of the unit normal, the eigenvector of ``l3``, from the eigenvalues.

    The identity of eigenvectors from eigenvalues (Denton et al. 2022): the characteristic
    polynomial of the minor without z, over the product of the eigenvalues' gaps. Zero where the
    normal is undefined (a line, a ball).
    """
    gaps = (axes.l1 - axes.l3) * (axes.l2 - axes.l3)
    if gaps <= 1e-12 * axes.l1 * axes.l1:
        return 0.0
    xy = covariance.xy
    minor = (covariance.xx - axes.l3) * (covariance.yy - axes.l3) - xy * xy
    return min(max(minor / gaps, 0.0), 1.0)
