"""The true traversability map of a world: slope, step and objects of the true surface.

The ground truth of labels, paths and evaluations. Its limits are an assumption: the paper states
none.
"""

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.ndimage import correlate1d, distance_transform_edt

from terrain.classes import TRAITS, SemanticClass
from terrain.heightfield import Heightfield
from terrain.kernel import kernel
from terrain.objects import SceneObject
from worlds.paths import cost_to_go, shortest_path

Floats = NDArray[np.floating]
_WINDOW = 5
"""Edge of the window of slope and step [cells]."""

_KERB = 1.4
"""Ratio of a kerb's height to its range of residuals about the window's plane, 1 / 0.7."""


class Reason(IntEnum):
    """The reason why a place is forbidden.

    ``LOW`` is a solid object that ends below the body's floor: it can pass between the wheels.
    """

    FREE = 0
    SOLID = 1
    VEGETATION = 2
    SLOPE = 3
    STEP = 4
    BORDER = 5
    WATER = 6
    LOW = 7


class TruthConfig(BaseModel):
    """Limits of the robot on the true surface (assumption).

    Attributes:
        cell: Edge of a cell [m]; five cells, the window of slope and step, span the wheelbase.
        max_slope: Largest traversable slope [rad].
        max_step: Largest traversable step within a wheelbase [m].
        body_height: Height above ground below which foliage is an obstacle [m].
        ground_clearance: Height of the body's floor [m]; lower solid objects pass under it.
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
    border: float = Field(default=1.0, ge=0)
    slope_margin: float = Field(default=np.deg2rad(3.0), gt=0)
    step_margin: float = Field(default=0.02, gt=0)


@dataclass(frozen=True)
class TraversabilityMap:
    """A grid map of the reasons why places are forbidden.

    Cell ``[ix, iy]`` is centred at ``x_min + (ix + 0.5) * cell``, ``y_min + (iy + 0.5) * cell``.

    Attributes:
        cell: Edge of a cell [m].
        x_min: Least map x [m].
        y_min: Least map y [m].
        reason: ``Reason`` of each cell, uint8, shape (n, m).
        severity: Excess of slope or step of the bare ground over its limit, the worse of the two,
            in units of the margins of ``TruthConfig``: more than 0 is forbidden, -1 to 1 is
            borderline. float32, shape (n, m).
        clearance: Distance to the nearest forbidden cell [m], float32, shape (n, m).
    """

    cell: float
    x_min: float
    y_min: float
    reason: NDArray[np.uint8]
    severity: NDArray[np.float32]
    clearance: NDArray[np.float32]

    def _index(self, x: Floats | float, y: Floats | float) -> tuple[NDArray[np.intp], ...]:
        """Return the cell indices of places [m]; beyond the border, those of the border."""
        n, m = self.reason.shape
        i = np.clip((np.asarray(x) - self.x_min) / self.cell, 0, n - 1).astype(np.intp)
        j = np.clip((np.asarray(y) - self.y_min) / self.cell, 0, m - 1).astype(np.intp)
        return i, j

    def reason_at(self, x: Floats | float, y: Floats | float) -> NDArray[np.uint8]:
        """Return the ``Reason`` at map places [m], same shape as ``x``."""
        return self.reason[self._index(x, y)]

    def forbidden_at(self, x: Floats | float, y: Floats | float) -> NDArray[np.bool_]:
        """Return True at each forbidden map place [m], same shape as ``x``."""
        return self.reason_at(x, y) != Reason.FREE

    def solid_at(self, x: Floats | float, y: Floats | float) -> NDArray[np.bool_]:
        """Return True at each map place [m] with a solid object, same shape as ``x``."""
        return np.isin(self.reason_at(x, y), (Reason.SOLID, Reason.LOW))

    def clearance_at(self, x: Floats | float, y: Floats | float) -> NDArray[np.float32]:
        """Return the distance from map places [m] to the nearest forbidden cell [m]."""
        return self.clearance[self._index(x, y)]

    def at(self, x: float, y: float) -> tuple[bool, float]:
        """Return True if one place [m] is forbidden, and its clearance [m].

        Much faster for one place than ``forbidden_at`` and ``clearance_at``.
        """
        n, m = self.reason.shape
        i = min(max(int((x - self.x_min) / self.cell), 0), n - 1)
        j = min(max(int((y - self.y_min) / self.cell), 0), m - 1)
        # Whole numbers: comparing an array's own with a member of an enumeration takes far longer.
        return int(self.reason[i, j]) != int(Reason.FREE), float(self.clearance[i, j])

    def severity_of(
        self, points: NDArray[np.floating], classes: NDArray[np.integer]
    ) -> NDArray[np.float32]:
        """Return the severity of points, by their class and, on ground, by slope and step.

        Args:
            points: Points in the map frame [m], shape (n, 3).
            classes: Semantic class of each point, uint8, shape (n,).

        Returns:
            Severity of each point, float32, shape (n,): more than 0 is non-traversable. On ground
            it is interpolated between the cells' centres; on other classes it is infinite, or
            minus infinite if the class is traversable.
        """
        table = np.full(256, np.float32(np.inf))
        for semantic, traits in TRAITS.items():
            table[semantic] = -np.inf if traits.traversable else np.inf
        table[[SemanticClass.GROUND, SemanticClass.PATH]] = np.nan
        severity = table[classes]
        _fill_severity(points, (self.x_min, self.y_min, self.cell), self.severity, severity)
        return severity

    def forbidden_under(self, points: NDArray[np.floating]) -> NDArray[np.bool_]:
        """Return which points lie at forbidden places, as ``forbidden_at`` does, and faster.

        Args:
            points: Points in the map frame [m], shape (n, 3).
        """
        found = np.empty(len(points), dtype=np.bool_)
        _fill_forbidden(points, (self.x_min, self.y_min, self.cell), self.reason, found)
        return found

    def shortest_path(
        self, start: Floats, goal: Floats, clearance: float
    ) -> NDArray[np.float64] | None:
        """Return the shortest safe path from ``start`` to ``goal`` [m], or None.

        Args:
            start: Map coordinates [m], shape (2,).
            goal: Map coordinates [m], shape (2,).
            clearance: Least distance to forbidden cells [m].

        Returns:
            Corners of the path [m], float64, shape (k, 2), from ``start`` to ``goal``, or None if
            there is no path.
        """
        origin = np.array([self.x_min, self.y_min])
        path = shortest_path(
            self.clearance,
            self.cell,
            (np.asarray(start, dtype=np.float64) - origin) / self.cell,
            (np.asarray(goal, dtype=np.float64) - origin) / self.cell,
            clearance,
        )
        return None if path is None else path * self.cell + origin

    def cost_to_go(
        self, goal: Floats, min_clearance: float, clearance_weight: float
    ) -> Callable[[Floats, Floats], NDArray[np.float64]]:
        """Return the cost-to-go to ``goal`` as a function of map places x, y [m].

        Args:
            goal: Map coordinates [m], shape (2,).
            min_clearance: Desired clearance [m]; a metre with less costs 50 more.
            clearance_weight: Extra cost per metre for each metre of clearance short of one metre.
        """
        origin = np.array([self.x_min, self.y_min])
        place = (np.asarray(goal, dtype=np.float64) - origin) / self.cell
        costs, factor = cost_to_go(
            self.clearance, self.cell, place, min_clearance, clearance_weight
        )
        last = np.array(costs.shape) - 1

        def at(x: Floats, y: Floats) -> NDArray[np.float64]:
            """Return the cost-to-go at places [m]; beyond the border, that of the border."""
            edge = self.cell * factor
            i = np.clip((x - self.x_min) / edge, 0, last[0]).astype(np.intp)
            j = np.clip((y - self.y_min) / edge, 0, last[1]).astype(np.intp)
            return costs[i, j]

        return at


@kernel
def _fill_severity(
    points: NDArray[np.floating],
    frame: tuple[float, float, float],
    known: NDArray[np.float32],
    severity: NDArray[np.float32],
) -> None:
    """Replace NaN by the bilinear interpolation between the centres of a map's cells.

    Args:
        points: Points in the map frame [m], shape (k, 3).
        frame: Least map x and y, and edge of a cell [m].
        known: Severity of the map's cells, shape (n, m).
        severity: Severity of the points, changed in place, shape (k,).
    """
    x_min, y_min, cell = frame
    n, m = known.shape
    for k in range(len(points)):
        if not np.isnan(severity[k]):
            continue
        # Beyond the border, that of the border.
        u = min(max(0.0, (points[k, 0] - x_min) / cell - 0.5), n - 1.0)
        v = min(max(0.0, (points[k, 1] - y_min) / cell - 0.5), m - 1.0)
        i, j = min(int(u), n - 2), min(int(v), m - 2)
        u, v = u - i, v - j
        near = known[i, j] * (1 - u) * (1 - v) + known[i, j + 1] * (1 - u) * v
        severity[k] = near + known[i + 1, j] * u * (1 - v) + known[i + 1, j + 1] * u * v


@kernel
def _fill_forbidden(
    points: NDArray[np.floating],
    frame: tuple[float, float, float],
    reason: NDArray[np.uint8],
    found: NDArray[np.bool_],
) -> None:
    """Write which points lie in cells with a reason to be forbidden.

    Args:
        points: Points in the map frame [m], shape (k, 3).
        frame: Least map x and y, and edge of a cell [m].
        reason: ``Reason`` of the map's cells, shape (n, m).
        found: Output, shape (k,).
    """
    x_min, y_min, cell = frame
    n, m = reason.shape
    free = np.uint8(Reason.FREE)
    for k in range(len(points)):
        # Beyond the border, that of the border.
        i = np.uint64(min(max(0.0, (points[k, 0] - x_min) / cell), n - 1.0))
        j = np.uint64(min(max(0.0, (points[k, 1] - y_min) / cell), m - 1.0))
        found[k] = reason[i, j] != free


def build_truth(
    ground: Heightfield,
    objects: tuple[SceneObject, ...],
    config: TruthConfig,
    surface: NDArray[np.uint8] | None = None,
) -> TraversabilityMap:
    """Return the true map of a world.

    Args:
        ground: The heightfield.
        objects: Objects on the ground.
        config: Limits of the robot.
        surface: Semantic class of each grid cell of the heightfield, uint8, shape
            (nx - 1, ny - 1); None for plain ground.
    """
    cell = config.cell
    n, m = round(ground.width / cell), round(ground.depth / cell)
    x = -ground.width / 2 + (np.arange(n) + 0.5) * cell
    y = -ground.depth / 2 + (np.arange(m) + 0.5) * cell
    heights = ground.height_at(x[:, None], y[None, :])
    slope, step = slope_and_step(heights, cell)
    reason = np.zeros((n, m), dtype=np.uint8)
    # The reasons in rising order of precedence: each overwrites those before it.
    reason[step > config.max_step] = Reason.STEP
    reason[slope > config.max_slope] = Reason.SLOPE
    severity = np.maximum(
        (slope - config.max_slope) / config.slope_margin,
        (step - config.max_step) / config.step_margin,
    )
    if surface is not None:
        column = np.minimum((x + ground.width / 2) / ground.cell, surface.shape[0] - 1).astype(int)
        row = np.minimum((y + ground.depth / 2) / ground.cell, surface.shape[1] - 1).astype(int)
        reason[surface[column[:, None], row[None, :]] == SemanticClass.WATER] = Reason.WATER
    reasons = _reasons_of(objects, ground, config)
    for kind in (Reason.VEGETATION, Reason.LOW, Reason.SOLID):
        meshes = [_projected(objects[k]) for k in np.flatnonzero(reasons == kind)]
        if meshes:
            _rasterise(np.concatenate(meshes), x[0], y[0], cell, np.uint8(kind), reason)
    # The border hides nothing: what is forbidden there keeps its reason.
    edge = int(np.ceil(config.border / cell))
    if edge:
        for strip in (reason[:edge], reason[-edge:], reason[:, :edge], reason[:, -edge:]):
            strip[strip == Reason.FREE] = Reason.BORDER
    clearance = distance_transform_edt(reason == Reason.FREE) * cell
    return TraversabilityMap(
        cell=cell,
        x_min=-ground.width / 2,
        y_min=-ground.depth / 2,
        reason=reason,
        severity=severity.astype(np.float32),
        clearance=clearance.astype(np.float32),
    )


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
    for i in range(n):
        for j in range(m):
            low, high = np.inf, -np.inf
            for a in range(-reach, reach + 1):
                p = min(max(i + a, 0), n - 1)  # Beyond the border, that of the border.
                for b in range(-reach, reach + 1):
                    q = min(max(j + b, 0), m - 1)
                    residual = heights[p, q] - level[i, j] - a * dx[i, j] - b * dy[i, j]
                    low, high = min(low, residual), max(high, residual)
            spread[i, j] = high - low
    return spread


def _reasons_of(
    objects: tuple[SceneObject, ...], ground: Heightfield, config: TruthConfig
) -> NDArray[np.uint8]:
    """Return why each object forbids its footprint, ``FREE`` if it does not, shape (n,)."""
    if not objects:
        return np.empty(0, dtype=np.uint8)
    lows = np.array([each.vertices[each.vertices[:, 2].argmin()] for each in objects])
    highs = np.array([each.vertices[each.vertices[:, 2].argmax()] for each in objects])
    begins, ends = (end[:, 2] - ground.height_at(end[:, 0], end[:, 1]) for end in (lows, highs))
    traits = [TRAITS[each.semantic] for each in objects]
    reasons = np.where(ends < config.ground_clearance, Reason.LOW, Reason.SOLID)
    reasons[[not trait.solid for trait in traits]] = Reason.VEGETATION
    reasons[[trait.traversable for trait in traits]] = Reason.FREE
    # The robot passes below an object that begins above its body, such as the crown of a tree.
    reasons[begins >= config.body_height] = Reason.FREE
    return reasons.astype(np.uint8)


def _projected(each: SceneObject) -> NDArray[np.float64]:
    """Return an object's triangles projected onto the ground [m], shape (k, 3, 2)."""
    return each.vertices[each.triangles][:, :, :2].astype(np.float64)


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
