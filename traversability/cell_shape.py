"""What a cell looks like: kernels that turn quarters into a cell's own features.

The columns of ``out`` are those of ``features.OWN_FEATURES``.
"""

import numpy as np

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
    X,
    Y,
    Z,
)

_REACH = 0.3  # Half a wheelbase and a little: the truth's window is 0.5 m wide.
_ENOUGH = 4.0  # Points that make a quarter's mean as good as any other.
_MOST = 3.0  # Slopes and gaps beyond say no more.
_CELL_NOISE = 1e-3  # What range noise alone spreads points along a beam, squared [m2].
_WINDOW_NOISE = 2e-3  # The same for the means of quarters, whose heights lie along beams, too.
_FLAT = 0.03  # Lower quarters hold no bump.
_BUMP = 0.04  # What rises so far over the ground around it stops a wheel, or nearly.
NEAR = 3.2  # Cells whose middle is nearer than this are searched for bumps.
_GAPS = 17  # Columns of the gaps after (most and mean) and before a cell.
_SPACING, _SEEN_BEYOND, _DEPTH = 27, 28, 29  # Columns of what a ring tells, and of a cell's depth.
FEW = 3  # A cell with fewer points tells nothing.


@kernel
def describe_cells(points, bins, sums, means, planes, counts, middles, values):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Write the number of points and the own features of each cell."""
    count_points(sums, counts)
    mean_points(sums, means)
    for sector in range(counts.shape[0]):
        for ring in range(counts.shape[1]):
            if counts[sector, ring] >= FEW:
                out = values[sector, ring]
                _principal_axes(sums, sector, ring, out)
                _ground_shape(sums, means, planes, sector, ring, middles, out)
                _way_outwards(sums, counts, sector, ring, middles, out)
    _compare_with_ring(counts, values)
    _bumps(points, bins, sums, planes, counts, middles, values)


@kernel
def count_points(sums, counts):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Write the number of points of each cell."""
    for sector in range(counts.shape[0]):
        for ring in range(counts.shape[1]):
            total = 0.0
            for a in range(2):
                for b in range(2):
                    total += sums[2 * sector + a, 2 * ring + b, COUNT]
            counts[sector, ring] = np.int32(total)


@kernel
def mean_points(sums, means):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Write weight, mean point, lowest and highest z of each quarter: w, x, y, z, low, high."""
    for i in range(sums.shape[0]):
        for j in range(sums.shape[1]):
            n = sums[i, j, COUNT]
            means[i, j, 0] = min(n, _ENOUGH)
            if n > 0:
                means[i, j, 1] = sums[i, j, X] / n
                means[i, j, 2] = sums[i, j, Y] / n
                means[i, j, 3] = sums[i, j, Z] / n
                means[i, j, 4], means[i, j, 5] = sums[i, j, LOWEST], sums[i, j, HIGHEST]


@kernel
def _principal_axes(sums, sector, ring, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the paper's five features, and what comes from the same sums."""
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
    x, y, mean = x / n, y / n, mean / n
    xx, yy, zz = xx / n - x * x, yy / n - y * y, zz / n - mean * mean
    xy, xz, yz = xy / n - x * y, xz / n - x * mean, yz / n - y * mean
    l1, l2, l3 = eigenvalues(xx, yy, zz, xy, xz, yz)
    out[0] = np.sqrt(l3)
    out[1] = np.sqrt(normal_z_squared(xx, yy, xy, l1, l2, l3))
    out[2] = (l2 - l3) / l1 if l1 > 0 else 0.0
    out[3], out[4] = lowest, highest - lowest
    out[5], out[6] = mean - lowest, quarter_height
    slope_x, slope_y = _gradient(xx, yy, xy, xz, yz, _CELL_NOISE)
    out[7] = min(np.sqrt(slope_x * slope_x + slope_y * slope_y), _MOST)


