"""Ledges: steps of the ground along a line through a ground cell, as kerbs are.

A kerb of 6 to 12 cm is hardly more than what clods do within a window, but all along it the ground
on one side is higher by the same amount. Heights on both sides of a line are fitted with one slope
and a step between them (analysis of covariance), for each half of the line: where both halves have
the step it is a ledge, and a clod is in one of them. Not in the papers (assumption).
"""

from itertools import product

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

LEDGE_FEATURES = ("ledge", "ledge_both")
"""Features of a ground cell, in order: height of the step across the line, of four directions, in
whose halves it is highest [m], and the lesser of both halves' [m], 0 where they contradict each
other; ``_UNKNOWN`` with too few flat cells."""

_DIRECTIONS = 4
"""Number of directions of lines, 45 degrees apart."""

_ASIDE = (1.5, 2.5, 3.5, 4.5)
"""Distances from the line [cells]: what lies on it may be the face of the step."""

_ALONG = (0.5, 1.5, 2.5, 3.5)
"""Distances along the line from the middle of the ground cell, in each half [cells]."""

_MIN_CELLS = 4
"""Number of flat elevation cells that each side of each half needs."""

_UNKNOWN = -1.0
"""Value of the features without enough of them."""

_LEDGE, _BOTH = range(2)

_LEAST_SPREAD = 1e-9
"""Determinant of the spread of places below which they lie on a line."""


def _make_samples() -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the elevation cells beside each line, and where they lie.

    Returns:
        Row and column counted from the first own cell, int64, and distances of the cell's middle
        across the line and along it [cells], both of shape (directions, 2 sides, 2 halves, k, 2).
    """
    cells, places = [], []
    for angle in np.arange(_DIRECTIONS) * np.pi / _DIRECTIONS:
        axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        for side, half, x, y in product((-1, 1), (-1, 1), _ASIDE, _ALONG):
            # The middle of a ground cell is the corner of its four cells.
            cell = np.floor(1.0 + np.array([side * x, half * y]) @ axes + 1e-9)
            cells.append(cell.astype(np.int64))
            places.append(axes @ (cell - 0.5))
    shape = (_DIRECTIONS, 2, 2, -1, 2)
    return np.array(cells).reshape(shape), np.array(places).reshape(shape)


_CELLS, _PLACES = _make_samples()


@kernel
def describe_ledge(heights: NDArray[np.float64], i: int, j: int, row: NDArray[np.float32]) -> None:
    """Write the features of the highest ledge through a ground cell.

    Args:
        heights: Mean height of each flat elevation cell [m], NaN for others, shape (n, n).
        i: First row of the ground cell's own elevation cells.
        j: First column of them.
        row: Output, in the order of ``LEDGE_FEATURES``.
    """
    row[_LEDGE], row[_BOTH] = _UNKNOWN, _UNKNOWN
    groups = np.empty((2, 2, 4))
    for direction in range(_DIRECTIONS):
        along_x, along_y, is_known = _fit_slopes(heights, i, j, direction, groups)
        if not is_known:
            continue
        first = _step(groups[0, 0], groups[1, 0], along_x, along_y)
        second = _step(groups[0, 1], groups[1, 1], along_x, along_y)
        both = min(abs(first), abs(second)) if first * second > 0 else 0.0
        if both > row[_BOTH] or (both == row[_BOTH] and abs(first + second) / 2 > row[_LEDGE]):
            row[_LEDGE], row[_BOTH] = abs(first + second) / 2, both


@kernel
def _fit_slopes(
    heights: NDArray[np.float64], i: int, j: int, direction: int, groups: NDArray[np.float64]
) -> tuple[float, float, bool]:
    """Fit the slope that both sides of a line and both halves of it have in common.

    Args:
        heights: Heights of flat elevation cells [m], shape (n, n).
        i: First row of the ground cell's own elevation cells.
        j: First column of them.
        direction: Number of the line's direction.
        groups: Output: number of cells and means of the distances across and along the line
            [cells] and of the height [m] of each side and half, shape (2, 2, 4).

    Returns:
        Slopes across and along the line [m a cell], and False without enough cells.
    """
    xx = xy = yy = xz = yz = 0.0
    for side in range(2):
        for half in range(2):
            count, sx, sy, sz = 0, 0.0, 0.0, 0.0
            sxx = sxy = syy = sxz = syz = 0.0
            for k in range(_CELLS.shape[3]):
                u, v = _CELLS[direction, side, half, k]
                z = heights[i + u, j + v]
                if np.isnan(z):
                    continue
                x, y = _PLACES[direction, side, half, k]
                count, sx, sy, sz = count + 1, sx + x, sy + y, sz + z
                sxx, sxy, syy = sxx + x * x, sxy + x * y, syy + y * y
                sxz, syz = sxz + x * z, syz + y * z
            if count < _MIN_CELLS:
                return 0.0, 0.0, False
            group = groups[side, half]
            group[0], group[1], group[2], group[3] = count, sx / count, sy / count, sz / count
            xx, xy = xx + sxx - sx * sx / count, xy + sxy - sx * sy / count
            yy += syy - sy * sy / count
            xz, yz = xz + sxz - sx * sz / count, yz + syz - sy * sz / count
    spread = xx * yy - xy * xy
    if spread < _LEAST_SPREAD:
        return 0.0, 0.0, False
    return (yy * xz - xy * yz) / spread, (xx * yz - xy * xz) / spread, True


@kernel
def _step(
    low: NDArray[np.float64], high: NDArray[np.float64], across: float, along: float
) -> float:
    """Return the step from one side of a line to the other beside the common slope [m]."""
    slope = across * (high[1] - low[1]) + along * (high[2] - low[2])
    return float(high[3] - low[3] - slope)
