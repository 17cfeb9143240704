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
from traversability.cartesian.ledges import LEDGE_FEATURES, describe_ledge
from traversability.cartesian.windows import (
    EDGE_CELLS,
    OWN_MEAN,
    OWN_TOP,
    WINDOW_FEATURES,
    WINDOWS,
    FlatCells,
    Workspace,
    add_columns,
    add_flat_cell,
    fit_planes,
    make_workspace,
    no_flat_cells,
    remove_flat_cell,
)
from traversability.cloud import PointCloud

MAX_RANGE = 10.0
"""Distance from the robot beyond which ground cells are not described [m]. Between 5 and 10 m half
of them have points: obstacles there do, and much of the ground between does not."""

MIN_RANGE = 0.7
"""Distance within which they are not described [m]: the laser sees the robot's own shadow there."""

_MAX_FLAT = 0.1
"""Height difference within an elevation cell above which it is no ground, but stands out of it, and
is left out of the planes [m]."""

_N_SHARED = 5
"""Number of features of a ground cell itself; those of the windows around it follow."""

GROUND_FEATURES = (
    "points",
    "tiles",
    "spread",
    "height",
    "range",
    *(f"{name}_{window}" for window in ("near", "around", "wide") for name in WINDOW_FEATURES),
    *LEDGE_FEATURES,
)
"""Features of a ground cell, in order: number of points and of elevation cells (``tiles``) with
points, largest height difference within one of them and within all [m], distance from the robot
[m]; and of the plane through the flat elevation cells of each window around it the share of cells
that are flat, slope, standard deviation and range of the heights beside the plane [m], largest and
smallest height of the own elevation cells over it, and height of their highest point over it
[m]; and the step along a line through it (``LEDGE_FEATURES``)."""

_LEDGES = _N_SHARED + len(WINDOWS) * len(WINDOW_FEATURES)
"""Place of the features of ledges."""

_STEP_AROUND = GROUND_FEATURES.index("step_around")
"""Place of the range of heights in the window that a ledge is sought in."""

_UNEVEN = 0.03
"""Range of the heights there below which there is none [m]: most ground is spared the search."""

_N_POINTS, _N_CELLS, _SPREAD, _HEIGHT, _RANGE = range(_N_SHARED)


class _Ground(NamedTuple):
    """One cloud in elevation cells, as the kernels read it.

    Attributes:
        table: Columns of each elevation cell; see ``ElevationGrid``.
        ages: Age of each elevation cell [s]; see ``ElevationGrid``.
        hit: Elevation cells that points fell into; see ``ElevationGrid``.
        flat: Flat elevation cells.
        first: First elevation cell of ``flat``, counted from the origin, whose ground cell begins
            there, shape (2,).
        cell: Edge of an elevation cell [m].
    """

    table: NDArray[np.float32]
    ages: NDArray[np.float32]
    hit: NDArray[np.uint32]
    flat: FlatCells
    first: NDArray[np.int64]
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
        self._flat, self._work = no_flat_cells(0), make_workspace(0)
        self._n_flat = 0

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
        table = elevation.table
        if len(self._flat.heights) != len(table):
            self._flat, self._work = no_flat_cells(len(table)), make_workspace(len(table))
            self._n_flat = 0
        # Windows are made of whole ground cells, and so is the grid around them.
        first = elevation.centre // EDGE_CELLS * EDGE_CELLS - len(table) // 2
        ground = _Ground(table, elevation.ages, elevation.hit, self._flat, first, elevation.cell)
        self._n_flat, self._count = _describe_cloud(
            ground, self._n_flat, here, span, self._work, self._output
        )

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
    is_labelled = np.zeros(len(cells), dtype=np.bool_)
    for a in range(EDGE_CELLS):
        for b in range(EDGE_CELLS):
            u, v = (EDGE_CELLS * cells + np.array([a, b])).T & mask
            is_labelled |= is_marked[u, v]
    return is_labelled


@kernel
def _describe_cloud(
    ground: _Ground,
    n_flat: int,
    here: NDArray[np.float64],
    span: tuple[float, float],
    work: Workspace,
    described: _Output,
) -> tuple[int, int]:
    """Describe the ground cells of a cloud; return how many cells are flat, and how many described.

    Args:
        ground: Cloud in elevation cells; ``flat`` holds those of the cloud before.
        n_flat: Number of flat cells of the cloud before.
        here: Position of the robot [m], shape (2,).
        span: Ages of the cells that are due [s], from the first on and below the second.
        work: Memory for planes.
        described: Output; its first rows are written.
    """
    places = ground.flat.places
    for k in range(n_flat):
        remove_flat_cell(ground.flat, places[k, 0], places[k, 1])
    n_flat = _fill_flat(ground)
    due = (np.float32(span[0]), np.float32(span[1]))
    return n_flat, _describe(ground, here, due, work, described)


@kernel
def _fill_flat(ground: _Ground) -> int:
    """Write the flat elevation cells of a cloud into ``ground.flat``, and return their number."""
    table, hit, n, count = ground.table, ground.hit, len(ground.table), 0
    places = ground.flat.places
    for k in range(len(hit)):
        u, v = hit[k, 0], hit[k, 1]
        spread = table[u, v, HIGHEST] - table[u, v, LOWEST]
        if table[u, v, POINTS] > 0 and spread <= _MAX_FLAT:
            i, j = (u - ground.first[0]) & (n - 1), (v - ground.first[1]) & (n - 1)
            add_flat_cell(ground.flat, i, j, np.float64(table[u, v, MEAN]), ground.cell)
            places[count, 0], places[count, 1] = i, j
            count += 1
    return count


