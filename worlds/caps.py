"""What of low objects a wheel strikes: the part that rises more than a step above the ground.

A half-buried rock is widest where it leaves the ground. A wheel climbs its foot.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from worlds.traversability_map import Reason
from worlds.truth import TruthConfig
from worlds.world import World


def low_caps(world: World) -> NDArray[np.bool_]:
    """Return the cells of the true map below the caps of low objects, half a cell beyond included.

    Args:
        world: The world.

    Returns:
        True below a cap, shape (n, m).
    """
    truth, config = world.truth, TruthConfig()
    n, m = truth.reason.shape
    below = np.zeros((n, m), dtype=np.bool_)
    if not (truth.reason == Reason.LOW).any():
        return below
    x = truth.x_min + (np.arange(n) + 0.5) * truth.cell
    y = truth.y_min + (np.arange(m) + 0.5) * truth.cell
    grow = truth.cell / 2  # A thin cap between two centres still marks a cell.
    for each in world.objects:
        points = _cap(each, world.ground, config.max_step, config.ground_clearance)
        if len(points) < 3:
            continue
        sides = ConvexHull(points, qhull_options="QJ").equations
        (low_x, low_y), (high_x, high_y) = points.min(axis=0) - grow, points.max(axis=0) + grow
        along = slice(*np.searchsorted(x, [low_x, high_x]))
        across = slice(*np.searchsorted(y, [low_y, high_y]))
        away = sides[:, 0, None, None] * x[along, None] + sides[:, 1, None, None] * y[across]
        below[along, across] |= (away + sides[:, 2, None, None] <= grow).all(axis=0)
    return below


def _cap(body: SceneObject, ground: Heightfield, begin: float, end: float) -> NDArray[np.float64]:
    """Return places around what rises more than a height, as seen from above [m], shape (k, 2).

    Args:
        body: Convex object.
        ground: Ground that it stands on.
        begin: Height above the ground from which on it counts [m].
        end: Height above the ground that no low object reaches [m].

    Returns:
        Places whose convex hull is the outline; none of an object that is higher or lower.
    """
    vertices = body.vertices.astype(np.float64)
    if np.ptp(vertices[:, 2]) > 4 * end:  # Most objects of a world: trees and high rocks.
        return np.empty((0, 2))
    rise = vertices[:, 2] - ground.height_at(vertices[:, 0], vertices[:, 1])
    if not begin < rise.max() < end:
        return np.empty((0, 2))
    # Corners above the height, and where edges pass through it.
    edges = body.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    low, high = edges[(rise[edges[:, 0]] <= begin) & (rise[edges[:, 1]] > begin)].T
    share = ((begin - rise[low]) / (rise[high] - rise[low]))[:, None]
    through = vertices[low] + share * (vertices[high] - vertices[low])
    return np.concatenate([vertices[rise > begin], through])[:, :2]
