"""Features of ground cells: the ground around the robot in squares of two decimetres.

A polar cell three metres away is half a metre wide and almost a metre deep: one trunk in it closes
a passage that the robot fits through. A cloud shows more than that. Each ground cell is two by two
cells of the elevation grid. It is described by planes through the elevation cells around it, which
is the paper's step from points to features (Sanchez et al. 2023, section 3.3) on the scale of a
wheel and of the body, and classified by boosted trees. Not in the papers (assumption).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.cartesian.elevation_grid import (
    ANY_AGE,
    HIGHEST,
    LOWEST,
    MAX_HEIGHT,
    MEAN,
    POINTS,
    ElevationGrid,
)
from traversability.cloud import PointCloud

EDGE_CELLS = 2
"""Elevation grid cells along the edge of a ground cell."""

MAX_RANGE = 10.0
"""Distance from the robot beyond which ground cells are not described [m]. Between 5 and 10 m half
of them have points: obstacles there do, and much of the ground between does not."""

MIN_RANGE = 0.7
"""Distance within which they are not described [m]: the laser sees the robot's own shadow there."""

_WINDOWS = (2, 4, 8)
"""Reach of the windows beyond a ground cell on each side [elevation grid cells]."""

_MAX_FLAT = 0.1
"""Height difference within an elevation cell above which it is no ground, but stands out of it, and
is left out of the planes [m]."""

_MIN_CELLS = 5
"""Number of flat elevation cells that make a plane."""

_N_SHARED = 5
_N_OF_WINDOW = 7
"""Number of features of a ground cell itself, and of each window around it."""

_UNKNOWN = -1.0
"""Value of features that a cell has too few points for."""

GROUND_FEATURES = (
    "points",
    "tiles",
    "spread",
    "height",
    "range",
    *(
        f"{name}_{window}"
        for window in ("near", "around", "wide")
        for name in ("filled", "slope", "roughness", "step", "rise", "drop", "peak")
    ),
)
"""Features of a ground cell, in order: number of points and of elevation cells (``tiles``) with
points, largest height difference within one of them and within all [m], distance from the robot
[m]; and of the plane through the flat elevation cells of each window around it the share of cells
that are flat, slope, standard deviation and range of the heights beside the plane [m], largest and
smallest height of the own elevation cells over it, and height of their highest point over it
[m]."""

_N_POINTS, _N_CELLS, _SPREAD, _HEIGHT, _RANGE = range(_N_SHARED)
_FILLED, _SLOPE, _ROUGHNESS, _STEP, _RISE, _DROP, _PEAK = range(_N_OF_WINDOW)

# Rows of the sums that each column of a window keeps: of 1, x, x^2, z, x z, z^2 over its flat
# cells; and smallest and largest height beside the plane.
_N, _SX, _SXX, _SZ, _SXZ, _SZZ, _LEAST, _MOST = range(8)

# Columns of a ground cell's own elevation cells.
_OWN_MEAN, _OWN_TOP = range(2)


class _Ground(NamedTuple):
    """One cloud in elevation cells, as the kernels read it.

    Attributes:
        table: Columns of each elevation cell; see ``ElevationGrid``.
        ages: Age of each elevation cell [s]; see ``ElevationGrid``.
        flat: 1 for flat elevation cells, else 0, and their mean heights [m], else 0, in the order
            of the window (not wrapped around), float64, shape (2, n, n).
        centre: Elevation cell of the robot, shape (2,).
        cell: Edge of an elevation cell [m].
    """

    table: NDArray[np.float32]
    ages: NDArray[np.float32]
    flat: NDArray[np.float64]
    centre: NDArray[np.int64]
    cell: float


class _Output(NamedTuple):
    """Memory for described ground cells; see ``GroundFeatures``.

    Attributes:
        cells: Ground cells, int64, shape (capacity, 2).
        values: Features, float32, shape (capacity, f).
        due: True for cells that were asked for, bool, shape (capacity,).
    """

    cells: NDArray[np.int64]
    values: NDArray[np.float32]
    due: NDArray[np.bool_]


