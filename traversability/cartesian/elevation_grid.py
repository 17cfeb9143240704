"""Elevation grid: the ground and low obstacles of one cloud, in cells of a decimetre."""

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

Wrapping = PowerOfTwo
"""Number of cells along an edge of the window, a power of two."""

_MAX_ABS_Z = 1e4
"""Largest magnitude of a height that is a measurement [m]."""

_CROWN_REACH = 8
"""Cells on either side in which ground is sought below the lowest point of a cell: where it lies
deeper than ``MAX_HEIGHT``, the cell shows a crown alone."""

_STEPS = (1, 2, 4, 8, 1)
"""Growth of the window of minima, from 1 cell to ``2 * _CROWN_REACH + 1`` [cells]."""


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
            cells: Number of cells along an edge of the window, a power of two.
        """
        self.cell = cell
        self.table = np.zeros((cells, cells, 4), dtype=np.float32)
        self.ages = np.full((cells, cells), np.inf, dtype=np.float32)
        self.centre = np.zeros(2, dtype=np.int64)
        self._floors = np.zeros((cells + 2 * _CROWN_REACH, cells), dtype=np.float32)

    def describe(
        self,
        points: NDArray[np.float32],
        here: NDArray[np.float64],
        ages: NDArray[np.float32] | None = None,
    ) -> None:
        """Replace the contents of the grid by those of a cloud.

        Args:
            points: Points in the grid's frame [m], float32, shape (n, 3).
            here: Position of the robot in the frame [m], shape (2,).
            ages: Time from each point to the newest one [s], float32, shape (n,); None for points
                of one moment.
        """
        self.centre[:] = np.floor(here / self.cell).astype(np.int64)
        times = np.zeros(len(points), dtype=np.float32) if ages is None else ages
        _find_lowest(points, self.centre, self.cell, self.table)
        _find_floors(self.table, self._floors)
        _add_points(points, times, self.centre, self.cell, self._floors, self.table, self.ages)


@kernel
def _find_lowest(
    points: NDArray[np.float32],
    centre: NDArray[np.int64],
    cell: float,
    table: NDArray[np.float32],
) -> None:
    """Write the lowest z of each cell of the window, infinite where it has no points."""
    n = len(table)
    table[:, :, LOWEST] = np.inf
    half = n // 2 - 1
    for k in range(len(points)):
        x, y, z = points[k, 0] / cell, points[k, 1] / cell, points[k, 2]
        # NaN fails every comparison, so that it is left out, too.
        if abs(x - centre[0]) < half and abs(y - centre[1]) < half and abs(z) < _MAX_ABS_Z:
            own = table[int(np.floor(x)) & (n - 1), int(np.floor(y)) & (n - 1)]
            own[LOWEST] = min(own[LOWEST], z)


@kernel
def _find_floors(table: NDArray[np.float32], floors: NDArray[np.float32]) -> None:
    """Write the lowest z within ``_CROWN_REACH`` cells of each cell, one axis after the other.

    The minimum over a window is that of two overlapping windows, so it grows by doubling. Rows and
    columns are padded with those from the other side, as indices wrap around.

    Args:
        table: Cells; see ``ElevationGrid``.
        floors: Output in the first n rows, shape (n + 2 _CROWN_REACH, n).
    """
    n = len(table)
    # Along each row.
    row = np.empty(n + 2 * _CROWN_REACH, dtype=np.float32)
    for i in range(n):
        for j in range(len(row)):
            row[j] = table[i, (j - _CROWN_REACH) & (n - 1), LOWEST]
        for step in _STEPS:
            for j in range(len(row) - step):
                row[j] = min(row[j], row[j + step])
        floors[i + _CROWN_REACH] = row[:n]
    # Across the rows.
    floors[:_CROWN_REACH] = floors[n : n + _CROWN_REACH]
    floors[n + _CROWN_REACH :] = floors[_CROWN_REACH : 2 * _CROWN_REACH]
    for step in _STEPS:
        for i in range(len(floors) - step):
            own, other = floors[i], floors[i + step]
            for j in range(n):
                own[j] = min(own[j], other[j])


@kernel
def _add_points(
    points: NDArray[np.float32],
    times: NDArray[np.float32],
    centre: NDArray[np.int64],
    cell: float,
    floors: NDArray[np.float32],
    table: NDArray[np.float32],
    ages: NDArray[np.float32],
) -> None:
    """Write ground, highest points and ages of all cells that show more than a crown."""
    n = len(table)
    table[:, :, POINTS] = 0.0
    table[:, :, MEAN] = 0.0
    table[:, :, HIGHEST] = -np.inf
    ages[:] = np.inf
    half = n // 2 - 1
    for k in range(len(points)):
        x, y, z = points[k, 0] / cell, points[k, 1] / cell, points[k, 2]
        if not (abs(x - centre[0]) < half and abs(y - centre[1]) < half and abs(z) < _MAX_ABS_Z):
            continue
        i, j = int(np.floor(x)) & (n - 1), int(np.floor(y)) & (n - 1)
        own = table[i, j]
        # The lowest point is a crown's where ground lies far below it nearby.
        if own[LOWEST] > floors[i, j] + np.float32(MAX_HEIGHT):
            continue
        # Running mean: as exact as a sum, without a second pass to divide.
        if z < own[LOWEST] + np.float32(GROUND_LAYER):
            own[POINTS] += np.float32(1.0)
            own[MEAN] += (z - own[MEAN]) / own[POINTS]
        if z < own[LOWEST] + np.float32(MAX_HEIGHT):
            own[HIGHEST] = max(own[HIGHEST], z)
            ages[i, j] = min(ages[i, j], times[k])
