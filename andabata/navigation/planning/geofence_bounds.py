"""Bounds of a geofence, which is straight in the map, as they lie in ``odom``."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.planning.map_transform import MapTransform
from terrain.kernel import kernel
from worlds.world import Geofence


class GeofenceBounds(NamedTuple):
    """A geofence seen from ``odom``.

    Attributes:
        transform: Transform from ``odom`` to the map.
        x_min: Bound in the map [m].
        y_min: Bound in the map [m].
        x_max: Bound in the map [m].
        y_max: Bound in the map [m].
    """

    transform: MapTransform
    x_min: float
    y_min: float
    x_max: float
    y_max: float


EVERYWHERE = GeofenceBounds(MapTransform(), -math.inf, -math.inf, math.inf, math.inf)
"""Bounds of a geofence that holds everything."""


def geofence_in_odom(geofence: Geofence | None, transform: MapTransform) -> GeofenceBounds:
    """Return a geofence of the map as it lies in ``odom``.

    Args:
        geofence: Bounds in the map [m], or None.
        transform: Transform from ``odom`` to the map.
    """
    if geofence is None:
        return EVERYWHERE
    return GeofenceBounds(transform, *map(float, geofence))


@kernel
def clear_outside(
    clearance: NDArray[np.float32], centre: NDArray[np.int64], cell: float, bounds: GeofenceBounds
) -> None:
    """Write 0 into the clearance of cells outside the geofence.

    Args:
        clearance: Clearance of the cells of a square, changed in place, float32, shape (n, n).
        centre: Cell in the middle of it, counted from the origin of ``odom``, shape (2,).
        cell: Edge of a cell [m].
        bounds: Bounds of the geofence.
    """
    n = len(clearance)
    for i in range(n):
        # A row whose ends are inside is inside, and most are.
        begins = _is_inside(i, 0, n, centre, cell, bounds)
        if begins and _is_inside(i, n - 1, n, centre, cell, bounds):
            continue
        for j in range(n):
            if not _is_inside(i, j, n, centre, cell, bounds):
                clearance[i, j] = np.float32(0.0)


@kernel
def _is_inside(
    i: int, j: int, n: int, centre: NDArray[np.int64], cell: float, bounds: GeofenceBounds
) -> bool:
    """Return True if the middle of a cell is inside the geofence."""
    # In odom, then in the map, where the geofence is straight.
    x = (centre[0] - n // 2 + i + 0.5) * cell
    y = (centre[1] - n // 2 + j + 0.5) * cell
    there = bounds.transform
    map_x = there.c * x - there.s * y + there.x
    map_y = there.s * x + there.c * y + there.y
    return bounds.x_min < map_x < bounds.x_max and bounds.y_min < map_y < bounds.y_max