class _Window(NamedTuple):
    """Place of one window in the order of ``_Ground.flat``.

    Attributes:
        row: Row of the ground cell's first elevation cell.
        column: Column of the same.
        reach: Elevation cells of the window beyond the ground cell on each side.
        cell: Edge of an elevation cell [m].
    """

    row: int
    column: int
    reach: int
    cell: float


class GroundFeatures:
    """Describes the ground cells of clouds in memory that is allocated once.

    Attributes:
        cells: Ground cells of the last cloud, counted from the origin of its frame, int64, shape
            (k, 2).
        values: Their features in the order of ``GROUND_FEATURES``, float32, shape (k, f).
        due: True for cells that were asked for, bool, shape (k,); the others lie beside one.
    """

    def __init__(self) -> None:
        """Begin without a cloud."""
        self._count = 0
        self._output = _make_output(0)
        self._flat = np.zeros((2, 0, 0))

    def describe(
        self,
        elevation: ElevationGrid,
        here: NDArray[np.float64],
        span: tuple[float, float] = ANY_AGE,
    ) -> None:
        """Describe the ground cells of a cloud around a position, and those beside them.

        Args:
            elevation: Elevation grid of the cloud.
            here: Position of the robot [m], shape (2,).
            span: Ages of the cells that are asked for [s], from the first on and below the second.
        """
        capacity = (2 * int(MAX_RANGE / (EDGE_CELLS * elevation.cell)) + 3) ** 2
        if len(self._output.cells) < capacity:
            self._output = _make_output(capacity)
        if self._flat.shape[1] != len(elevation.table):
            self._flat = np.zeros((2, *elevation.table.shape[:2]))
        _find_flat(elevation.table, elevation.centre, self._flat)
        ground = _Ground(
            elevation.table, elevation.ages, self._flat, elevation.centre, elevation.cell
        )
        ages = (np.float32(span[0]), np.float32(span[1]))
        self._count = _describe(ground, here, ages, self._output)

    @property
    def cells(self) -> NDArray[np.int64]:
        """Ground cells of the last cloud, counted from the origin, int64, shape (k, 2)."""
        return self._output.cells[: self._count]

    @property
    def values(self) -> NDArray[np.float32]:
        """Features of these cells, float32, shape (k, f)."""
        return self._output.values[: self._count]

    @property
    def due(self) -> NDArray[np.bool_]:
        """True for cells that were asked for, bool, shape (k,)."""
        return self._output.due[: self._count]


def _make_output(capacity: int) -> _Output:
    """Return memory for so many ground cells."""
    return _Output(
        cells=np.zeros((capacity, 2), dtype=np.int64),
        values=np.zeros((capacity, len(GROUND_FEATURES)), dtype=np.float32),
        due=np.zeros(capacity, dtype=np.bool_),
    )


