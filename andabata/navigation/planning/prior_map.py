"""Prior map: what the hills cost where no scan has been, from heights that were known beforehand.

An elevation model shows banks, ditches and slopes, and none of what stands on them. So it prices
unknown ground alone: whatever the laser has seen counts as it was seen. Beyond the square around
the robot it gives the cost of the rest of the way.
"""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from andabata.navigation.planning.map_transform import MapTransform
from terrain.heightfield import Heightfield
from terrain.kernel import kernel

_STEPS = ((1, 0), (0, 1), (1, 1), (1, -1))
"""Steps from a cell to half of its neighbours: the other half is the same ways backwards."""


class PriorMapConfig(BaseModel):
    """Heights that are known before the drive, and what they cost.

    Attributes:
        source: ``none``; ``world``, a survey of the simulated world; ``truth``, all that stands and
            lies in it, too, which nobody knows: a bound of what a longer view is worth; or the path
            of an elevation model (GeoTIFF) in which the drive's datum lies.
        size: Edge of the square around the datum that is taken from an elevation model [m].
        cell: Distance between the heights [m]: aerial surveys have 1 m, satellites 10 to 30 m.
        height_error: Standard deviation of the heights of ``world`` [m]; 0.1 m is what national
            surveys by airborne laser state (USGS 3DEP, quality level 2).
        steep_slope: Slope above which the ground is likely forbidden [rad].
        steep_cost: Extra cost of a metre of forbidden ground. On slopes it begins at
            ``slope_margin`` below the slope and is full as much above it: gentler slopes are driven
            as level ground is.
        slope_margin: Error of a slope of the model [rad]; 0.1 m on grid lines 1 m apart make 4
            degrees.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    source: str = "none"
    size: float = Field(default=200.0, ge=40, le=300)
    cell: float = Field(default=1.0, gt=0, le=50)
    height_error: float = Field(default=0.1, ge=0, le=10)
    steep_slope: float = Field(default=np.deg2rad(20.0), gt=0, lt=1.5)
    slope_margin: float = Field(default=np.deg2rad(4.0), gt=0, lt=1.5)
    steep_cost: float = Field(default=10.0, ge=0, le=100)


class PriorMap:
    """Costs of unknown ground in the map, and of the way from there to a goal.

    Attributes:
        cell: Edge of a cell [m].
        extra: Extra cost of a metre in each cell, float32, shape (nx, ny).
        highest: Highest of them.
        outside: Their mean, which holds beyond the known heights.
    """

    def __init__(self, extra: NDArray[np.floating], cell: float, unknown: float) -> None:
        """Compute the ways between cells.

        Args:
            extra: Extra cost of a metre in each cell, shape (nx, ny), centred on the map's origin.
            cell: Edge of a cell [m].
            unknown: Cost of a metre on unknown ground, to which the extra cost comes.
        """
        self.cell = cell
        self.extra: NDArray[np.float32] = extra.astype(np.float32)
        self.highest = float(self.extra.max())
        # Else the unknown beyond would be the better way, wherever there are hills.
        self.outside = np.float32(self.extra.mean())
        self._ways = _ways(unknown + self.extra.astype(np.float64), cell)
        self._goal = -1
        self._rest: NDArray[np.float64] = np.zeros(self.extra.shape)

    def price_square(
        self,
        corner: NDArray[np.float64],
        cell: float,
        transform: MapTransform,
        extra: NDArray[np.float32],
    ) -> None:
        """Write the extra cost of a metre into the cells of a square in ``odom``.

        Args:
            corner: Place of the square's first corner in ``odom`` [m], shape (2,).
            cell: Edge of a cell of the square [m].
            transform: Transform from ``odom`` to the map.
            extra: Result, float32, shape (n, n); the mean beyond the known heights.
        """
        _sample(self.extra, self.cell, corner, cell, transform, self.outside, extra)

    def costs_to(
        self, goal: NDArray[np.float64], places: NDArray[np.float64], transform: MapTransform
    ) -> NDArray[np.float64]:
        """Return the costs of the ways from places to a goal [m of free ground].

        Args:
            goal: Goal in ``odom`` [m], shape (2,).
            places: Places in ``odom`` [m], shape (k, 2).
            transform: Transform from ``odom`` to the map.

        Returns:
            Costs, shape (k,); NaN for places beyond the known heights, and for all if the goal is.
        """
        costs = np.full(len(places), np.nan)
        inside, cells = self._cells(transform.to_map(places))
        target_inside, target = self._cells(transform.to_map(goal[None]))
        if target_inside[0]:
            self._search(int(np.ravel_multi_index(tuple(target[0]), self.extra.shape)))
            costs[inside] = self._rest[tuple(cells[inside].T)]
        return costs

    def _cells(self, places: NDArray[np.float64]) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
        """Return which places of the map have known heights, and the nearest heights of all."""
        shape = np.array(self.extra.shape)
        cells = np.floor(places / self.cell + shape / 2).astype(np.int64)
        inside: NDArray[np.bool_] = np.all((cells >= 0) & (cells < shape), axis=1)
        return inside, cells

    def _search(self, goal: int) -> None:
        """Compute the costs of the ways to a cell from everywhere, if it is another."""
        if goal != self._goal:
            rest = dijkstra(self._ways, directed=False, indices=goal)
            self._goal, self._rest = goal, rest.reshape(self.extra.shape)


def slope_costs(heights: Heightfield, config: PriorMapConfig) -> NDArray[np.float64]:
    """Return the extra cost of a metre at known heights, by their slope, shape (nx, ny).

    Args:
        heights: Heights on grid lines of ``config.cell``, centred on the map's origin.
        config: Costs.
    """
    along, across = np.gradient(heights.heights.astype(np.float64), heights.cell)
    slope = np.arctan(np.hypot(along, across))
    above = (slope - config.steep_slope) / config.slope_margin
    return np.asarray(config.steep_cost * np.clip(0.5 + 0.5 * above, 0.0, 1.0))


def _ways(costs: NDArray[np.float64], cell: float) -> coo_array:
    """Return the graph of the ways between neighbours, whose length is their mean cost."""
    numbers = np.arange(costs.size).reshape(costs.shape)
    nx, ny = costs.shape
    begins, ends, lengths = [], [], []
    for row, column in _STEPS:
        low, high = max(-column, 0), ny - max(column, 0)
        here = (slice(0, nx - row), slice(low, high))
        there = (slice(row, nx), slice(low + column, high + column))
        begins.append(numbers[here].ravel())
        ends.append(numbers[there].ravel())
        mean = 0.5 * (costs[here] + costs[there])
        lengths.append(mean.ravel() * cell * np.hypot(row, column))
    pairs = (np.concatenate(begins), np.concatenate(ends))
    return coo_array((np.concatenate(lengths), pairs), shape=(costs.size, costs.size)).tocsr()


@kernel
def _sample(
    values: NDArray[np.float32],
    spacing: float,
    corner: NDArray[np.float64],
    cell: float,
    transform: MapTransform,
    outside: np.float32,
    result: NDArray[np.float32],
) -> None:
    """Write the nearest value of the map into each cell of a square in ``odom``."""
    nx, ny = values.shape
    for i in range(len(result)):
        x = corner[0] + (i + 0.5) * cell
        for j in range(len(result)):
            y = corner[1] + (j + 0.5) * cell
            map_x = transform.c * x - transform.s * y + transform.x
            map_y = transform.s * x + transform.c * y + transform.y
            p = int(np.floor(map_x / spacing + 0.5 * nx))
            q = int(np.floor(map_y / spacing + 0.5 * ny))
            inside = 0 <= p < nx and 0 <= q < ny
            result[i, j] = values[p, q] if inside else outside
