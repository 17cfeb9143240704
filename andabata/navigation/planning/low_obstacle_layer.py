"""Low obstacle layer: what stands out of the ground by centimetres, over several clouds.

A rock that no wheel may touch can be ten points of a cloud, too few to make a cell of the virtual
scan blocked. But neighbouring points are measured within a fraction of a second, so that noise
alone moves them against each other, and they are there again in every cloud. Not in the papers
(assumption).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.kernel import kernel
from traversability.cartesian.elevation_grid import ANY_AGE, MEAN, POINTS, ElevationGrid
from traversability.cartesian.rolling_grid import PowerOfTwo, RollingGrid, follow

_BESIDE = 3
"""Number of cells from a cell to those on either side that it is compared with."""

_PAIRS = np.array([[_BESIDE, 0], [0, _BESIDE], [2, 2], [2, -2]])
"""Offsets of the first cell of each pair; the second lies opposite."""

_COUNT, _SUM = range(2)
"""Columns of the sums: number of points, and sum of their heights over the ground [m]."""


class LowObstacleLayerConfig(BaseModel):
    """Settings of the low obstacle layer.

    Attributes:
        cells: Number of cells along an edge of the square around the robot.
        min_range: Range below which points do not count [m].
        max_range: Range beyond which points do not count [m].
        max_height: Height above which something is no low obstacle, but an object or a crown above
            the ground [m]: the virtual scan shows it.
        min_points: Number of points that a cell needs.
        max_points: Largest weight of what a cell has seen, in points.
        min_height: Mean height from which a cell is an obstacle [m]: rocks of 6 cm make a mean of
            2.
        roughness_factor: Ratio of the height to that of what is around from which it counts.
        free_log_odds: Log odds of the ground layer below minus this that overrule: surely free
            ground has no low obstacles.
        decay: Share of its height that an obstacle keeps when a new cloud does not show it: what
            was measured while dead reckoning drifted is smeared over its neighbours.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    cells: PowerOfTwo = Field(default=256, ge=32, le=1024)
    min_range: float = Field(default=0.6, ge=0)
    max_range: float = Field(default=4.0, gt=0)
    max_height: float = Field(default=0.25, gt=0)
    min_points: float = Field(default=6.0, gt=0)
    max_points: float = Field(default=100.0, gt=0)
    min_height: float = Field(default=0.018, gt=0)
    roughness_factor: float = Field(default=5.0, ge=0)
    free_log_odds: float = Field(default=2.0, ge=0)
    decay: float = Field(default=0.7, ge=0, lt=1)


class Reach(NamedTuple):
    """Points that count; see ``LowObstacleLayerConfig``.

    Attributes:
        min_range: Least range [m].
        max_range: Largest range [m].
        max_height: Largest height [m].
        max_points: Largest weight of a cell, in points.
    """

    min_range: float
    max_range: float
    max_height: float
    max_points: float


class Threshold(NamedTuple):
    """Conditions of an obstacle; see ``LowObstacleLayerConfig``.

    Attributes:
        min_points: Number of points that a cell needs.
        min_height: Least mean height [m].
        roughness_factor: Least ratio to the heights around.
        decay: Share of the height that is kept without a new measurement.
    """

    min_points: float
    min_height: float
    roughness_factor: float
    decay: float


class _Memory(NamedTuple):
    """Memory of the layer, wrapped around.

    Attributes:
        sums: Number of points and sum of their heights in each cell, shape (n, n, 2).
        centre: Cell of the robot, shape (2,).
        heights: Heights of obstacles [m], shape (n, n).
        heights_centre: Cell of the robot where heights are kept, shape (2,).
    """

    sums: NDArray[np.float32]
    centre: NDArray[np.int64]
    heights: NDArray[np.float32]
    heights_centre: NDArray[np.int64]