@kernel
def _gradient(xx, yy, xy, xz, yz, noise):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
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
def _ground_shape(sums, means, planes, sector, ring, middles, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the shape of the ground around a cell's quarters, the worst and the mean of the four.

    Around each quarter a plane is laid through the mean points of the quarters within reach; slope
    is its tilt, step the range of what is above and below it. Where the whole cell is smaller than
    the reach, two quarters at opposite corners say as much as four.
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
            slope, step, level, lowest, highest = _lay_plane(sums, means, i, j, planes[i, j])
            number, last = number + 1, (i, j)
            slope_max, slope_sum = max(slope_max, slope), slope_sum + slope
            step_sum += step
            step_second = max(step_second, min(step, step_max))
            step_max = max(step_max, step)
            low, high = sums[i, j, LOWEST], sums[i, j, HIGHEST]
            above, below = max(above, high - level), max(below, level - low)
            sunk, risen = max(sunk, low - lowest), max(risen, highest - low)
    out[8], out[9] = slope_max, slope_sum / number
    out[10], out[11], out[12] = step_max, step_second, step_sum / number
    out[13], out[14], out[15], out[16] = above, below, sunk, risen


@kernel
def _lay_plane(sums, means, i, j, plane):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return slope, step, the plane's height at a quarter, and lowest and highest z around.

    ``plane`` becomes its gradient along x and y and its height at the origin.
    """
    sectors, rings = sums.shape[0], sums.shape[1]
    x0, y0, z0 = means[i, j, 1], means[i, j, 2], means[i, j, 3]
    square = x0 * x0 + y0 * y0
    radius = np.sqrt(square)
    side = max(1, int(_REACH / (radius * 2 * np.pi / sectors)))
    stride = 1 + side // 3  # Narrow columns: every second one will do, the own among them.
    side -= side % stride
    inner, outer = max(radius - _REACH, 0.0), radius + _REACH
    inner, outer = inner * inner, outer * outer
    first, last = max(j - 1, 0), min(j + 1, rings - 1)
    while first > 0 and sums[i, first, FURTHEST] > inner:
        first -= 1
    while last < rings - 1 and 0 < sums[i, last, NEAREST] < outer:
        last += 1
    n = sx = sy = sz = sxx = syy = sxy = sxz = syz = 0.0
    lowest, highest = np.inf, -np.inf
    for step in range(-side, side + 1, stride):
        column = (i + step) % sectors
        for k in range(first, last + 1):
            w = means[column, k, 0]
            if w == 0.0:
                continue
            x, y, z = means[column, k, 1] - x0, means[column, k, 2] - y0, means[column, k, 3] - z0
            n += w
            sx, sy, sz = sx + w * x, sy + w * y, sz + w * z
            sxx, syy, sxy = sxx + w * x * x, syy + w * y * y, sxy + w * x * y
            sxz, syz = sxz + w * x * z, syz + w * y * z
            lowest = min(lowest, means[column, k, 4])
            highest = max(highest, means[column, k, 5])
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
    plane[0], plane[1], plane[2] = gx, gy, level - gx * x0 - gy * y0
    under, over = np.inf, -np.inf
    for step in range(-side, side + 1, stride):
        column = (i + step) % sectors
        for k in range(first, last + 1):
            if means[column, k, 0] > 0.0:
                rise = gx * (means[column, k, 1] - x0) + gy * (means[column, k, 2] - y0)
                off = means[column, k, 3] - rise
                under, over = min(under, off), max(over, off)
    return min(np.sqrt(gx * gx + gy * gy), _MOST), over - under, level, lowest, highest


@kernel
def _bumps(points, bins, sums, planes, counts, middles, values):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write how far near cells rise over the plane of the ground around, and by how many points.

    A rock that stops a wheel is low beside what a slope rises in a cell, and has few points beside
    the cell's own: moments do not show it. One point over the plane is noise; the third highest of
    a quarter is not.
    """
    rings = 0
    while rings < counts.shape[1] and middles[rings] < NEAR:
        rings += 1
    columns = sums.shape[1]
    deep = np.zeros(sums.shape[0] * columns, dtype=np.bool_)
    for i in range(sums.shape[0]):
        for j in range(2 * rings):
            deep[i * columns + j] = sums[i, j, HIGHEST] - sums[i, j, LOWEST] >= _FLAT
    slopes = planes.reshape(len(deep), 3)
    tops = np.zeros((len(deep), 4))
    for k in range(len(points)):
        place = bins[k]
        if place < 0 or not deep[place]:
            continue
        plane, top = slopes[place], tops[place]
        rise = points[k, 2] - plane[0] * points[k, 0] - plane[1] * points[k, 1] - plane[2]
        top[3] += rise > _BUMP
        if rise > top[0]:
            top[2], top[1], top[0] = top[1], top[0], rise
        elif rise > top[1]:
            top[2], top[1] = top[1], rise
        elif rise > top[2]:
            top[2] = rise
    for sector in range(counts.shape[0]):
        for ring in range(rings):
            if counts[sector, ring] < FEW:
                continue
            out = values[sector, ring]
            out[24] = out[25] = out[26] = 0.0
            for a in range(2):
                for b in range(2):
                    top = tops[(2 * sector + a) * columns + 2 * ring + b]
                    out[24], out[25] = max(out[24], top[0]), max(out[25], top[2])
                    out[26] += top[3]


@kernel
def _way_outwards(sums, counts, sector, ring, middles, out):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write what a beam meets on its way through a cell: gaps, rises and bends.

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
        k = far + 1
        while k < rings and sums[i, k, COUNT] == 0:
            k += 1
        after = _MOST if k == rings else (np.sqrt(sums[i, k, NEAREST]) - furthest) / furthest
        if sums[i, near, COUNT] > 0 and sums[i, far, COUNT] > 0:
            inside = np.sqrt(sums[i, far, NEAREST]) - np.sqrt(sums[i, near, FURTHEST])
            after = max(after, inside / furthest)
        k = near - 1
        while k >= 0 and sums[i, k, COUNT] == 0:
            k -= 1
        begin = middles[0] if k < 0 else np.sqrt(sums[i, k, FURTHEST])
        columns += 1
        low, high = min(low, nearest), max(high, furthest)
        after_max, after_sum = max(after_max, after), after_sum + after
        before_sum += max(nearest - begin, 0.0) / nearest
    out[17], out[18], out[19] = after_max, after_sum / columns, before_sum / columns
    out[_DEPTH] = high - low
    out[20] = out[21] = out[22] = 0.0
    out[23] = middles[ring]
    r0, z0 = _mean_point(sums, sector, ring)
    before = ring - 1
    while before >= 0 and counts[sector, before] < FEW:
        before -= 1
    if before >= 0:
        r1, z1 = _mean_point(sums, sector, before)
        rise = (z0 - z1) / max(r0 - r1, 0.02)
        out[21] = min(max(rise, -_MOST), _MOST)
        if before > 0 and counts[sector, before - 1] >= FEW:
            r2, z2 = _mean_point(sums, sector, before - 1)
            slope = min(max((z1 - z2) / max(r1 - r2, 0.02), -1.0), 1.0)
            out[20] = z0 - z1 - slope * (r0 - r1)
    behind = ring + 1
    while behind < counts.shape[1] and counts[sector, behind] < FEW:
        behind += 1
    if behind < counts.shape[1]:
        r1, z1 = _mean_point(sums, sector, behind)
        out[22] = min(max((z1 - z0) / max(r1 - r0, 0.02), -_MOST), _MOST)


@kernel
def _compare_with_ring(counts, values):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Take each ring's median gaps off those of its cells, and write what the ring tells.

    How far apart the beams of a laser meet level ground depends on the laser and grows outwards;
    all sectors show it alike. A drop shows in some.
    """
    sectors, rings = counts.shape
    beyond = np.zeros(sectors, dtype=np.bool_)
    here, gaps = np.empty(sectors, dtype=np.int64), np.empty(sectors)
    for ring in range(rings - 1, -1, -1):
        n = 0
        for sector in range(sectors):
            if counts[sector, ring] >= FEW:
                here[n] = sector
                n += 1
        if n == 0:
            continue
        seen_beyond = beyond.sum() / sectors
        for feature in range(_GAPS, _GAPS + 3):
            for k in range(n):
                gaps[k] = values[here[k], ring, feature]
            median = _median(gaps, n)
            for k in range(n):
                values[here[k], ring, feature] -= median
                if feature == _GAPS + 1:
                    values[here[k], ring, _SPACING] = median
        for k in range(n):
            values[here[k], ring, _SEEN_BEYOND] = seen_beyond
            beyond[here[k]] = True


@inlined_kernel
def _median(values, n):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the upper median of the first ``n`` values, which it sorts: few are quickest so."""
    for k in range(1, n):
        value, place = values[k], k
        while place > 0 and values[place - 1] > value:
            values[place] = values[place - 1]
            place -= 1
        values[place] = value
    return values[n // 2]


@kernel
def _mean_point(sums, sector, ring):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return horizontal distance and height of the mean of a cell's points [m]."""
    n = x = y = z = 0.0
    for a in range(2):
        for b in range(2):
            i, j = 2 * sector + a, 2 * ring + b
            n, x = n + sums[i, j, COUNT], x + sums[i, j, X]
            y, z = y + sums[i, j, Y], z + sums[i, j, Z]
    return np.sqrt(x * x + y * y) / n, z / n


@kernel
def eigenvalues(xx, yy, zz, xy, xz, yz):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return the eigenvalues of a covariance, the largest first, in closed form.

    The largest comes from the trigonometric solution of the cubic; sum and product of the other two
    follow from trace and determinant, which keeps the smallest one exact on flat ground.
    """
    trace = xx + yy + zz
    q = trace / 3
    off = xy * xy + xz * xz + yz * yz
    a, b, c = xx - q, yy - q, zz - q
    p = np.sqrt(max((a * a + b * b + c * c + 2 * off) / 6, 0.0))
    if p <= 1e-15 * max(q, 1e-300):
        return max(q, 0.0), max(q, 0.0), max(q, 0.0)
    half_det = (a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)) / 2
    angle = np.arccos(min(max(half_det / (p * p * p), -1.0), 1.0)) / 3
    l1 = q + 2 * p * np.cos(angle)
    det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    rest = max(trace - l1, 0.0)
    product = max(det / l1, 0.0)
    root = np.sqrt(max(rest * rest - 4 * product, 0.0))
    l2 = (rest + root) / 2
    l3 = product / l2 if l2 > 0 else 0.0
    return l1, l2, min(l3, l2)


@kernel
def normal_z_squared(xx, yy, xy, l1, l2, l3):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return the squared z of the unit eigenvector of ``l3`` from the eigenvalues alone.

    The identity of eigenvectors from eigenvalues: the characteristic polynomial of the minor
    without z, over the product of the gaps. Zero where the normal is undefined (a line, a ball).
    """
    gaps = (l1 - l3) * (l2 - l3)
    if gaps <= 1e-12 * l1 * l1:
        return 0.0
    minor = (xx - l3) * (yy - l3) - xy * xy
    return min(max(minor / gaps, 0.0), 1.0)
