"""Ground layer: log odds of each ground cell around the robot for being non-traversable."""

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

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
        self._config = config
        self._classifier = classifier
        self._features = GroundFeatures()
        self._grid = RollingGrid(EDGE_CELLS * classifier.cell, cells, ("log_odds",))
        self.log_odds = self._grid["log_odds"]

    @property
    def max_log_odds(self) -> float:
        """Largest log odds."""
        return self._config.max_log_odds

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
        self.follow(position)
        config = self._config
        self._features.describe(elevation, position, ages)
        due = self._features.due
        verdicts = self._classifier.log_odds(self._features.values, self._features.cells, due)
        places, values = self._features.cells[due], self._features.values[due]
        i, j = self._grid.wrap(places).T
        # A miss near the robot costs more than a false alarm: shift the decision towards blocked.
        verdicts[values[:, _RANGE] < config.near_range] += math.log(config.miss_cost)
        log_odds = config.memory * self.log_odds[i, j] + verdicts
        self.log_odds[i, j] = np.clip(log_odds, -config.max_log_odds, config.max_log_odds)

    def follow(self, position: NDArray[np.float64]) -> None:
        """Move the square to the robot and forget what it leaves behind.

        Args:
            position: Position of the robot in ``odom`` [m], shape (2,).
        """
        self._grid.follow(position)
