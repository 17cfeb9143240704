"""Planes through the flat elevation cells in windows around a ground cell, and what is beside them.

The planes are the paper's step from points to features (Sanchez et al. 2023, section 3.3) on the
scale of a wheel and of the body. Windows are made of whole ground cells, each two by two elevation
cells: their moments are summed up once, then down the columns of a row of windows, which all of
them share, then across each window. Differences of a summed-area table would need fewer sums, but
leave too few digits for a roughness of millimetres.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

EDGE_CELLS = 2
"""Elevation grid cells along the edge of a ground cell."""

WINDOWS = (1, 2, 4)
"""Reach of the windows beyond a ground cell on each side [ground cells]."""

WINDOW_FEATURES = ("filled", "slope", "roughness", "step", "rise", "drop", "peak")
"""Features of each window, in order; see ``GROUND_FEATURES``."""

_MIN_CELLS = 5
"""Number of flat elevation cells that make a plane."""

_UNKNOWN = -1.0
"""Value of features that a window has too few flat cells for."""

_FILLED, _SLOPE, _ROUGHNESS, _STEP, _RISE, _DROP, _PEAK = range(len(WINDOW_FEATURES))

_S, _SX, _SY, _SZ, _SXX, _SYY, _SXY, _SXZ, _SYZ, _SZZ = range(10)
"""Moments: sums of 1, x, y, z, x^2, y^2, x y, x z, y z and z^2 over flat elevation cells [m]."""

_N_MOMENTS = 10

OWN_MEAN, OWN_TOP = range(2)
"""Columns of a ground cell's own elevation cells."""


class FlatCells(NamedTuple):
    """Flat elevation cells of a cloud in the order of the grid's window (not wrapped around).

    Attributes:
        heights: Mean height of each flat elevation cell [m], else NaN, which fails every
            comparison; float64, shape (n, n).
        moments: Moments of the flat cells of each ground cell, positions counted from the middle of
            the window, float64, shape (n / 2, n / 2, _N_MOMENTS).
        places: Row and column of each flat cell, in the first rows, int32, shape (n * n, 2).
    """

    heights: NDArray[np.float64]
    moments: NDArray[np.float64]
    places: NDArray[np.int32]


class _Plane(NamedTuple):
    """Plane through the flat cells of a window.

    Attributes:
        x: Mean x of the cells [m].
        y: Mean y [m].
        z: Mean height [m].
        along_x: Slope along x.
        along_y: Slope along y.
    """

    x: float
    y: float
    z: float
    along_x: float
    along_y: float


class Workspace(NamedTuple):
    """Memory of ``fit_planes``.

    Attributes:
        sums: Moments of the column of ground cells of each window, float64, shape (windows, n / 2 *
            _N_MOMENTS).
        moments: Moments of one window, shape (_N_MOMENTS,).
        least: Smallest height beside the plane in each column of elevation cells [m].
        most: Largest one.
    """

    sums: NDArray[np.float64]
    moments: NDArray[np.float64]
    least: NDArray[np.float64]
    most: NDArray[np.float64]


def no_flat_cells(n: int) -> FlatCells:
    """Return memory for a window of n by n elevation cells, none of them flat."""
    m = n // EDGE_CELLS
    places = np.zeros((n * n, 2), dtype=np.int32)
    return FlatCells(np.full((n, n), np.nan), np.zeros((m, m, _N_MOMENTS)), places)


