"""Planes through the ground around each quarter of a cell, and how the quarter lies to them."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel
from traversability.binning import COUNT, FURTHEST, HIGHEST, LOWEST, NEAREST, X, Y, Z
from traversability.cells.columns import (
    ABOVE_PLANE,
    BELOW_PLANE,
    HIGHEST_AROUND,
    LOWEST_AROUND,
    MAX_SLOPE,
    SLOPE_MAX,
    SLOPE_MEAN,
    STEP_MAX,
    STEP_MEAN,
    STEP_SECOND,
)
from traversability.cells.covariance import gradient

_REACH = 0.3
"""Horizontal reach of the planes around quarters [m]: half a wheelbase and a little, since the
window of the true slope is 0.5 m wide."""

_FULL_WEIGHT = 4.0
"""Number of points that make a quarter's mean as good as any other."""

_WINDOW_NOISE = 2e-3
"""Spread of the means of quarters by range noise [m2]; their heights lie along beams, too."""

WEIGHT, MEAN_X, MEAN_Y, MEAN_Z, LOW, HIGH = range(6)
"""Columns of ``CellWorkspace.means``."""

GRADIENT_X, GRADIENT_Y, LEVEL = range(3)
"""Columns of ``CellWorkspace.planes``."""


class QuarterPlane(NamedTuple):
    """The plane through the ground around a quarter.

    Attributes:
        slope: Steepness of the plane, rise over run, up to ``MAX_SLOPE``.
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


class _Window(NamedTuple):
    """The quarters within reach of a quarter.

    Attributes:
        side: Number of half sectors to either side.
        stride: Number of half sectors from one that counts to the next.
        first: First half ring.
        last: Last half ring.
    """

    side: int
    stride: int
    first: int
    last: int


@kernel
def mean_points(sums: NDArray[np.float64], means: NDArray[np.float64]) -> None:
    """Write weight, mean point, lowest and highest z of each quarter.

    Args:
        sums: Sums of each quarter; see ``binning.Quarters``.
        means: Output; see ``CellWorkspace``.
    """
    for i in range(sums.shape[0]):
        for j in range(sums.shape[1]):
            n = sums[i, j, COUNT]
            means[i, j, WEIGHT] = min(n, _FULL_WEIGHT)
            if n > 0:
                means[i, j, MEAN_X] = sums[i, j, X] / n
                means[i, j, MEAN_Y] = sums[i, j, Y] / n
                means[i, j, MEAN_Z] = sums[i, j, Z] / n
                means[i, j, LOW], means[i, j, HIGH] = sums[i, j, LOWEST], sums[i, j, HIGHEST]


@kernel
def ground_shape(
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

    Args:
        sums: Sums of each quarter; see ``binning.Quarters``.
        means: Means of each quarter, as ``mean_points`` writes them.
        planes: Plane around each quarter, changed in place; see ``CellWorkspace``.
        sector: Sector of the cell.
        ring: Ring of the cell.
        middles: Middle of each ring [m], shape (n_rings,).
        out: Output, features of the cell.
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
        sums: Sums of each quarter; see ``binning.Quarters``.
        means: Means of each quarter; see ``CellWorkspace``.
        i: Half sector of the quarter.
        j: Half ring of the quarter.
        plane: Output, gradient along x and y and height at the origin [m], shape (3,).
    """
    x0, y0, z0 = means[i, j, MEAN_X], means[i, j, MEAN_Y], means[i, j, MEAN_Z]
    window = _window_around(sums, means, i, j)
    # Weighted moments of the mean points, counted from the quarter's own for precision.
    n = sx = sy = sz = sxx = syy = sxy = sxz = syz = 0.0
    lowest, highest = np.inf, -np.inf
    for step in range(-window.side, window.side + 1, window.stride):
        column = (i + step) % len(means)
        for k in range(window.first, window.last + 1):
            w = means[column, k, WEIGHT]
            if w == 0.0:
                continue
            x, y = means[column, k, MEAN_X] - x0, means[column, k, MEAN_Y] - y0
            z = means[column, k, MEAN_Z] - z0
            n += w
            sx, sy, sz = sx + w * x, sy + w * y, sz + w * z
            sxx, syy, sxy = sxx + w * x * x, syy + w * y * y, sxy + w * x * y
            sxz, syz = sxz + w * x * z, syz + w * y * z
            lowest = min(lowest, means[column, k, LOW])
            highest = max(highest, means[column, k, HIGH])
    # Least-squares plane from the covariance.
    mx, my, mz = sx / n, sy / n, sz / n
    gx, gy = gradient(
        sxx / n - mx * mx,
        syy / n - my * my,
        sxy / n - mx * my,
        sxz / n - mx * mz,
        syz / n - my * mz,
        _WINDOW_NOISE,
    )
    level = z0 + mz - gx * mx - gy * my
    plane[GRADIENT_X], plane[GRADIENT_Y], plane[LEVEL] = gx, gy, level - gx * x0 - gy * y0
    # Step: the range of what is left beside the plane.
    under, over = np.inf, -np.inf
    for step in range(-window.side, window.side + 1, window.stride):
        column = (i + step) % len(means)
        for k in range(window.first, window.last + 1):
            if means[column, k, WEIGHT] > 0.0:
                rise = gx * (means[column, k, MEAN_X] - x0) + gy * (means[column, k, MEAN_Y] - y0)
                off = means[column, k, MEAN_Z] - rise
                under, over = min(under, off), max(over, off)
    slope = min(np.sqrt(gx * gx + gy * gy), MAX_SLOPE)
    return QuarterPlane(slope, over - under, level, lowest, highest)


@inlined_kernel
def _window_around(
    sums: NDArray[np.float64], means: NDArray[np.float64], i: int, j: int
) -> _Window:
    """Return the quarters that come within reach of the mean point of quarter (i, j)."""
    sectors, rings = sums.shape[0], sums.shape[1]
    x, y = means[i, j, MEAN_X], means[i, j, MEAN_Y]
    radius = np.sqrt(x * x + y * y)
    # Sideways: as many half sectors as the reach is wide here.
    side = max(1, int(_REACH / (radius * 2 * np.pi / sectors)))
    stride = 1 + side // 3  # Narrow columns: every second one will do, the own among them.
    side -= side % stride
    # Outwards: at least the neighbours, and all whose points come within reach.
    inner, outer = max(radius - _REACH, 0.0), radius + _REACH
    inner, outer = inner * inner, outer * outer
    first, last = max(j - 1, 0), min(j + 1, rings - 1)
    while first > 0 and sums[i, first, FURTHEST] > inner:
        first -= 1
    while last < rings - 1 and 0 < sums[i, last, NEAREST] < outer:
        last += 1
    return _Window(side, stride, first, last)