@kernel
def _describe(
    ground: _Ground,
    here: NDArray[np.float64],
    span: tuple[np.float32, np.float32],
    work: Workspace,
    described: _Output,
) -> int:
    """Write the ground cells that are due or beside such ones with their features; count them.

    Args:
        ground: Cloud in elevation cells.
        here: Position of the robot [m], shape (2,).
        span: Ages of the cells that are due [s], from the first on and below the second.
        work: Memory for planes.
        described: Output; its first rows are written.
    """
    edge = EDGE_CELLS * ground.cell
    due, wanted = _find_due(ground, span)
    own = np.empty((EDGE_CELLS, EDGE_CELLS, 2))
    count, reach = 0, WINDOWS[-1]
    # Ground cells at the rim have windows that leave the grid.
    for i in range(reach + 1, len(due) - reach - 1):
        begin, end = _extent(wanted[i])
        begin, end = max(begin, reach + 1), min(end, len(due) - reach - 1)
        if begin < end:
            add_columns(ground.flat, i, begin - reach, end + reach, work.sums)
        for j in range(begin, end):
            if not wanted[i, j]:
                continue
            # Ground cell, counted from the origin.
            u, v = i + ground.first[0] // EDGE_CELLS, j + ground.first[1] // EDGE_CELLS
            dx, dy = (u + 0.5) * edge - here[0], (v + 0.5) * edge - here[1]
            far = np.sqrt(dx * dx + dy * dy)
            if far < MIN_RANGE or far > MAX_RANGE or count == len(described.cells):
                continue
            row = described.values[count]
            if not _describe_own(ground.table, u, v, own, row):
                continue
            row[_RANGE] = far
            fit_planes(ground.flat, (i, j, ground.cell), own, work, row[_N_SHARED:_LEDGES])
            if row[_STEP_AROUND] >= _UNEVEN:
                describe_ledge(ground.flat.heights, EDGE_CELLS * i, EDGE_CELLS * j, row[_LEDGES:])
            else:
                row[_LEDGES:] = np.float32(0.0)
            described.cells[count, 0], described.cells[count, 1] = u, v
            described.due[count] = due[i, j]
            count += 1
    return count


@kernel
def _extent(wanted: NDArray[np.bool_]) -> tuple[int, int]:
    """Return the first wanted cell of a row, and the place after the last one; 0, 0 for none."""
    begin, end = 0, len(wanted)
    while end > 0 and not wanted[end - 1]:
        end -= 1
    while begin < end and not wanted[begin]:
        begin += 1
    return begin, end


@kernel
def _find_due(
    ground: _Ground, span: tuple[np.float32, np.float32]
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return which ground cells are due, and which are due or beside such ones.

    Args:
        ground: Cloud in elevation cells.
        span: Ages of the cells that are due [s].

    Returns:
        Two maps in the order of ``ground.flat``, bool, shape (n / 2, n / 2).
    """
    n, hit = len(ground.table), ground.hit
    m = n // EDGE_CELLS
    newest = np.full((m, m), np.inf, dtype=np.float32)
    for k in range(len(hit)):
        i = (hit[k, 0] - ground.first[0]) & (n - 1)
        j = (hit[k, 1] - ground.first[1]) & (n - 1)
        a, b = i // EDGE_CELLS, j // EDGE_CELLS
        newest[a, b] = min(newest[a, b], ground.ages[hit[k, 0], hit[k, 1]])
    due, wanted = np.zeros((m, m), dtype=np.bool_), np.zeros((m, m), dtype=np.bool_)
    for a in range(1, m - 1):
        for b in range(1, m - 1):
            due[a, b] = (newest[a, b] >= span[0]) & (newest[a, b] < span[1])
    # Without branches, so that many cells are looked at at once: three rows, then three columns.
    beside = np.zeros(m, dtype=np.bool_)
    for a in range(1, m - 1):
        for b in range(m):
            beside[b] = due[a - 1, b] | due[a, b] | due[a + 1, b]
        for b in range(1, m - 1):
            wanted[a, b] = beside[b - 1] | beside[b] | beside[b + 1]
    return due, wanted


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
            u, v = (EDGE_CELLS * i + a) & (n - 1), (EDGE_CELLS * j + b) & (n - 1)
            own[a, b, OWN_MEAN] = np.nan
            if table[u, v, POINTS] > 0:
                points, seen = points + table[u, v, POINTS], seen + 1
                lowest, highest = table[u, v, LOWEST], table[u, v, HIGHEST]
                spread = max(spread, highest - lowest)
                low, high = min(low, lowest), max(high, highest)
                own[a, b, OWN_MEAN], own[a, b, OWN_TOP] = table[u, v, MEAN], highest
    if seen == 0:
        return False
    row[_N_POINTS], row[_N_CELLS], row[_SPREAD], row[_HEIGHT] = points, seen, spread, high - low
    return True
