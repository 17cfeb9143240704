"""Ground layer: log odds of each ground cell around the robot for being non-traversable."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.kernel import kernel
from traversability.cartesian.classifier import GroundClassifier
from traversability.cartesian.elevation_grid import ANY_AGE, ElevationGrid
from traversability.cartesian.features import GROUND_FEATURES, GroundFeatures
from traversability.cartesian.rolling_grid import RollingGrid
from traversability.cartesian.windows import EDGE_CELLS

_RANGE = GROUND_FEATURES.index("range")


class GroundLayerConfig(BaseModel):
    """Settings of the ground layer.

    Attributes:
        memory: Weight of the log odds so far beside those of a new cloud.
        max_log_odds: Largest log odds that are remembered.
        miss_cost: Cost of a blocked cell that is called free, in false alarms, up to
            ``near_range``.
        near_range: Range beyond which cells are called by what is likelier [m]: they are seen again
            before the robot is there.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    memory: float = Field(default=0.5, ge=0, lt=1)
    max_log_odds: float = Field(default=4.0, gt=0)
    miss_cost: float = Field(default=4.0, gt=0)
    near_range: float = Field(default=5.0, ge=0)


class _Weights(NamedTuple):
    """Weights of memory and verdicts; see ``GroundLayerConfig``.

    Attributes:
        memory: Weight of the log odds so far.
        max_log_odds: Largest log odds that are remembered.
        near: Log odds that are added to a verdict near the robot.
        near_range: Range up to which they are added [m].
    """

    memory: float
    max_log_odds: float
    near: float
    near_range: float


class GroundLayer:
    """Accumulates the classifier's verdicts on ground cells over several clouds, in ``odom``.

    Attributes:
        log_odds: Log odds of each cell for being non-traversable, misses weighted, up to
            ``max_log_odds``; 0 where nothing was seen. Wrapped around, float32, shape (n, n).
    """

    def __init__(self, cells: int, classifier: GroundClassifier, config: GroundLayerConfig) -> None:
        """Begin empty.

        Args:
            cells: Number of cells along the edge of the square.
            classifier: Classifier of ground cells.
            config: Settings.
        """
        self._weights = _Weights(
            memory=config.memory,
            max_log_odds=config.max_log_odds,
            # A miss near the robot costs more than a false alarm: decide rather for blocked.
            near=math.log(config.miss_cost),
            near_range=config.near_range,
        )
        self._classifier = classifier
        self._features = GroundFeatures()
        self._grid = RollingGrid(EDGE_CELLS * classifier.cell, cells, ("log_odds",))
        self.log_odds = self._grid["log_odds"]

    @property
    def max_log_odds(self) -> float:
        """Largest log odds."""
        return self._weights.max_log_odds

    @property
    def cell(self) -> float:
        """Edge of a cell [m]."""
        return self._grid.cell

    @property
    def centre(self) -> NDArray[np.int64]:
        """Cell of the robot, counted from the origin of ``odom``, shape (2,)."""
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
        """Take in the ground cells of a cloud.

        Args:
            elevation: Elevation grid of the cloud in ``odom``.
            position: Position of the robot there [m], shape (2,).
            ages: Ages of the cells that count [s], from the first on, less than the second; see
                ``GroundFeatures.describe``.
        """
        features = self._features
        features.describe(elevation, position, ages)
        verdicts = self._classifier.log_odds(features.values, features.cells, features.due)
        self.follow(position)
        ranges = features.values[:, _RANGE]
        _accumulate(self.log_odds, features.cells, features.due, ranges, verdicts, self._weights)

    def follow(self, position: NDArray[np.float64]) -> None:
        """Move the square to the robot and forget what it leaves behind.

        Args:
            position: Position of the robot in ``odom`` [m], shape (2,).
        """
        self._grid.follow(position)


@kernel
def _accumulate(
    log_odds: NDArray[np.float32],
    cells: NDArray[np.int64],
    due: NDArray[np.bool_],
    ranges: NDArray[np.float32],
    verdicts: NDArray[np.float64],
    weights: _Weights,
) -> None:
    """Add a cloud's verdicts to what is remembered.

    Args:
        log_odds: Log odds of the layer, wrapped around, changed in place, shape (n, n).
        cells: Ground cells of the cloud, shape (k, 2).
        due: True for the cells that have a verdict, shape (k,).
        ranges: Range of each ground cell [m], shape (k,).
        verdicts: Log odds of the cells that are due, one after the other.
        weights: Weights of memory and verdicts.
    """
    mask, most, count = len(log_odds) - 1, weights.max_log_odds, 0
    for k in range(len(cells)):
        if not due[k]:
            continue
        verdict = verdicts[count]
        if ranges[k] < weights.near_range:
            verdict += weights.near
        i, j = cells[k, 0] & mask, cells[k, 1] & mask
        # As numpy has it: the memory's product is a float32.
        known = np.float32(weights.memory) * log_odds[i, j] + verdict
        log_odds[i, j] = min(max(known, -most), most)
        count += 1
