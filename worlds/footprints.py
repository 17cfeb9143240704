"""Footprints of objects on the cells of a grid map."""

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from terrain.objects import SceneObject


def mark_footprints(
    objects: Iterable[SceneObject],
    corner: tuple[float, float],
    cell: float,
    value: int,
    raster: NDArray[np.uint8],
) -> None:
    """Write a value into the cells below objects, half a cell beyond their edges included.

    Args:
        objects: Objects, whose triangles are projected onto the ground.
        corner: Map x and y of the centre of cell ``[0, 0]`` [m].
        cell: Edge of a cell [m].
        value: Value to write, 0 to 255.
        raster: Cells, changed in place, uint8, shape (n, m).
    """
    meshes = [each.vertices[each.triangles][:, :, :2].astype(np.float64) for each in objects]
    if meshes:
        _rasterise(np.concatenate(meshes), *corner, cell, np.uint8(value), raster)


@kernel
def _rasterise(
    triangles: NDArray[np.float64],
    x0: float,
    y0: float,
    cell: float,
    value: np.uint8,
    raster: NDArray[np.uint8],
) -> None:
    """Write ``value`` into the cells whose centre is in a triangle enlarged by half a cell.

    Args:
        triangles: Corners [m], shape (k, 3, 2).
        x0: Map x of the centre of cell ``[0, 0]`` [m].
        y0: Map y of the centre of cell ``[0, 0]`` [m].
        cell: Edge of a cell [m].
        value: Value to write.
        raster: Output, uint8, shape (n, m).
    """
    n, m = raster.shape
    grow = cell / 2  # A thin object between two centres still marks a cell.
    for t in range(len(triangles)):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if abs(area) < 1e-12:
            continue
        if area < 0:  # Counter-clockwise, so that the inside is to the left of each edge.
            b, c = c, b
        low_i = max(int((min(a[0], b[0], c[0]) - grow - x0) / cell), 0)
        high_i = min(int((max(a[0], b[0], c[0]) + grow - x0) / cell) + 2, n)
        low_j = max(int((min(a[1], b[1], c[1]) - grow - y0) / cell), 0)
        high_j = min(int((max(a[1], b[1], c[1]) + grow - y0) / cell) + 2, m)
        for i in range(low_i, high_i):
            for j in range(low_j, high_j):
                x, y = x0 + i * cell, y0 + j * cell
                if (
                    _side(a, b, x, y) >= -grow
                    and _side(b, c, x, y) >= -grow
                    and _side(c, a, x, y) >= -grow
                ):
                    raster[i, j] = value


@kernel
def _side(p: NDArray[np.float64], q: NDArray[np.float64], x: float, y: float) -> float:
    """Return the signed distance of a place from the line p-q [m], positive to its left."""
    dx, dy = q[0] - p[0], q[1] - p[1]
    return (dx * (y - p[1]) - dy * (x - p[0])) / max(np.hypot(dx, dy), 1e-9)
