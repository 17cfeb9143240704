"""Slanted edges of obstacles in rooms: which points are inside, and how far the others are."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

Outline = Sequence[tuple[float, float]]
"""Corners of a closed outline, counter-clockwise around what is solid [m]."""


def outline_edges(outlines: Sequence[Outline]) -> NDArray[np.float64]:
    """Return the edges of outlines: x, y at the begin and at the end [m], shape (n, 4).

    An outline of two corners is a wall without thickness: an edge there and one back.

    Raises:
        ValueError: If an outline has fewer than two corners, or a corner twice in a row.
    """
    rings = [np.zeros((0, 4))]
    for outline in outlines:
        corners = np.array(outline, dtype=np.float64).reshape(-1, 2)
        edges = np.hstack([corners, np.roll(corners, -1, axis=0)])
        if len(corners) < 2 or (edges[:, :2] == edges[:, 2:]).all(axis=1).any():
            raise ValueError(f"outline: expected 2 or more different corners, got {list(outline)}")
        rings.append(edges)
    return np.concatenate(rings)


@kernel
def edge_clearance(x: float, y: float, edges: NDArray[np.float64], count: int) -> float:
    """Return the distance of a point to the nearest edge [m], negative inside of an outline.

    Args:
        x: Place [m].
        y: Place [m].
        edges: Edges of closed outlines, shape (n, 4).
        count: Number of edges that count, the first ones.
    """
    squared, turns = np.inf, 0
    for e in range(count):
        ax, ay = edges[e, 0] - x, edges[e, 1] - y
        bx, by = edges[e, 2] - x, edges[e, 3] - y
        dx, dy = bx - ax, by - ay
        share = min(max(-(ax * dx + ay * dy) / (dx * dx + dy * dy), 0.0), 1.0)
        px, py = ax + share * dx, ay + share * dy
        squared = min(squared, px * px + py * py)
        # Winding number: outlines that overlap are solid together, and one that runs clockwise
        # inside of another is a hole. An edge counts where it crosses the axis to the east.
        side = ax * by - ay * bx
        if ay <= 0.0 < by and side > 0.0:
            turns += 1
        elif by <= 0.0 < ay and side < 0.0:
            turns -= 1
    nearest = np.sqrt(squared)
    return -nearest if turns != 0 else nearest


@kernel
def edge_clearances(
    points: NDArray[np.float64], edges: NDArray[np.float64], clearances: NDArray[np.float64]
) -> None:
    """Lower the clearance of points to that of edges.

    Args:
        points: Points [m], shape (k, 2).
        edges: Edges of closed outlines [m], shape (n, 4).
        clearances: Clearance of each point [m], lowered in place, shape (k,).
    """
    for k in range(len(points)):
        clear = edge_clearance(points[k, 0], points[k, 1], edges, len(edges))
        clearances[k] = min(clearances[k], clear)
