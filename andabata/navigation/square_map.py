"""What several clouds say of each square of the ground around the robot."""

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.navigation.bumps import follow
from traversability.square_forest import SquareForest
from traversability.squares import SQUARE, SQUARE_FEATURES, SquareFeatures
from traversability.tiles import Tiles

_HEIGHT = SQUARE_FEATURES.index("height")
_RANGE = SQUARE_FEATURES.index("range")


class SquareMapConfig(BaseModel):
    """Numbers of the squares.

    Attributes:
        memory: What earlier clouds said counts for so much of it beside a new one, seen from as
            near; a cloud from ``r`` times as far as the nearest one counts ``r ** 2`` times less.
        forget: That nearest distance grows by this share with each cloud: what was seen from near
            is not true for ever.
        most: Largest log odds that are remembered, which are as much as can be known.
        miss: What a red square called green costs, in false alarms, as far as ``near``.
        near: Squares further away are called what is likelier [m]: they are seen again before they
            are met.
        tall: A red square with points so far apart in height is of a thing whose far side the
            laser does not see [m].
        behind: Least log odds of the square behind such a one.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    memory: float = Field(default=0.5, ge=0, lt=1)
    forget: float = Field(default=0.02, ge=0)
    most: float = Field(default=4.0, gt=0)
    miss: float = Field(default=4.0, gt=0)
    near: float = Field(default=5.0, ge=0)
    tall: float = Field(default=0.4, gt=0)
    behind: float = Field(default=2.0)


class SquareMap:
    """Remembers judged squares around the robot, in ``odom``.

    Attributes:
        odds: Log odds of each square for being non-traversable, misses weighed, up to ``most``; 0
            where nobody looked. Wrapped around, float32, shape (n, n).
        centre: The robot's square, counted from the origin of ``odom``, shape (2,).
    """

    def __init__(self, cells: int, forest: SquareForest, config: SquareMapConfig) -> None:
        """Begin without any.

        Args:
            cells: Squares along the edge of what is remembered.
            forest: Judges them.
            config: Numbers.
        """
        self._config = config
        self._forest = forest
        self._features = SquareFeatures()
        self._edge = SQUARE * forest.cell
        self.odds = np.zeros((cells, cells), dtype=np.float32)
        self.centre = np.zeros(2, dtype=np.int64)
        # Distance from which each square was seen best [m]; 0 where nobody looked.
        self._nearest = np.zeros((cells, cells), dtype=np.float32)

    def reset(self) -> None:
        """Forget everything."""
        self.odds[:] = 0.0
        self._nearest[:] = 0.0
        self.centre[:] = 0

    def take(self, tiles: Tiles, here: NDArray[np.float64]) -> None:
        """Take in a cloud.

        Args:
            tiles: The cloud in ``odom``.
            here: Position of the robot there [m], shape (2,).
        """
        self.follow(here)
        config, most = self._config, self._config.most
        self._features.describe(tiles, here)
        places, values = self._features.places, self._features.values
        i, j = (places & (len(self.odds) - 1)).T
        far = values[:, _RANGE]
        now = self._forest.odds(values)
        now[far < config.near] += math.log(config.miss)
        nearest = self._nearest[i, j]
        nearest = np.where(nearest > 0, np.minimum((1.0 + config.forget) * nearest, far), far)
        self._nearest[i, j] = nearest
        weight, before = (nearest / far) ** 2, self.odds[i, j]
        said = now.clip(-2.0 * most, 2.0 * most)  # From near that turns round what is known.
        odds = before + weight * (said - (1.0 - config.memory) * before)
        self.odds[i, j] = odds.clip(-most, most)
        self._cast_shadows(places[(now > 0) & (values[:, _HEIGHT] > config.tall)], here)

    def _cast_shadows(self, places: NDArray[np.int64], here: NDArray[np.float64]) -> None:
        """Raise the squares behind those of tall things, as seen from a place [m]."""
        away = (places + 0.5) * self._edge - here
        away /= np.hypot(*away.T)[:, None]
        i, j = (places + np.rint(away).astype(np.int64) & (len(self.odds) - 1)).T
        self.odds[i, j] = np.maximum(self.odds[i, j], self._config.behind)

    def follow(self, here: NDArray[np.float64]) -> None:
        """Go with the robot, and forget what is left behind.

        Args:
            here: Its position in ``odom`` [m], shape (2,).
        """
        centre = self.centre.copy()
        follow(self.odds, centre, here, self._edge)
        follow(self._nearest, self.centre, here, self._edge)
