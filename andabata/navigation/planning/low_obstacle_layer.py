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
from traversability.cartesian.rolling_grid import PowerOfTwo, RollingGrid

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
        self._grid = RollingGrid(cell, config.cells, ("points", "sum", "height"))
        self._sums = self._grid.values[:, :, :2]
        self.heights = self._grid["height"]

    @property
    def centre(self) -> NDArray[np.int64]:
        """Cell of the robot at the last cloud, counted from the origin of ``odom``, shape (2,)."""
        return self._grid.centre

    def reset(self) -> None:
        """Forget everything."""
        self._grid.reset()

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
        config, cell = self.config, self._grid.cell
        self._grid.follow(position)
        due = (elevation.ages >= np.float32(ages[0])) & (elevation.ages < np.float32(ages[1]))
        reach = Reach(config.min_range, config.max_range, config.max_height, config.max_points)
        _accumulate(elevation.table, due, self._sums, self.centre, position, cell, reach)
        threshold = Threshold(
            config.min_points, config.min_height, config.roughness_factor, config.decay
        )
        _detect(self._sums, due, threshold, self.heights)


@kernel
def _accumulate(
    table: NDArray[np.float32],
    due: NDArray[np.bool_],
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
    for i in range(centre[0] - half, centre[0] + half + 1):
        for j in range(centre[1] - half, centre[1] + half + 1):
            own = table[i & (n - 1), j & (n - 1)]
            far = np.hypot((i + 0.5) * cell - position[0], (j + 0.5) * cell - position[1])
            in_reach = reach.min_range <= far <= reach.max_range
            if not due[i & (n - 1), j & (n - 1)] or not in_reach:
                continue
            known = 0
            for k in range(len(_PAIRS)):
                a = table[(i + _PAIRS[k, 0]) & (n - 1), (j + _PAIRS[k, 1]) & (n - 1)]
                b = table[(i - _PAIRS[k, 0]) & (n - 1), (j - _PAIRS[k, 1]) & (n - 1)]
                if a[POINTS] > 0 and b[POINTS] > 0:
                    levels[known] = (a[MEAN] + b[MEAN]) / 2
                    known += 1
            if known == 0:
                continue
            height = own[MEAN] - np.median(levels[:known])
            if abs(height) > reach.max_height:
                continue
            seen = sums[i & (n - 1), j & (n - 1)]
            seen[_COUNT] += own[POINTS]
            seen[_SUM] += own[POINTS] * height
            # A long memory would hold on to what drift has smeared: the mean stays, its weight not.
            if seen[_COUNT] > reach.max_points:
                seen[_SUM] *= np.float32(reach.max_points) / seen[_COUNT]
                seen[_COUNT] = reach.max_points


@kernel
def _detect(
    sums: NDArray[np.float32],
    due: NDArray[np.bool_],
    threshold: Threshold,
    heights: NDArray[np.float32],
) -> None:
    """Write the heights of obstacles: higher than the threshold, and than what is around them."""
    n, around = len(sums), 2 * _BESIDE
    least = threshold.min_height
    for i in range(n):
        for j in range(n):
            if not due[i, j]:
                continue
            points, total = sums[i, j]
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
                    other = sums[a & (n - 1), b & (n - 1)]
                    if far >= _BESIDE and other[_COUNT] >= threshold.min_points:
                        rough += abs(other[_SUM] / other[_COUNT])
                        count += 1
            if total > threshold.roughness_factor * points * rough / max(count, 1):
                heights[i, j] = max(heights[i, j], total / points)