class LowObstacleLayer:
    """Remembers how far the ground stands out, in a square that moves with the robot, in ``odom``.

    Attributes:
        heights: Height of each cell over the ground on either side of it [m], 0 where that is no
            obstacle; wrapped around, float32, shape (n, n).
    """

    def __init__(self, cell: float, config: LowObstacleLayerConfig) -> None:
        """Begin empty.

        Args:
            cell: Edge of a cell [m].
            config: Settings.
        """
        self.config = config
        self._grid = RollingGrid(cell, config.cells, ("points", "sum"))
        # Heights are looked through as a whole: they have memory of their own.
        self._heights = RollingGrid(cell, config.cells, ("height",))
        self.heights = self._heights["height"]
        grid, heights = self._grid, self._heights
        self._memory = _Memory(grid.values, grid.centre, self.heights, heights.centre)
        self._reach = Reach(
            config.min_range, config.max_range, config.max_height, config.max_points
        )
        self._threshold = Threshold(
            config.min_points, config.min_height, config.roughness_factor, config.decay
        )

    @property
    def centre(self) -> NDArray[np.int64]:
        """Cell of the robot at the last cloud, counted from the origin of ``odom``, shape (2,)."""
        return self._grid.centre

    def reset(self) -> None:
        """Forget everything."""
        self._grid.reset()
        self._heights.reset()

    def update(
        self,
        elevation: ElevationGrid,
        position: NDArray[np.float64],
        ages: tuple[float, float] = ANY_AGE,
    ) -> None:
        """Take in a cloud.

        Args:
            elevation: Elevation grid of the cloud in ``odom``, with as many cells, as large.
            position: Position of the robot there [m], shape (2,).
            ages: Ages of the cells that count [s]: from the first on, less than the second.
        """
        _update(
            *(elevation.hit, elevation.ages, elevation.table, ages, position),
            *(self._grid.cell, self._memory, self._reach, self._threshold),
        )


@kernel
def _update(
    hit: NDArray[np.uint32],
    ages: NDArray[np.float32],
    table: NDArray[np.float32],
    span: tuple[float, float],
    position: NDArray[np.float64],
    cell: float,
    memory: _Memory,
    reach: Reach,
    threshold: Threshold,
) -> None:
    """Move the layer to the robot and take in a cloud.

    Args:
        hit: Rows and columns of the cells that points fell into; see ``ElevationGrid``.
        ages: Age of each cell [s].
        table: Columns of each cell.
        span: Ages of the cells that count [s], from the first on and below the second.
        position: Position of the robot [m], shape (2,).
        cell: Edge of a cell [m].
        memory: Memory of the layer, changed in place.
        reach: Points that count.
        threshold: Conditions of an obstacle.
    """
    follow(memory.sums, memory.centre, position, cell)
    follow(memory.heights, memory.heights_centre, position, cell)
    due = _find_due(hit, ages, (np.float32(span[0]), np.float32(span[1])))
    _accumulate(table, due, memory.sums, memory.centre, position, cell, reach)
    _detect(memory.sums, due, threshold, memory.heights)


@kernel
def _find_due(
    hit: NDArray[np.uint32], ages: NDArray[np.float32], span: tuple[np.float32, np.float32]
) -> NDArray[np.uint32]:
    """Return rows and columns of the cells that count, shape (k, 2).

    Args:
        hit: Rows and columns of the cells that points fell into.
        ages: Age of each cell [s].
        span: Ages of the cells that count [s], from the first on and below the second.
    """
    due, count = np.empty_like(hit), 0
    for k in range(len(hit)):
        if span[0] <= ages[hit[k, 0], hit[k, 1]] < span[1]:
            due[count, 0], due[count, 1] = hit[k, 0], hit[k, 1]
            count += 1
    return due[:count]


