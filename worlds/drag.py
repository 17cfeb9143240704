"""Drag of plants: what a body feels that drives through grass, stands and bushes.

Leaves and stalks of a few millimetres bend and slide along the body: their resistance does not
depend on its speed, and rises with the height to which they stand against it. The numbers are
assumptions; of grass and bushes there is no more than the pull that people and vehicles report.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.classes import SemanticClass
from terrain.kernel import inlined_kernel, kernel
from worlds.footprints import mark_footprints
from worlds.world import World

RESISTANCE = {
    SemanticClass.HIGH_GRASS: 60.0,
    SemanticClass.MEADOW: 40.0,
    SemanticClass.STALKS: 80.0,
    SemanticClass.THICKET: 200.0,
    SemanticClass.BUSH: 250.0,
    SemanticClass.FOLIAGE: 150.0,
}
"""Force of plants on a body per metre of its width and metre of their height [N/m2]
(assumption)."""

BODY_HEIGHT = 0.8
"""Height of the body up to which plants stand against it [m]."""

_UNIT = 2.0
"""Force per metre of width of one step of the map [N/m]."""

SLOWEST = 0.03
"""Speed up to which the force rises [m/s], so that it never turns a motion round."""


class DragMap(NamedTuple):
    """Drag by place.

    Attributes:
        force: Force per metre of width of each cell, in steps of 2 N/m, uint8, shape (n, m); (0, 0)
            where no plant drags.
        x_min: Map x of the first cell's corner [m].
        y_min: Map y of the first cell's corner [m].
        cell: Edge of a cell [m].
    """

    force: NDArray[np.uint8]
    x_min: float
    y_min: float
    cell: float


PERIOD = 10
"""Number of ticks of 10 ms after which the drag is looked up again: a body moves 3 cm in them, a
cell is 10 cm wide."""

NO_DRAG = DragMap(np.zeros((0, 0), dtype=np.uint8), 0.0, 0.0, 1.0)
"""Map of a world without plants that drag."""


def drag_map(world: World) -> DragMap:
    """Return the drag of a world's plants on the cells of its true map.

    Where plants overlap, the strongest one counts.

    Args:
        world: The world.
    """
    plants = [each for each in world.objects if each.semantic in RESISTANCE]
    if not plants:
        return NO_DRAG
    vertices = np.concatenate([each.vertices for each in plants]).astype(np.float64)
    above = vertices[:, 2] - world.ground.height_at(vertices[:, 0], vertices[:, 1])
    begins = np.cumsum([0] + [len(each.vertices) for each in plants[:-1]])
    lows = np.maximum(np.minimum.reduceat(above, begins), 0.0)
    highs = np.minimum(np.maximum.reduceat(above, begins), BODY_HEIGHT)
    rates = np.array([RESISTANCE[each.semantic] for each in plants])
    steps = np.round(np.maximum(highs - lows, 0.0) * rates / _UNIT).astype(np.int64)
    truth = world.truth
    force = np.zeros(truth.reason.shape, dtype=np.uint8)
    corner = truth.x_min + truth.cell / 2, truth.y_min + truth.cell / 2
    for value in np.unique(steps[steps > 0]).tolist():
        below = [plants[k] for k in np.flatnonzero(steps == value)]
        mark_footprints(below, corner, truth.cell, min(value, 255), force)
    return DragMap(force, truth.x_min, truth.y_min, truth.cell) if force.any() else NO_DRAG


@kernel
def drag_at(drag: DragMap, x: float, y: float, c: float, s: float, half: float) -> float:
    """Return the drag on a body per metre of its width [N/m], the mean over five places of it.

    Args:
        drag: Drag by place.
        x: Map x of its middle [m].
        y: Map y of its middle [m].
        c: Cosine of its heading.
        s: Sine of its heading.
        half: Half of its length [m].
    """
    n, m = drag.force.shape
    total = 0.0
    for k in range(5):
        # Along the middle line: what is behind the front has been bent already and still rubs.
        along = half * (k - 2) / 2.0
        i = int((x + c * along - drag.x_min) / drag.cell)
        j = int((y + s * along - drag.y_min) / drag.cell)
        if 0 <= i < n and 0 <= j < m:
            total += drag.force[i, j]
    return _UNIT * total / 5.0


@inlined_kernel
def braking(force: float, speed: float) -> float:
    """Return the force of plants over the speed that it acts against [N s/m].

    Args:
        force: Force on a body that moves [N].
        speed: Size of its velocity [m/s].
    """
    return force / max(speed, SLOWEST)
