"""Distances from points in a square, and how much clearance a body has in it.

Many poses are asked for few points: the distances are written once, each pose looks up ten places.
The body's box is filled with six discs that touch its sides, and its corners count by themselves.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.planar.footprint import Corners
from terrain.kernel import kernel


class ClearanceField(NamedTuple):
    """Distances from the nearest point, at the middles of cells.

    Attributes:
        distances: Distances [m], float32, shape (n, n).
        x: Place of the first cell's middle [m].
        y: Place of the first cell's middle [m].
        cell: Edge of a cell [m].
        far: Distance from which on points do not count [m].
    """

    distances: NDArray[np.float32]
    x: float
    y: float
    cell: float
    far: float


def clearance_field(
    points: NDArray[np.float64],
    centre: tuple[float, float],
    half: float,
    cell: float = 0.05,
    far: float = 0.6,
) -> ClearanceField:
    """Return the distances from points in a square.

    Args:
        points: Places [m], shape (k, 2).
        centre: Middle of the square [m].
        half: Half of its edge [m].
        cell: Edge of a cell [m].
        far: Distance from which on points do not count [m].
    """
    n = 2 * int(np.ceil(half / cell))
    low = (n - 1) / 2 * cell
    field = ClearanceField(
        np.full((n, n), far, dtype=np.float32), centre[0] - low, centre[1] - low, cell, far
    )
    _write(np.ascontiguousarray(points, dtype=np.float64), field)
    return field


def body_discs(footprint: Corners) -> NDArray[np.float64]:
    """Return x, y and radius of discs, and of points of radius 0, that stand for a body [m].

    Args:
        footprint: Corners of the body; the box around them counts.
    """
    x0, x1 = min(x for x, _ in footprint), max(x for x, _ in footprint)
    y0, y1 = min(y for _, y in footprint), max(y for _, y in footprint)
    radius = min((y1 - y0) / 4, (x1 - x0) / 2)
    discs = [
        (x, y, radius)
        for x in (x0 + radius, (x0 + x1) / 2, x1 - radius)
        for y in (y0 + radius, y1 - radius)
    ]
    discs += [(x, y, 0.0) for x in (x0, x1) for y in (y0, y1)]
    return np.array(discs)


@kernel
def _write(points: NDArray[np.float64], field: ClearanceField) -> None:
    """Lower the distances of a field to those from points [m], shape (k, 2)."""
    n, reach = len(field.distances), field.far / field.cell
    for k in range(len(points)):
        x, y = (points[k, 0] - field.x) / field.cell, (points[k, 1] - field.y) / field.cell
        if not (-reach < x < n + reach and -reach < y < n + reach):
            continue
        for i in range(max(int(np.ceil(x - reach)), 0), min(int(x + reach) + 1, n)):
            for j in range(max(int(np.ceil(y - reach)), 0), min(int(y + reach) + 1, n)):
                away = np.sqrt((i - x) * (i - x) + (j - y) * (j - y)) * field.cell
                if away < field.distances[i, j]:
                    field.distances[i, j] = away


@kernel
def clearance_at(x: float, y: float, field: ClearanceField) -> float:
    """Return the distance of a place from the nearest point [m], bilinear; ``far`` outside."""
    n = len(field.distances)
    p, q = (x - field.x) / field.cell, (y - field.y) / field.cell
    i, j = int(np.floor(p)), int(np.floor(q))
    if not (0 <= i < n - 1 and 0 <= j < n - 1):
        return field.far
    p, q = p - i, q - j
    d = field.distances
    low = d[i, j] * (1.0 - q) + d[i, j + 1] * q
    high = d[i + 1, j] * (1.0 - q) + d[i + 1, j + 1] * q
    return low * (1.0 - p) + high * p


@kernel
def body_clearance(
    x: float, y: float, yaw: float, discs: NDArray[np.float64], field: ClearanceField
) -> float:
    """Return the least distance of a body from the points [m], negative if one is inside.

    Args:
        x: Position of the body in the field's frame [m].
        y: Position of the body [m].
        yaw: Heading [rad].
        discs: Discs of ``body_discs``, shape (d, 3).
        field: Distances.
    """
    c, s = np.cos(yaw), np.sin(yaw)
    nearest = np.inf
    for k in range(len(discs)):
        px = x + c * discs[k, 0] - s * discs[k, 1]
        py = y + s * discs[k, 0] + c * discs[k, 1]
        nearest = min(nearest, clearance_at(px, py, field) - discs[k, 2])
    return nearest
