"""What several clouds say of each square of the ground around the robot."""

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.navigation.planning.low_obstacle_layer import follow
from traversability.cartesian.classifier import GroundClassifier
from traversability.cartesian.elevation_grid import ANY_AGE, ElevationGrid
from traversability.cartesian.features import EDGE_CELLS, GROUND_FEATURES, GroundFeatures

_RANGE = GROUND_FEATURES.index("range")


class GroundLayerConfig(BaseModel):
    """Numbers of the squares.

    Attributes:
        memory: What earlier clouds said counts for so much of it beside a new one.
        most: Largest log odds that are remembered, which are as much as can be known.
        miss: What a red square called green costs, in false alarms, as far as ``near``.
        near: Squares further away are called what is likelier [m]: they are seen again before they
            are met.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    memory: float = Field(default=0.5, ge=0, lt=1)
    most: float = Field(default=4.0, gt=0)
    miss: float = Field(default=4.0, gt=0)
    near: float = Field(default=5.0, ge=0)


class GroundLayer:
    """Remembers judged squares around the robot, in ``odom``.

    Attributes:
        odds: Log odds of each square for being non-traversable, misses weighed, up to ``most``; 0
            where nobody looked. Wrapped around, float32, shape (n, n).
        centre: The robot's square, counted from the origin of ``odom``, shape (2,).
    """

    def __init__(self, cells: int, forest: GroundClassifier, config: GroundLayerConfig) -> None:
        """Begin without any.

        Args:
            cells: Squares along the edge of what is remembered.
            forest: Judges them.
            config: Numbers.
        """
        self._config = config
        self._forest = forest
        self._features = GroundFeatures()
        self._edge = EDGE_CELLS * forest.cell
        self.odds = np.zeros((cells, cells), dtype=np.float32)
        self.centre = np.zeros(2, dtype=np.int64)

    def reset(self) -> None:
        """Forget everything."""
        self.odds[:] = 0.0
        self.centre[:] = 0

    def take(
        self, tiles: ElevationGrid, here: NDArray[np.float64], span: tuple[float, float] = ANY_AGE
    ) -> None:
        """Take in a cloud.

        Args:
            tiles: The cloud in ``odom``.
            here: Position of the robot there [m], shape (2,).
            span: Squares that were last measured so long ago [s]; see ``GroundFeatures.describe``.
        """
        self.follow(here)
        config = self._config
        self._features.describe(tiles, here, span)
        due = self._features.due
        now = self._forest.log_odds(self._features.values, self._features.cells, due)
        places, values = self._features.cells[due], self._features.values[due]
        i, j = (places & (len(self.odds) - 1)).T
        now[values[:, _RANGE] < config.near] += math.log(config.miss)
        odds = config.memory * self.odds[i, j] + now
        self.odds[i, j] = np.clip(odds, -config.most, config.most)

    def follow(self, here: NDArray[np.float64]) -> None:
        """Go with the robot, and forget what is left behind.

        Args:
            here: Its position in ``odom`` [m], shape (2,).
        """
        follow(self.odds, self.centre, here, self._edge)
