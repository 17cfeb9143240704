"""The ground around a robot: a part of a heightfield that physics engines take instead of all.

The robot feels what lies within a step of it. An engine that is slow with a large heightfield, or
with many objects, holds a window, which is made anew as the robot drives.
"""

import numpy as np

from terrain.heightfield import Heightfield

REACH = 8.0
"""Distance from its middle up to which a window holds the ground [m]."""

_KEPT = 4.0
"""Distance from the middle of its window up to which a robot may drive [m]."""


def has_left(middle: tuple[float, float], x: float, y: float) -> bool:
    """Return true if a robot has come too near to the end of a window.

    Args:
        middle: Place around which the window was made [m].
        x: Map x of the robot [m].
        y: Map y of the robot [m].
    """
    return max(abs(x - middle[0]), abs(y - middle[1])) > _KEPT


def ground_around(
    ground: Heightfield, x: float, y: float
) -> tuple[Heightfield, tuple[float, float]]:
    """Return the ground around a place, up to the border, and where its middle is in the map [m].

    Args:
        ground: The whole ground.
        x: Map x of the place [m].
        y: Map y of the place [m].
    """
    spans = []
    for place, half, count in zip(
        (x, y), (ground.width / 2, ground.depth / 2), ground.heights.shape, strict=True
    ):
        first = int(np.clip((place + half - REACH) / ground.cell, 0, count - 2))
        last = int(np.clip(np.ceil((place + half + REACH) / ground.cell), first + 1, count - 1))
        spans.append((first, last, (first + last) / 2 * ground.cell - half))
    (i, k, middle_x), (j, n, middle_y) = spans
    part = Heightfield(np.ascontiguousarray(ground.heights[i : k + 1, j : n + 1]), ground.cell)
    return part, (middle_x, middle_y)