@kernel
def _accumulate(
    table: NDArray[np.float32],
    due: NDArray[np.uint32],
    sums: NDArray[np.float32],
    centre: NDArray[np.int64],
    position: NDArray[np.float64],
    cell: float,
    reach: Reach,
) -> None:
    """Add the heights of cells over those on either side: number of points, and their sum.

    The mean of two cells on either side is the ground's height between them, on slopes too; of the
    four pairs the median counts, so that the next rock does no harm.
    """
    n = len(table)
    half = min(int(reach.max_range / cell), n // 2 - _BESIDE - 1)
    levels = np.empty(len(_PAIRS))
    for q in range(len(due)):
        u, v = due[q, 0], due[q, 1]
        # Cells from the robot's, which tell those of the window from what is wrapped around.
        a = ((u - centre[0] + n // 2) & (n - 1)) - n // 2
        b = ((v - centre[1] + n // 2) & (n - 1)) - n // 2
        dx = (centre[0] + a + 0.5) * cell - position[0]
        dy = (centre[1] + b + 0.5) * cell - position[1]
        in_reach = reach.min_range**2 <= dx * dx + dy * dy <= reach.max_range**2
        if not in_reach or abs(a) > half or abs(b) > half:
            continue
        known = 0
        for k in range(len(_PAIRS)):
            du, dv = _PAIRS[k, 0], _PAIRS[k, 1]
            one, other = (u + du) & (n - 1), (u - du) & (n - 1)
            beside, beyond = (v + dv) & (n - 1), (v - dv) & (n - 1)
            if table[one, beside, POINTS] > 0 and table[other, beyond, POINTS] > 0:
                levels[known] = (table[one, beside, MEAN] + table[other, beyond, MEAN]) / 2
                known += 1
        if known == 0:
            continue
        points, height = table[u, v, POINTS], table[u, v, MEAN] - _median(levels[:known])
        if abs(height) > reach.max_height:
            continue
        sums[u, v, _COUNT] += points
        sums[u, v, _SUM] += points * height
        # A long memory would hold on to what drift has smeared: the mean stays, its weight not.
        if sums[u, v, _COUNT] > reach.max_points:
            sums[u, v, _SUM] *= np.float32(reach.max_points) / sums[u, v, _COUNT]
            sums[u, v, _COUNT] = reach.max_points


@kernel
def _median(values: NDArray[np.float64]) -> float:
    """Return the median of a few values, which are put in order."""
    for k in range(1, len(values)):
        value, place = values[k], k
        while place > 0 and values[place - 1] > value:
            values[place] = values[place - 1]
            place -= 1
        values[place] = value
    half = len(values) // 2
    return (values[half] + values[(len(values) - 1) // 2]) / 2


@kernel
def _detect(
    sums: NDArray[np.float32],
    due: NDArray[np.uint32],
    threshold: Threshold,
    heights: NDArray[np.float32],
) -> None:
    """Write the heights of obstacles: higher than the threshold, and than what is around them."""
    n, around = len(sums), 2 * _BESIDE
    least = threshold.min_height
    for q in range(len(due)):
        i, j = int(due[q, 0]), int(due[q, 1])  # Signed: places around begin below 0.
        points, total = sums[i, j, _COUNT], sums[i, j, _SUM]
        # What was an obstacle fades where the new cloud shows none.
        kept = np.float32(threshold.decay) * heights[i, j]
        heights[i, j] = kept if points > 0 and kept > least / 2 else np.float32(0.0)
        if points < threshold.min_points or total < least * points:
            continue
        # Mean absolute height of the cells around, but not of those that it lies on.
        rough, count = 0.0, 0
        for a in range(i - around, i + around + 1):
            for b in range(j - around, j + around + 1):
                far = max(abs(a - i), abs(b - j))
                u, v = a & (n - 1), b & (n - 1)
                if far >= _BESIDE and sums[u, v, _COUNT] >= threshold.min_points:
                    rough += abs(sums[u, v, _SUM] / sums[u, v, _COUNT])
                    count += 1
        if total > threshold.roughness_factor * points * rough / max(count, 1):
            heights[i, j] = max(heights[i, j], total / points)