def label_ground_cells(
    cloud: PointCloud,
    marked: NDArray[np.bool_],
    share: float,
    elevation: ElevationGrid,
    cells: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Return which ground cells have an elevation cell with enough marked points below crowns.

    Args:
        cloud: Labelled points.
        marked: True for marked points, bool, shape (m,).
        share: Share of marked points from which on an elevation cell is marked.
        elevation: Elevation grid of the same cloud.
        cells: Ground cells, int64, shape (n, 2).

    Returns:
        bool, shape (n,).
    """
    n = len(elevation.table)
    mask = n - 1
    # Points in the window, and below the crowns of their elevation cells.
    place = np.floor(cloud.points[:, :2] / elevation.cell).astype(np.int64)
    inside = (np.abs(place - elevation.centre) < n // 2 - 1).all(axis=1)
    i, j = (place & mask).T
    own = elevation.table[i, j]
    low = inside & (own[:, POINTS] > 0) & (cloud.points[:, 2] < own[:, LOWEST] + MAX_HEIGHT)
    # Share of marked points in each elevation cell.
    flat = i * n + j
    total = np.bincount(flat[low], minlength=n**2)
    count = np.bincount(flat[low & marked], minlength=n**2)
    is_marked = ((count > 0) & (count >= share * total)).reshape(n, n)
    # A ground cell is marked if one of its elevation cells is.
    found = np.zeros(len(cells), dtype=np.bool_)
    for a in range(EDGE_CELLS):
        for b in range(EDGE_CELLS):
            u, v = (EDGE_CELLS * cells + np.array([a, b])).T & mask
            found |= is_marked[u, v]
    return found


@kernel
def _find_flat(
    table: NDArray[np.float32], centre: NDArray[np.int64], flat: NDArray[np.float64]
) -> None:
    """Write which elevation cells are flat, 1 or 0, and their mean heights, else 0.

    They are written in the order of the window, so that rows of windows are rows of memory.

    Args:
        table: Columns of each elevation cell, wrapped around.
        centre: Elevation cell of the robot.
        flat: Output, shape (2, n, n).
    """
    n = len(table)
    for i in range(n):
        for j in range(n):
            own = table[(centre[0] - n // 2 + i) & (n - 1), (centre[1] - n // 2 + j) & (n - 1)]
            is_flat = own[POINTS] > 0 and own[HIGHEST] - own[LOWEST] <= _MAX_FLAT
            flat[0, i, j] = 1.0 if is_flat else 0.0
            flat[1, i, j] = own[MEAN] if is_flat else 0.0


@kernel
def _describe(
    ground: _Ground,
    here: NDArray[np.float64],
    span: tuple[np.float32, np.float32],
    found: _Output,
) -> int:
    """Write the ground cells that are due or beside such ones with their features; count them.

    Args:
        ground: Cloud in elevation cells.
        here: Position of the robot [m], shape (2,).
        span: Ages of the cells that are due [s], from the first on and below the second.
        found: Output; its first rows are written.
    """
    n = len(ground.table)
    edge = EDGE_CELLS * ground.cell
    wide = _WINDOWS[-1]
    # Elevation cells beyond would have windows that leave the grid.
    most = n // 2 - wide - EDGE_CELLS - 1
    first0, first1 = int(np.floor(here[0] / edge)), int(np.floor(here[1] / edge))
    half = int(MAX_RANGE / edge) + 1
    due, wanted = _find_due(ground.ages, first0 - half, first1 - half, 2 * half + 1, span)
    columns = np.empty((8, 2 * wide + EDGE_CELLS))
    own = np.empty((EDGE_CELLS, EDGE_CELLS, 2))
    count = 0
    for i in range(first0 - half, first0 + half + 1):
        for j in range(first1 - half, first1 + half + 1):
            k, m = i - first0 + half + 1, j - first1 + half + 1
            if not wanted[k, m]:
                continue
            far = np.hypot((i + 0.5) * edge - here[0], (j + 0.5) * edge - here[1])
            u, v = EDGE_CELLS * i - ground.centre[0], EDGE_CELLS * j - ground.centre[1]
            if far < MIN_RANGE or far > MAX_RANGE or count == len(found.cells):
                continue
            if abs(u) > most or abs(v) > most:
                continue
            row = found.values[count]
            if not _describe_own(ground.table, i, j, own, row):
                continue
            row[_RANGE] = far
            row[_N_SHARED:] = _UNKNOWN
            _fit_planes(ground, u + n // 2, v + n // 2, own, columns, row[_N_SHARED:])
            found.cells[count, 0], found.cells[count, 1] = i, j
            found.due[count] = due[k, m]
            count += 1
    return count


@kernel
def _find_due(
    ages: NDArray[np.float32],
    first0: int,
    first1: int,
    width: int,
    span: tuple[np.float32, np.float32],
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which ground cells are due, and which are due or beside such ones.

    Args:
        ages: Age of each elevation cell [s].
        first0: First ground cell along x.
        first1: First ground cell along y.
        width: Number of ground cells along an edge.
        span: Ages of the cells that are due [s].

    Returns:
        Two maps with a rim of one cell, so that each cell has eight neighbours, bool, shape
        (width + 2, width + 2).
    """
    due = np.zeros((width + 2, width + 2), dtype=np.bool_)
    wanted = due.copy()
    for a in range(width):
        for b in range(width):
            age = _age(ages, EDGE_CELLS * (first0 + a), EDGE_CELLS * (first1 + b))
            if span[0] <= age < span[1]:
                due[a + 1, b + 1] = True
                wanted[a : a + 3, b : b + 3] = True
    return due, wanted


@kernel
def _age(ages: NDArray[np.float32], u: int, v: int) -> np.float32:
    """Return the age of a ground cell's newest elevation cell; (u, v) is the first of them."""
    n, least = len(ages), np.float32(np.inf)
    for a in range(EDGE_CELLS):
        for b in range(EDGE_CELLS):
            least = min(least, ages[(u + a) & (n - 1), (v + b) & (n - 1)])
    return least


@kernel
def _describe_own(
    table: NDArray[np.float32],
    i: int,
    j: int,
    own: NDArray[np.float64],
    row: NDArray[np.float32],
) -> bool:
    """Write what a ground cell's own elevation cells show; return False if they have no points.

    Args:
        table: Columns of each elevation cell.
        i: Ground cell along x.
        j: Ground cell along y.
        own: Output, mean and highest z of each own elevation cell, NaN without points, shape
            (EDGE_CELLS, EDGE_CELLS, 2).
        row: Output, features of the ground cell.
    """
    n = len(table)
    points, seen, spread = 0.0, 0, 0.0
    low, high = np.inf, -np.inf
    for a in range(EDGE_CELLS):
        for b in range(EDGE_CELLS):
            part = table[(EDGE_CELLS * i + a) & (n - 1), (EDGE_CELLS * j + b) & (n - 1)]
            own[a, b, _OWN_MEAN] = np.nan
            if part[POINTS] > 0:
                points, seen = points + part[POINTS], seen + 1
                spread = max(spread, part[HIGHEST] - part[LOWEST])
                low, high = min(low, part[LOWEST]), max(high, part[HIGHEST])
                own[a, b, _OWN_MEAN], own[a, b, _OWN_TOP] = part[MEAN], part[HIGHEST]
    if seen == 0:
        return False
    row[_N_POINTS], row[_N_CELLS], row[_SPREAD], row[_HEIGHT] = points, seen, spread, high - low
    return True


@kernel
def _fit_planes(
    ground: _Ground,
    u: int,
    v: int,
    own: NDArray[np.float64],
    columns: NDArray[np.float64],
    found: NDArray[np.float32],
) -> None:
    """Write the features of the windows around a ground cell, the smallest first.

    Sums are kept by column, so that the compiler works on the cells of a row at once, and from one
    window to the next, which contains it.

    Args:
        ground: Cloud in elevation cells.
        u: Row of the ground cell's first elevation cell in ``ground.flat``.
        v: Column of the same.
        own: Mean and highest z of the own elevation cells; see ``_describe_own``.
        columns: Memory for the sums of each column, shape (8, 2 * _WINDOWS[-1] + EDGE_CELLS).
        found: Output, ``_N_OF_WINDOW`` features per window.
    """
    wide = _WINDOWS[-1]
    columns[:_LEAST] = 0.0
    done = 0
    for k in range(len(_WINDOWS)):
        beyond = _WINDOWS[k]
        for a in range(-beyond, beyond + EDGE_CELLS):
            if k > 0 and -done <= a < done + EDGE_CELLS:
                continue  # This row is in the sums of the window before.
            # x from the middle of the ground cell.
            x = (a - (EDGE_CELLS - 1) / 2) * ground.cell
            ones = ground.flat[0, u + a, v - wide : v + wide + EDGE_CELLS]
            heights = ground.flat[1, u + a, v - wide : v + wide + EDGE_CELLS]
            for c in range(2 * wide + EDGE_CELLS):
                one, z = ones[c], heights[c]
                columns[_N, c] += one
                columns[_SX, c] += one * x
                columns[_SXX, c] += one * x * x
                columns[_SZ, c] += z
                columns[_SXZ, c] += x * z
                columns[_SZZ, c] += z * z
        done = beyond
        window = _Window(u, v, beyond, ground.cell)
        _describe_window(ground.flat, window, own, columns, found[_N_OF_WINDOW * k :])


@kernel
def _describe_window(
    flat: NDArray[np.float64],
    window: _Window,
    own: NDArray[np.float64],
    columns: NDArray[np.float64],
    found: NDArray[np.float32],
) -> None:
    """Write the features of the plane through the flat elevation cells of one window.

    Args:
        flat: Flat elevation cells; see ``_Ground``.
        window: Place of the window.
        own: Mean and highest z of the own elevation cells; see ``_describe_own``.
        columns: Sums of each column; see ``_fit_planes``.
        found: Output, the first ``_N_OF_WINDOW`` values.
    """
    u, v, beyond, cell = window.row, window.column, window.reach, window.cell
    middle = (EDGE_CELLS - 1) / 2
    # Moments of the window, from the sums of its columns.
    s = sx = sy = sz = sxx = syy = sxy = sxz = syz = szz = 0.0
    for b in range(-beyond, beyond + EDGE_CELLS):
        c, y = b + _WINDOWS[-1], (b - middle) * cell
        one, x, xx, z, xz, zz = columns[:_LEAST, c]
        s, sx, sy, sz = s + one, sx + x, sy + y * one, sz + z
        sxx, syy, sxy = sxx + xx, syy + y * y * one, sxy + y * x
        sxz, syz, szz = sxz + xz, syz + y * z, szz + zz
    found[_FILLED] = s / (2 * beyond + EDGE_CELLS) ** 2
    if s < _MIN_CELLS:
        return
    # Least-squares plane by Cramer's rule.
    mx, my, mz = sx / s, sy / s, sz / s
    cxx, cyy, cxy = sxx / s - mx * mx, syy / s - my * my, sxy / s - mx * my
    cxz, cyz, czz = sxz / s - mx * mz, syz / s - my * mz, szz / s - mz * mz
    determinant = cxx * cyy - cxy * cxy
    if determinant < 0.1 * cell**4:  # The cells lie in a row.
        return
    gx, gy = (cxz * cyy - cyz * cxy) / determinant, (cyz * cxx - cxz * cxy) / determinant
    found[_SLOPE] = np.hypot(gx, gy)
    found[_ROUGHNESS] = np.sqrt(max(czz - gx * cxz - gy * cyz, 0.0))
    # Range of the flat cells' heights beside the plane, column by column, then over all.
    least, most, width = columns[_LEAST], columns[_MOST], 2 * beyond + EDGE_CELLS
    least[:width], most[:width] = np.inf, -np.inf
    for a in range(-beyond, beyond + EDGE_CELLS):
        ones = flat[0, u + a, v - beyond : v - beyond + width]
        heights = flat[1, u + a, v - beyond : v - beyond + width]
        plane = mz + gx * ((a - middle) * cell - mx) - gy * ((beyond + middle) * cell + my)
        for c in range(width):
            off = heights[c] - plane - gy * cell * c
            below, above = (off, off) if ones[c] > 0 else (np.inf, -np.inf)
            least[c] = below if below < least[c] else least[c]
            most[c] = above if above > most[c] else most[c]
    lowest, highest = least[:width].min(), most[:width].max()
    # The own elevation cells, flat or not, over the plane.
    drop, rise, peak = np.inf, -np.inf, -np.inf
    uphill = (abs(gx) + abs(gy)) * cell / 2  # A slope's edge rises so far over its cell's middle.
    for a in range(EDGE_CELLS):
        for b in range(EDGE_CELLS):
            mean, top = own[a, b]
            if np.isnan(mean):
                continue
            off = mean - mz - gx * ((a - middle) * cell - mx) - gy * ((b - middle) * cell - my)
            drop, rise = min(drop, off), max(rise, off)
            peak = max(peak, off + top - mean - uphill)
    found[_STEP], found[_RISE], found[_DROP], found[_PEAK] = highest - lowest, rise, drop, peak
