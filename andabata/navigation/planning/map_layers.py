"""Layers of the local map in one window and order, for messages, exports and pictures."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.planning.cartesian_layers import CartesianLayers
from andabata.navigation.planning.local_planner import LocalPlanner
from traversability.cartesian.elevation_grid import MEAN, POINTS, ElevationGrid

OCCUPANCY, ELEVATION, LOW_OBSTACLES, CLEARANCE, COST = (
    "occupancy",
    "elevation",
    "low_obstacle_height",
    "clearance",
    "cost",
)

UNITS: Mapping[str, str] = {
    OCCUPANCY: "probability",
    ELEVATION: "m",
    LOW_OBSTACLES: "m",
    CLEARANCE: "m",
    COST: "cost of a metre, free ground 1",
}
"""Units of the layers by name."""


@dataclass(frozen=True)
class MapLayers:
    """Local map at one moment, in ``odom``.

    Attributes:
        corner: Corner of the window with the smallest x and y [m], float64, shape (2,).
        cell: Edge of a cell [m].
        lethal_occupancy: Occupancy above which the planner takes a cell for an obstacle.
        layers: Values by the names in ``UNITS``; the first index counts along x, the second along
            y. NaN is unknown. ``occupancy`` is the probability of an obstacle, ``elevation`` the
            mean height of the ground in the last cloud, ``low_obstacle_height`` the height of rocks
            and steps over the ground beside them, ``clearance`` the distance from the nearest
            obstacle, up to the inflation radius, ``cost`` what a metre costs the planner. float32,
            shape (n, n).
    """

    corner: NDArray[np.float64]
    cell: float
    lethal_occupancy: float
    layers: Mapping[str, NDArray[np.float32]]

    def height_at(self, places: NDArray[np.float64], otherwise: float) -> NDArray[np.float64]:
        """Return the elevation at some places [m], shape (k,).

        Args:
            places: Places in ``odom`` [m], shape (k, 2).
            otherwise: Height where none is known [m].
        """
        elevation = self.layers[ELEVATION]
        cells = np.floor((places - self.corner) / self.cell).astype(np.int64)
        inside = ((cells >= 0) & (cells < len(elevation))).all(axis=1)
        heights = np.full(len(places), otherwise)
        known_heights = elevation[cells[inside, 0], cells[inside, 1]]
        heights[inside] = np.where(np.isnan(known_heights), otherwise, known_heights)
        return heights


def map_layers(
    planner: LocalPlanner,
    layers: CartesianLayers | None = None,
    points: NDArray[np.float32] | None = None,
) -> MapLayers:
    """Return the local map of a planner as it is now.

    Args:
        planner: Planner with its occupancy grid and its last plan.
        layers: Layers of the ground, for low obstacles; None without clouds.
        points: Last cloud in ``odom`` [m], float32, shape (n, 3), for the elevation; None without.
    """
    grid, plan = planner.occupancy, planner.plan
    n, cell = len(grid.log_odds), grid.config.cell
    low = grid.centre - n // 2  # First cell of the window, counted from the origin of odom.
    log_odds = unwrapped(grid.log_odds, grid.centre)
    occupancy = np.where(log_odds == 0.0, np.nan, 1.0 / (1.0 + np.exp(-log_odds)))
    # The plan may be some steps older than the grid; before the first all its costs are zero.
    plan_low = np.rint(plan.corner / cell).astype(np.int64)
    is_planned = plan.costs > 0.0
    cost = np.where(is_planned, plan.costs, np.nan)
    clearance = np.where(is_planned, plan.clearance * np.float32(cell), np.nan)
    return MapLayers(
        np.asarray(low * cell, dtype=np.float64),
        cell,
        float(1.0 / (1.0 + np.exp(-grid.config.lethal_log_odds))),
        {
            OCCUPANCY: occupancy.astype(np.float32),
            ELEVATION: _elevation(points, grid.centre, cell, n),
            LOW_OBSTACLES: _low_obstacles(layers, low, n),
            CLEARANCE: shifted(clearance.astype(np.float32), plan_low, low, n),
            COST: shifted(cost.astype(np.float32), plan_low, low, n),
        },
    )


def unwrapped(values: NDArray[np.float32], centre: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return a circular grid in the order of x and y, from its window's first cell on.

    Args:
        values: Contents as in ``RollingGrid``, shape (n, n).
        centre: Cell of the robot, counted from the origin of the frame, shape (2,).
    """
    n = len(values)
    first = (centre - n // 2) & (n - 1)
    return np.roll(values, (-int(first[0]), -int(first[1])), axis=(0, 1))


def shifted(
    values: NDArray[np.float32], low: NDArray[np.int64], into: NDArray[np.int64], n: int
) -> NDArray[np.float32]:
    """Return a layer in another window, NaN where it has no values there, shape (n, n).

    Args:
        values: Layer, shape (m, m).
        low: First cell of its window, counted from the origin of the frame, shape (2,).
        into: First cell of the other window, shape (2,).
        n: Number of cells along an edge of the other window.
    """
    moved = np.full((n, n), np.nan, dtype=np.float32)
    begin = np.maximum(low, into)
    end = np.minimum(low + len(values), into + n)
    if (end > begin).all():
        source = tuple(slice(b - f, e - f) for b, e, f in zip(begin, end, low, strict=True))
        target = tuple(slice(b - f, e - f) for b, e, f in zip(begin, end, into, strict=True))
        moved[target] = values[source]
    return moved


def _elevation(
    points: NDArray[np.float32] | None, centre: NDArray[np.int64], cell: float, n: int
) -> NDArray[np.float32]:
    """Return the mean height of the ground in each cell of the window [m], NaN without points."""
    if points is None or not len(points):
        return np.full((n, n), np.nan, dtype=np.float32)
    grid = ElevationGrid(cell, n)
    middle = np.asarray((centre + 0.5) * cell, dtype=np.float64)
    grid.describe(np.ascontiguousarray(points, dtype=np.float32), middle)
    seen = np.where(grid.table[:, :, POINTS] > 0.0, grid.table[:, :, MEAN], np.nan)
    return unwrapped(seen.astype(np.float32), centre)


def _low_obstacles(
    layers: CartesianLayers | None, low: NDArray[np.int64], n: int
) -> NDArray[np.float32]:
    """Return the height of low obstacles in each cell [m], 0 for none, NaN beyond their window.

    Their cells have half the size: the highest of four counts.
    """
    if layers is None:
        return np.full((n, n), np.nan, dtype=np.float32)
    layer = layers.low_obstacles
    heights = unwrapped(layer.heights, layer.centre)
    fine = shifted(heights, layer.centre - len(heights) // 2, 2 * low, 2 * n)
    return np.maximum.reduce([fine[i::2, j::2] for i in (0, 1) for j in (0, 1)])
