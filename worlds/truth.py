"""The true traversability map of a world: slope, step and objects of the true surface.

The ground truth of labels, paths and evaluations. Its limits are an assumption: the paper states
none.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.ndimage import correlate1d

from terrain.classes import TRAITS, SemanticClass
from terrain.heightfield import Heightfield
from terrain.kernel import kernel
from terrain.objects import SceneObject
from worlds.clearance import clearance_map
from worlds.footprints import mark_footprints
from worlds.traversability_map import Reason, TraversabilityMap
from worlds.world import World

_WINDOW = 5
"""Edge of the window of slope and step [cells]."""

_KERB = 1.4
"""Ratio of a kerb's height to its range of residuals about the window's plane, 1 / 0.7."""


class TruthConfig(BaseModel):
    """Limits of the robot on the true surface (assumption).

    Attributes:
        cell: Edge of a cell [m]; five cells, the window of slope and step, span the wheelbase.
        max_slope: Largest traversable slope [rad].
        max_step: Largest traversable step within a wheelbase, and height up to which a wheel
            climbs solid objects [m].
        body_height: Height above ground below which foliage is an obstacle [m].
        ground_clearance: Height of the body's floor [m]; lower solid objects pass under it.
        max_traversable_vegetation: Height up to which plants are crossed [m]
            (``RobotModel.max_traversable_vegetation``).
        border: Width of the forbidden strip along the border [m].
        slope_margin: Difference from ``max_slope`` up to which ground is borderline [rad].
        step_margin: Difference from ``max_step`` up to which ground is borderline [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    cell: float = Field(default=0.1, gt=0, le=0.5)
    max_slope: float = Field(default=np.deg2rad(20.0), gt=0, lt=1.5)
    max_step: float = Field(default=0.05, gt=0, lt=1)
    body_height: float = Field(default=0.9, gt=0)
    ground_clearance: float = Field(default=0.09, gt=0)
    max_traversable_vegetation: float = Field(default=0.15, gt=0, le=1)
    border: float = Field(default=1.0, ge=0)
    slope_margin: float = Field(default=np.deg2rad(3.0), gt=0)
    step_margin: float = Field(default=0.02, gt=0)


def build_truth(
    ground: Heightfield,
    objects: tuple[SceneObject, ...],
    config: TruthConfig,
    surface: NDArray[np.uint8] | None = None,
    base: Heightfield | None = None,
    cover: NDArray[np.uint8] | None = None,
) -> TraversabilityMap:
    """Return the true map of a world.

    Slope and step are those of the ground without what a wheel rolls over; objects stand on the
    ground as it is.

    Args:
        ground: The heightfield.
        objects: Objects on the ground.
        config: Limits of the robot.
        surface: Semantic class of each grid cell of the heightfield, uint8, shape
            (nx - 1, ny - 1); None for plain ground.
        base: The ground without roughness that wheels roll over; None if it has none.
        cover: Height of the low plants on each grid cell [cm], as ``surface``; None for bare
            ground.
    """
    cell = config.cell
    x, y = _centres(ground.width, cell), _centres(ground.depth, cell)
    heights = (base or ground).height_at(x[:, None], y[None, :])
    slope, step = slope_and_step(heights, cell)
    severity = np.maximum(
        (slope - config.max_slope) / config.slope_margin,
        (step - config.max_step) / config.step_margin,
    )
    # The reasons in rising order of precedence: each overwrites those before it.
    reason = np.zeros(slope.shape, dtype=np.uint8)
    reason[step > config.max_step] = Reason.STEP
    reason[slope > config.max_slope] = Reason.SLOPE
    if surface is not None:
        reason[_values_at(surface, ground, x, y) == SemanticClass.WATER] = Reason.WATER
    if cover is not None:
        too_high = _values_at(cover, ground, x, y) > 100 * config.max_traversable_vegetation
        reason[too_high] = Reason.VEGETATION
    reasons = _reasons_of(objects, ground, config)
    for kind in (Reason.VEGETATION, Reason.LOW, Reason.SOLID):
        below = [objects[k] for k in np.flatnonzero(reasons == kind)]
        mark_footprints(below, (x[0], y[0]), cell, kind, reason)
    _mark_border(reason, int(np.ceil(config.border / cell)))
    return TraversabilityMap(
        cell=cell,
        x_min=-ground.width / 2,
        y_min=-ground.depth / 2,
        reason=reason,
        severity=severity.astype(np.float32),
        clearance=clearance_map(reason != Reason.FREE, cell),
    )


def with_vegetation_limit(world: World, limit: float) -> World:
    """Return a world whose true map is that of a robot with another limit of plants.

    Args:
        world: World with the map of the default limit.
        limit: Height up to which the robot crosses plants [m].
    """
    config = TruthConfig(max_traversable_vegetation=limit)
    has_plants = any(TRAITS[each.semantic].by_height for each in world.objects)
    if config == TruthConfig() or not (has_plants or world.cover is not None):
        return world
    truth = build_truth(world.ground, world.objects, config, world.surface, world.base, world.cover)
    return replace(world, truth=truth)


def slope_and_step(
    heights: NDArray[np.float64], cell: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return slope and step of a surface at the scale of a wheelbase.

    The slope is that of the least-squares plane through a window of 5 x 5 cells. The step is 1.4
    times the range of residuals about that plane, which is the height of a kerb through the
    window's middle (assumption).

    Args:
        heights: Heights [m], shape (n, m).
        cell: Distance between neighbouring heights [m].

    Returns:
        Slopes [rad] and steps [m], shape (n, m) each.
    """
    reach = _WINDOW // 2
    offsets = np.arange(-reach, reach + 1.0)
    # Least squares on a regular grid: both gradients and the mean are separable filters.
    weights = offsets / (offsets @ offsets)
    mean = np.full(_WINDOW, 1 / _WINDOW)
    dx = correlate1d(correlate1d(heights, weights, 0, mode="nearest"), mean, 1, mode="nearest")
    dy = correlate1d(correlate1d(heights, weights, 1, mode="nearest"), mean, 0, mode="nearest")
    level = correlate1d(correlate1d(heights, mean, 0, mode="nearest"), mean, 1, mode="nearest")
    spread = _residual_range(heights, level, dx, dy, reach)
    return np.arctan(np.hypot(dx, dy) / cell), _KERB * spread


@kernel
def _residual_range(
    heights: NDArray[np.float64],
    level: NDArray[np.float64],
    dx: NDArray[np.float64],
    dy: NDArray[np.float64],
    reach: int,
) -> NDArray[np.float64]:
    """Return the range of residuals about the plane of each cell's window [m].

    Args:
        heights: Heights [m], shape (n, m).
        level: Height of each window's plane at its centre [m], shape (n, m).
        dx: Rise of the plane per cell along x [m], shape (n, m).
        dy: Rise of the plane per cell along y [m], shape (n, m).
        reach: Half the edge of the window [cells].
    """
    n, m = heights.shape
    spread = np.empty((n, m))
    low, high, padded = np.empty(m), np.empty(m), np.empty(m + 2 * reach)
    for i in range(n):
        low[:], high[:] = np.inf, -np.inf
        for a in range(-reach, reach + 1):
            # Beyond the border, the height of the border.
            row = heights[min(max(i + a, 0), n - 1)]
            padded[:reach], padded[reach : reach + m], padded[reach + m :] = row[0], row, row[-1]
            for b in range(-reach, reach + 1):
                # A whole row at once: such loops are compiled to wide operations.
                shifted = padded[reach + b : reach + b + m]
                for j in range(m):
                    residual = shifted[j] - level[i, j] - a * dx[i, j] - b * dy[i, j]
                    low[j], high[j] = min(low[j], residual), max(high[j], residual)
        spread[i] = high - low
    return spread


def _centres(extent: float, cell: float) -> NDArray[np.floating]:
    """Return the centres of the cells along one side of a map [m], shape (n,)."""
    return -extent / 2 + (np.arange(round(extent / cell)) + 0.5) * cell


def _values_at(
    values: NDArray[np.uint8],
    ground: Heightfield,
    x: NDArray[np.floating],
    y: NDArray[np.floating],
) -> NDArray[np.uint8]:
    """Return the value of the grid cell at each pair of x and y [m], shape (n, m)."""
    column = np.minimum((x + ground.width / 2) / ground.cell, values.shape[0] - 1).astype(int)
    row = np.minimum((y + ground.depth / 2) / ground.cell, values.shape[1] - 1).astype(int)
    return values[column[:, None], row[None, :]]


def _reasons_of(
    objects: tuple[SceneObject, ...], ground: Heightfield, config: TruthConfig
) -> NDArray[np.uint8]:
    """Return why each object forbids its footprint, ``FREE`` if it does not, shape (n,)."""
    if not objects:
        return np.empty(0, dtype=np.uint8)
    lows = np.array([each.vertices[each.vertices[:, 2].argmin()] for each in objects])
    highs = np.array([each.vertices[each.vertices[:, 2].argmax()] for each in objects])
    begins, ends = (end[:, 2] - ground.height_at(end[:, 0], end[:, 1]) for end in (lows, highs))
    for number, each in enumerate(objects):
        if each.semantic == SemanticClass.KERB:
            # Flush with the ground on one side: it rises as much as on the other.
            x, y, z = each.vertices.astype(np.float64).T
            ends[number] = (z - ground.height_at(x, y)).max()
    traits = [TRAITS[each.semantic] for each in objects]
    reasons = np.where(ends < config.ground_clearance, Reason.LOW, Reason.SOLID)
    # What rises less than a step is one that a wheel climbs.
    reasons[ends <= config.max_step] = Reason.FREE
    reasons[[not trait.solid for trait in traits]] = Reason.VEGETATION
    reasons[[trait.traversable for trait in traits]] = Reason.FREE
    for k in np.flatnonzero([trait.by_height for trait in traits]):
        x, y, z = objects[k].vertices.astype(np.float64).T
        # On a slope, the height of the plants on the lower side.
        if (z - ground.height_at(x, y)).max() <= config.max_traversable_vegetation:
            reasons[k] = Reason.FREE
    # The robot passes below an object that begins above its body, such as the crown of a tree.
    reasons[begins >= config.body_height] = Reason.FREE
    return reasons.astype(np.uint8)


def _mark_border(reason: NDArray[np.uint8], edge: int) -> None:
    """Forbid free cells along the border; what is forbidden there keeps its reason.

    Args:
        reason: ``Reason`` of each cell, changed in place, shape (n, m).
        edge: Width of the border [cells].
    """
    if edge:
        for strip in (reason[:edge], reason[-edge:], reason[:, :edge], reason[:, -edge:]):
            strip[strip == Reason.FREE] = Reason.BORDER
