"""Elevation grid: the ground and low obstacles of one cloud, in cells of a decimetre."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.cartesian.rolling_grid import PowerOfTwo

LOWEST, POINTS, MEAN, HIGHEST = range(4)
"""Columns of a cell: lowest z [m], number and mean z of the points of the ground in it [m], highest
z below crowns [m]."""

GROUND_LAYER = 0.25
"""Height above the lowest point of a cell up to which points belong to the ground, or to what lies
on it [m]."""

MAX_HEIGHT = 1.2
"""Height above the lowest point of a cell from which on points are crowns that a robot passes under
[m] (as in ``PolarGrid``)."""

ANY_AGE = (0.0, np.inf)
"""Span of ages of all cells that have points [s]."""

_MAX_ABS_Z = 1e4
"""Largest magnitude of a height that is a measurement [m]."""

_OUTSIDE = -1
"""Place of points beyond the window."""

_CROWN_REACH = 8
"""Cells on either side in which ground is sought below the lowest point of a cell: where it lies
deeper than ``MAX_HEIGHT``, the cell shows a crown alone. Also the edge of a block of cells."""


class ElevationGrid:
    """Heights of one cloud in a square window around the robot; z of the cloud's frame points up.

    Cells are stored as in ``RollingGrid``: cell (i, j), counted from the frame's origin, at (i, j)
    modulo n. The contents of the cloud before are replaced, so there is nothing to roll.

    Attributes:
        cell: Edge of a cell [m].
        table: Columns ``LOWEST`` to ``HIGHEST`` of each cell, float32, shape (n, n, 4).
        ages: Time from the newest point of each cell to the newest of the cloud [s], infinite where
            a cell has no points, float32, shape (n, n).
        centre: Cell of the robot, counted from the origin of the frame, int64, shape (2,).
    """

    def __init__(self, cell: float = 0.1, cells: PowerOfTwo = 256) -> None:
        """Allocate memory for the window.

        Args:
            cell: Edge of a cell [m].
            cells: Number of cells along an edge of the window, a power of two, at least 16.
        """
        self.cell = cell
        self.table = np.zeros((cells, cells, 4), dtype=np.float32)
        self.ages = np.zeros((cells, cells), dtype=np.float32)
        self.centre = np.zeros(2, dtype=np.int64)
        self._bases = np.zeros((cells, cells), dtype=np.float32)
        # One place more than cells, for the last point's, whether new or not. Unsigned: kernels do
        # not ask whether to count from the end.
        self._hit = np.zeros((cells**2 + 1, 2), dtype=np.uint32)
        self._hit[:-1] = np.indices((cells, cells)).reshape(2, -1).T
        self._n_hit = cells**2
        m = cells // _CROWN_REACH
        self._blocks = np.zeros((2, m, m), dtype=np.float32)
        self._places = np.empty(0, dtype=np.int32)
        _empty(self.table, self.ages, self.hit)

    @property
    def hit(self) -> NDArray[np.uint32]:
        """Rows and columns of the cells that points fell into, crowns too, uint32, shape (k, 2)."""
        return self._hit[: self._n_hit]

    def describe(
        self,
        points: NDArray[np.float32],
        here: NDArray[np.float64],
        stamps: NDArray[np.float64] | None = None,
        newest: float = 0.0,
    ) -> None:
        """Replace the contents of the grid by those of a cloud.

        Args:
            points: Points in the grid's frame [m], float32, shape (n, 3).
            here: Position of the robot in the frame [m], shape (2,).
            stamps: Time of each point [s], float64, shape (n,); None for points of one moment.
            newest: Time of the newest of them [s].
        """
        if len(self._places) < len(points):
            self._places = np.empty(len(points), dtype=np.int32)
        memory = _Memory(
            *(self.table, self.ages, self.centre, self._hit, self._bases),
            *(self._blocks, self._places),
        )
        self._n_hit = _describe(points, stamps, newest, here, self.cell, memory, self._n_hit)


class _Memory(NamedTuple):
    """Memory of an elevation grid; see ``ElevationGrid``.

    Attributes:
        table: Cells, shape (n, n, 4).
        ages: Their ages, shape (n, n).
        centre: Cell of the robot.
        hit: Cells that points fell into in the first rows, shape (n * n + 1, 2).
        bases: Height from which each cell counts; see ``_find_bases``.
        blocks: Lowest z of each block of cells, and of it and those around it, shape (2, n / 8,
            n / 8).
        places: Cell of each point, rows one after the other, ``_OUTSIDE`` for none.
    """

    table: NDArray[np.float32]
    ages: NDArray[np.float32]
    centre: NDArray[np.int64]
    hit: NDArray[np.uint32]
    bases: NDArray[np.float32]
    blocks: NDArray[np.float32]
    places: NDArray[np.int32]


@kernel
def _describe(
    points: NDArray[np.float32],
    stamps: NDArray[np.float64] | None,
    newest: float,
    here: NDArray[np.float64],
    cell: float,
    memory: _Memory,
    n_hit: int,
) -> int:
    """Replace the contents of a grid; return the number of cells that points fell into.

    Args:
        points: Points [m], shape (m, 3).
        stamps: Their times [s], shape (m,), or None for points of one moment.
        newest: Time of the newest of them [s].
        here: Position of the robot [m], shape (2,).
        cell: Edge of a cell [m].
        memory: Memory of the grid, changed in place.
        n_hit: Number of cells that points of the cloud before fell into.
    """
    table, ages, places = memory.table, memory.ages, memory.places
    for axis in range(2):
        memory.centre[axis] = int(np.floor(here[axis] / cell))
    # A few thousand of all cells.
    _empty(table, ages, memory.hit[:n_hit])
    n_hit = _find_lowest(points, memory.centre, cell, places, table, memory.hit)
    _find_bases(table, memory.hit[:n_hit], memory.bases, memory.blocks)
    _add_points(points, stamps, newest, places, memory.bases, table, ages)
    return n_hit


@kernel
def _empty(table: NDArray[np.float32], ages: NDArray[np.float32], hit: NDArray[np.uint32]) -> None:
    """Write that some cells have no points.

    Args:
        table: Cells, changed in place, shape (n, n, 4).
        ages: Their ages, changed in place, shape (n, n).
        hit: Cells to empty, shape (k, 2).
    """
    for k in range(len(hit)):
        i, j = hit[k, 0], hit[k, 1]
        table[i, j, LOWEST], table[i, j, POINTS] = np.inf, 0.0
        table[i, j, MEAN], table[i, j, HIGHEST] = 0.0, -np.inf
        ages[i, j] = np.inf


@kernel
def _find_lowest(
    points: NDArray[np.float32],
    centre: NDArray[np.int64],
    cell: float,
    places: NDArray[np.int32],
    table: NDArray[np.float32],
    hit: NDArray[np.uint32],
) -> int:
    """Write each point's cell, the cells that are hit and their lowest z; return their number.

    Args:
        points: Points [m], shape (m, 3).
        centre: Cell of the robot.
        cell: Edge of a cell [m].
        places: Output, cell of each point, rows one after the other, ``_OUTSIDE`` for none, shape
            (m,).
        table: Cells, empty, changed in place, shape (n, n, 4).
        hit: Output in the first rows, shape (n * n + 1, 2).
    """
    n = len(table)
    half, count = n // 2 - 1, 0
    cells = table.reshape(n * n, 4)
    # Divisions take longer than all the rest. For cells of a decimetre products with 10 are exact.
    per_metre = 1.0 / cell
    for k in range(len(points)):
        x, y, z = points[k, 0] * per_metre, points[k, 1] * per_metre, points[k, 2]
        places[k] = _OUTSIDE
        # NaN fails every comparison, so that it is left out, too.
        if abs(x - centre[0]) < half and abs(y - centre[1]) < half and abs(z) < _MAX_ABS_Z:
            i, j = int(np.floor(x)) & (n - 1), int(np.floor(y)) & (n - 1)
            place = i * n + j
            lowest = cells[place, LOWEST]
            cells[place, LOWEST] = min(lowest, z)
            places[k] = place
            # Written whether new or not: a branch on it would be guessed wrong too often.
            hit[count, 0], hit[count, 1] = i, j
            count += int(lowest == np.inf)
    return count


@kernel
def _find_bases(
    table: NDArray[np.float32],
    hit: NDArray[np.uint32],
    bases: NDArray[np.float32],
    memory: NDArray[np.float32],
) -> None:
    """Write the height from which each cell that was hit counts: its lowest z.

    The lowest point is a crown's where ground lies far below it nearby. Blocks of cells decide most
    cells: such ground lies in none of the nine around, or in the block itself.

    Args:
        table: Cells with their lowest z, shape (n, n, 4).
        hit: Cells that were hit, shape (k, 2).
        bases: Output, minus infinity for crowns, which no point is below; shape (n, n).
        memory: Memory for blocks of cells; see ``_Memory``.
    """
    (blocks, around), deep = memory, np.float32(MAX_HEIGHT)
    blocks[:] = np.inf
    for k in range(len(hit)):
        i, j = hit[k, 0], hit[k, 1]
        a, b = i // _CROWN_REACH, j // _CROWN_REACH
        blocks[a, b] = min(blocks[a, b], table[i, j, LOWEST])
    _find_lowest_around(blocks, around)
    for k in range(len(hit)):
        i, j = hit[k, 0], hit[k, 1]
        a, b = i // _CROWN_REACH, j // _CROWN_REACH
        lowest = table[i, j, LOWEST]
        is_crown = lowest > around[a, b] + deep
        if is_crown and not lowest > blocks[a, b] + deep:
            is_crown = _is_over_ground(table, int(i), int(j))
        bases[i, j] = -np.inf if is_crown else lowest


@kernel
def _find_lowest_around(blocks: NDArray[np.float32], lowest_around: NDArray[np.float32]) -> None:
    """Write the lowest value of each block and the eight around it; indices wrap around."""
    m = len(blocks)
    for a in range(m):
        for b in range(m):
            lowest = blocks[a, b]
            for u in range(a - 1, a + 2):
                for v in range(b - 1, b + 2):
                    lowest = min(lowest, blocks[u & (m - 1), v & (m - 1)])
            lowest_around[a, b] = lowest


@kernel
def _is_over_ground(table: NDArray[np.float32], i: int, j: int) -> bool:
    """Return True if a cell within ``_CROWN_REACH`` lies more than ``MAX_HEIGHT`` below a cell."""
    n, lowest, deep = len(table), table[i, j, LOWEST], np.float32(MAX_HEIGHT)
    for u in range(i - _CROWN_REACH, i + _CROWN_REACH + 1):
        for v in range(j - _CROWN_REACH, j + _CROWN_REACH + 1):
            if lowest > table[u & (n - 1), v & (n - 1), LOWEST] + deep:
                return True
    return False


@kernel
def _add_points(
    points: NDArray[np.float32],
    stamps: NDArray[np.float64] | None,
    newest: float,
    places: NDArray[np.int32],
    bases: NDArray[np.float32],
    table: NDArray[np.float32],
    ages: NDArray[np.float32],
) -> None:
    """Write ground, highest points and ages of all cells that show more than a crown.

    Args:
        points: Points [m], shape (m, 3).
        stamps: Their times [s], shape (m,), or None for points of one moment.
        newest: Time of the newest of them [s].
        places: Cell of each point, rows one after the other, ``_OUTSIDE`` for none, shape (m,).
        bases: Height from which each cell counts; see ``_find_bases``.
        table: Cells, changed in place, shape (n, n, 4).
        ages: Ages of the cells, changed in place, shape (n, n).
    """
    cells, youngest, lowest = table.reshape(-1, 4), ages.ravel(), bases.ravel()
    for k in range(len(points)):
        if places[k] == _OUTSIDE:
            continue
        # Unsigned: no look whether to count from the end.
        place = np.uint64(places[k])
        z, base = points[k, 2], lowest[place]
        # Running mean: as exact as a sum, without a second pass to divide.
        if z < base + np.float32(GROUND_LAYER):
            count, mean = cells[place, POINTS] + np.float32(1.0), cells[place, MEAN]
            cells[place, POINTS], cells[place, MEAN] = count, mean + (z - mean) / count
        if z < base + np.float32(MAX_HEIGHT):
            cells[place, HIGHEST] = max(cells[place, HIGHEST], z)
            age = np.float32(0.0 if stamps is None else newest - stamps[k])
            youngest[place] = min(youngest[place], age)