def make_workspace(n: int) -> Workspace:
    """Return memory for ``fit_planes`` in a window of n by n elevation cells."""
    width = EDGE_CELLS * (2 * WINDOWS[-1] + 1)
    return Workspace(
        sums=np.zeros((len(WINDOWS), n // EDGE_CELLS * _N_MOMENTS)),
        moments=np.zeros(_N_MOMENTS),
        least=np.zeros(width),
        most=np.zeros(width),
    )


@kernel
def add_flat_cell(flat: FlatCells, i: int, j: int, z: float, cell: float) -> None:
    """Add a flat elevation cell.

    Args:
        flat: Flat cells so far, changed in place.
        i: Row of the cell.
        j: Column of the cell.
        z: Mean height [m].
        cell: Edge of an elevation cell [m].
    """
    flat.heights[i, j] = z
    x, y = _middle_of(i, flat, cell), _middle_of(j, flat, cell)
    moments, a, b = flat.moments, i // EDGE_CELLS, j // EDGE_CELLS
    moments[a, b, _S] += 1.0
    moments[a, b, _SX] += x
    moments[a, b, _SY] += y
    moments[a, b, _SZ] += z
    moments[a, b, _SXX] += x * x
    moments[a, b, _SYY] += y * y
    moments[a, b, _SXY] += x * y
    moments[a, b, _SXZ] += x * z
    moments[a, b, _SYZ] += y * z
    moments[a, b, _SZZ] += z * z


@kernel
def remove_flat_cell(flat: FlatCells, i: int, j: int) -> None:
    """Remove a flat elevation cell, and what its ground cell holds of others."""
    flat.heights[i, j] = np.nan
    for k in range(_N_MOMENTS):
        flat.moments[i // EDGE_CELLS, j // EDGE_CELLS, k] = 0.0


@kernel
def _middle_of(place: int, flat: FlatCells, cell: float) -> float:
    """Return the position of an elevation cell's middle along a row or column [m]."""
    return (place - len(flat.heights) / 2 + 0.5) * cell


@kernel
def add_columns(flat: FlatCells, row: int, begin: int, end: int, sums: NDArray[np.float64]) -> None:
    """Write the sums down the columns of the windows around a row of ground cells.

    Args:
        flat: Flat cells.
        row: Row of ground cells.
        begin: First column of ground cells that is needed.
        end: Column before which to stop.
        sums: Output; see ``Workspace``.
    """
    moments = flat.moments.reshape(len(flat.moments), sums.shape[1])
    begin, end = begin * _N_MOMENTS, end * _N_MOMENTS
    column_sums = sums[0, begin:end]
    column_sums[:] = moments[row, begin:end]
    done = 0
    for k in range(len(WINDOWS)):
        # Each window contains the one before.
        if k > 0:
            column_sums = sums[k, begin:end]
            column_sums[:] = sums[k - 1, begin:end]
        for away in range(done + 1, WINDOWS[k] + 1):
            above, below = moments[row - away, begin:end], moments[row + away, begin:end]
            for c in range(len(column_sums)):
                column_sums[c] += above[c] + below[c]
        done = WINDOWS[k]


@kernel
def fit_planes(
    flat: FlatCells,
    place: tuple[int, int, float],
    own: NDArray[np.float64],
    work: Workspace,
    features: NDArray[np.float32],
) -> None:
    """Write the features of the windows around a ground cell, the smallest first.

    Args:
        flat: Flat elevation cells.
        place: Row and column of the ground cell, and the edge of an elevation cell [m].
        own: Mean and highest z of each own elevation cell, NaN without points, shape (EDGE_CELLS,
            EDGE_CELLS, 2).
        work: Memory, with the sums of ``add_columns`` for this row.
        features: Output, ``WINDOW_FEATURES`` of each window.
    """
    row, column, cell = place
    features[:] = _UNKNOWN
    for k in range(len(WINDOWS)):
        reach, first = WINDOWS[k], len(WINDOW_FEATURES) * k
        moments, sums = work.moments, work.sums[k]
        for q in range(_N_MOMENTS):
            moments[q] = 0.0
        for b in range(
            (column - reach) * _N_MOMENTS, (column + reach + 1) * _N_MOMENTS, _N_MOMENTS
        ):
            for q in range(_N_MOMENTS):
                moments[q] += sums[b + q]
        features[first + _FILLED] = work.moments[_S] / (EDGE_CELLS * (2 * reach + 1)) ** 2
        is_plane, plane, variance = _fit_plane(work.moments, cell)
        if is_plane:
            slope = np.sqrt(plane.along_x * plane.along_x + plane.along_y * plane.along_y)
            step = _range_beside(flat, (row, column, reach, cell), plane, work)
            features[first + _SLOPE], features[first + _STEP] = slope, step
            features[first + _ROUGHNESS] = np.sqrt(max(variance, 0.0))
            x = _middle_of(EDGE_CELLS * row, flat, cell)
            y = _middle_of(EDGE_CELLS * column, flat, cell)
            rise, drop, peak = _own_beside(own, x, y, plane, cell)
            features[first + _RISE], features[first + _DROP], features[first + _PEAK] = (
                rise,
                drop,
                peak,
            )


@kernel
def _fit_plane(moments: NDArray[np.float64], cell: float) -> tuple[bool, _Plane, float]:
    """Return the least-squares plane of a window's flat cells, by Cramer's rule.

    Args:
        moments: Moments of the window.
        cell: Edge of an elevation cell [m].

    Returns:
        False without a plane, the plane, and the variance of the heights beside it [m^2].
    """
    s = moments[_S]
    if s < _MIN_CELLS:
        return False, _Plane(0.0, 0.0, 0.0, 0.0, 0.0), 0.0
    mx, my, mz = moments[_SX] / s, moments[_SY] / s, moments[_SZ] / s
    cxx, cyy = moments[_SXX] / s - mx * mx, moments[_SYY] / s - my * my
    cxy, czz = moments[_SXY] / s - mx * my, moments[_SZZ] / s - mz * mz
    cxz, cyz = moments[_SXZ] / s - mx * mz, moments[_SYZ] / s - my * mz
    determinant = cxx * cyy - cxy * cxy
    if determinant < 0.1 * cell**4:  # The cells lie in a row.
        return False, _Plane(mx, my, mz, 0.0, 0.0), 0.0
    gx, gy = (cxz * cyy - cyz * cxy) / determinant, (cyz * cxx - cxz * cxy) / determinant
    return True, _Plane(mx, my, mz, gx, gy), czz - gx * cxz - gy * cyz


@kernel
def _range_beside(
    flat: FlatCells, window: tuple[int, int, int, float], plane: _Plane, work: Workspace
) -> float:
    """Return the range of the heights of a window's flat cells beside its plane [m].

    Args:
        flat: Flat elevation cells.
        window: Row and column of the ground cell, reach of the window beyond it in ground cells,
            and the edge of an elevation cell [m].
        plane: Plane of the window.
        work: Memory for the extremes.
    """
    row, column, reach, cell = window
    first, begin = EDGE_CELLS * (row - reach), EDGE_CELLS * (column - reach)
    width = EDGE_CELLS * (2 * reach + 1)
    least, most = work.least[:width], work.most[:width]
    least[:], most[:] = np.inf, -np.inf
    # Column by column; two rows at a time, which halves the extremes' ways to memory.
    across = plane.along_y * (_middle_of(begin, flat, cell) - plane.y)
    for i in range(first, first + width, 2):
        above, below = flat.heights[i, begin : begin + width], flat.heights[i + 1, begin:]
        x, next_x = _middle_of(i, flat, cell), _middle_of(i + 1, flat, cell)
        level = plane.z + plane.along_x * (x - plane.x) + across
        next_level = plane.z + plane.along_x * (next_x - plane.x) + across
        for c in range(width):
            off, next_off = above[c] - level, below[c] - next_level
            low, high = least[c], most[c]
            low, high = off if off < low else low, off if off > high else high
            least[c] = next_off if next_off < low else low
            most[c] = next_off if next_off > high else high
    # Then over all columns.
    lowest, highest = np.inf, -np.inf
    for c in range(width):
        rise = plane.along_y * cell * c
        lowest, highest = min(lowest, least[c] - rise), max(highest, most[c] - rise)
    return highest - lowest


@kernel
def _own_beside(
    own: NDArray[np.float64], x: float, y: float, plane: _Plane, cell: float
) -> tuple[float, float, float]:
    """Return largest and smallest height of the own elevation cells, flat or not, over a plane.

    Args:
        own: Mean and highest z of the own elevation cells; see ``fit_planes``.
        x: Position of the first one's middle along x [m].
        y: Position of the first one's middle along y [m].
        plane: Plane.
        cell: Edge of an elevation cell [m].

    Returns:
        Both [m], and the height of their highest point over it [m].
    """
    drop, rise, peak = np.inf, -np.inf, -np.inf
    # A slope's edge rises so far over its cell's middle.
    uphill = (abs(plane.along_x) + abs(plane.along_y)) * cell / 2
    for a in range(EDGE_CELLS):
        for b in range(EDGE_CELLS):
            # Cells without points are NaN, which fails every comparison.
            mean, top = own[a, b, OWN_MEAN], own[a, b, OWN_TOP]
            off = mean - plane.z - plane.along_x * (x + a * cell - plane.x)
            off -= plane.along_y * (y + b * cell - plane.y)
            above = off + top - mean - uphill
            drop, rise = off if off < drop else drop, off if off > rise else rise
            peak = above if above > peak else peak
    return rise, drop, peak
