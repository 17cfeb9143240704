"""ElevationGrid: what a cloud shows of each decimetre of the ground around a place."""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.cartesian.rolling_grid import PowerOfTwo

LOWEST, POINTS, MEAN, HIGHEST = range(4)
"""Columns of a tile: lowest z [m], number and mean z of the points of the ground in it [m], highest
z of what a robot could meet [m]."""

GROUND_LAYER = 0.25
"""Points no further above the lowest of their tile belong to the ground, or to what lies on it [m].
"""

MAX_HEIGHT = 1.2
"""Points further above it are crowns that a robot passes under [m] (as in ``PolarGrid``)."""

ANY_AGE = (0.0, np.inf)
"""Ages of all that was measured [s]."""

_FARTHEST = 1e4
"""Heights beyond are no measurement [m]."""

_ASIDE = 8
"""A tile that lies further than that above another one, so many tiles aside, is of a crown."""


_HALVES = (1, 2, 4, 8, 1)
"""Windows grow by so many tiles at a time, from one to twice ``_ASIDE`` and itself."""


Wrapping = PowerOfTwo
"""Number of cells along an edge of the window, a power of two."""


class ElevationGrid:
    """A cloud in tiles, in the cloud's frame, whose z points up.

    Attributes:
        cell: Edge of a tile [m].
        table: Columns ``LOWEST`` to ``HIGHEST`` of each tile; tile (i, j), counted from the frame's
            origin, stands at (i, j) modulo n. float32, shape (n, n, 4).
        ages: How long before the cloud's newest point each tile was last measured [s]; infinite
            where it has no points. float32, shape (n, n), as the table.
        centre: The tile of the place that the cloud was described around, shape (2,).
    """

    def __init__(self, cell: float = 0.1, cells: Wrapping = 256) -> None:
        """Begin without a cloud.

        Args:
            cell: Edge of a tile [m].
            cells: Tiles along an edge of the square around the place.
        """
        self.cell = cell
        self.table = np.zeros((cells, cells, 4), dtype=np.float32)
        self.ages = np.full((cells, cells), np.inf, dtype=np.float32)
        self.centre = np.zeros(2, dtype=np.int64)
        self._floors = np.zeros((cells + 2 * _ASIDE, cells), dtype=np.float32)

    def describe(
        self,
        points: NDArray[np.float32],
        here: NDArray[np.float64],
        ages: NDArray[np.float32] | None = None,
    ) -> None:
        """Describe a cloud.

        Args:
            points: Cloud [m], shape (n, 3).
            here: Place of the robot [m], shape (2,).
            ages: How long before the newest each point was measured [s], float32, shape (n,); None
                is at the same time.
        """
        self.centre[:] = np.floor(here / self.cell).astype(np.int64)
        times = np.zeros(len(points), dtype=np.float32) if ages is None else ages
        _describe(points, times, self.centre, self.cell, self.table, self.ages, self._floors)


@kernel
def _describe(points, times, centre, cell, table, ages, floors):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Fill the tiles of the square around the centre."""
    n = len(table)
    table[:, :, LOWEST] = np.inf
    table[:, :, POINTS] = 0.0
    table[:, :, MEAN] = 0.0
    table[:, :, HIGHEST] = -np.inf
    ages[:] = np.inf
    half = n // 2 - 1
    for above in (False, True):
        for k in range(len(points)):
            x, y, z = points[k, 0] / cell, points[k, 1] / cell, points[k, 2]
            if not (abs(x - centre[0]) < half and abs(y - centre[1]) < half and abs(z) < _FARTHEST):
                continue  # Nor does what is no number.
            i, j = int(np.floor(x)) & (n - 1), int(np.floor(y)) & (n - 1)
            own = table[i, j]
            if not above:
                own[LOWEST] = min(own[LOWEST], z)
                continue
            if own[LOWEST] > floors[i, j] + np.float32(MAX_HEIGHT):
                continue
            if z < own[LOWEST] + np.float32(GROUND_LAYER):
                own[POINTS] += np.float32(1.0)
                own[MEAN] += (z - own[MEAN]) / own[POINTS]
            if z < own[LOWEST] + np.float32(MAX_HEIGHT):
                own[HIGHEST] = max(own[HIGHEST], z)
                ages[i, j] = min(ages[i, j], times[k])
        if not above:
            _lower(table, floors)


@kernel
def _lower(table, floors):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the lowest height around each tile, one axis after the other.

    The least of a window is that of two windows of half the length. Rows and columns begin and end
    as they wrap around.
    """
    n = len(table)
    row = np.empty(n + 2 * _ASIDE, dtype=np.float32)
    for i in range(n):
        for j in range(len(row)):
            row[j] = table[i, (j - _ASIDE) & (n - 1), LOWEST]
        for step in _HALVES:
            for j in range(len(row) - step):
                row[j] = min(row[j], row[j + step])
        floors[i + _ASIDE] = row[:n]
    floors[:_ASIDE], floors[n + _ASIDE :] = floors[n : n + _ASIDE], floors[_ASIDE : 2 * _ASIDE]
    for step in _HALVES:
        for i in range(len(floors) - step):
            own, other = floors[i], floors[i + step]
            for j in range(n):
                own[j] = min(own[j], other[j])
