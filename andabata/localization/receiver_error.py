"""Split of a satellite receiver's error into white noise and a slow error, by its own fixes.

A receiver states one variance, often a wrong one. What its fixes scatter from one second to the
next is white; the rest of its error changes over minutes and does not average out. Receivers that
smooth their fixes have little of the first and most of the second.
"""

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

_MEDIAN_SQUARE = 2 * math.log(2)
"""Median of the squared length of a vector of two standard normal numbers."""

_SHORTEST, _LONGEST = 0.5, 3.0
"""Time between two fixes that are compared [s]: before, smoothed fixes differ too little, after,
the slow error differs too."""

_CHANGE = 0.05
"""Relative change of the white noise that is worth a change of the filter."""


class ReceiverConfig(BaseModel):
    """Assumptions about a satellite receiver.

    Attributes:
        total: Least standard deviation in all, each horizontal axis, whatever the receiver states
            [m]. One with corrections (RTK) is better: set it to what its data sheet says.
        white: White noise before fixes have shown theirs [m].
        least_white: Least white noise [m].
        least_slow: Least slow error [m], at most ``total``.
        weight: Number of differences of fixes that ``white`` counts for.
        window: Number of differences whose median counts.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    total: float = Field(default=0.75, gt=0)
    white: float = Field(default=0.4, gt=0)
    least_white: float = Field(default=0.1, gt=0)
    least_slow: float = Field(default=0.25, ge=0)
    weight: int = Field(default=5, ge=1)
    window: int = Field(default=40, ge=1)


class ReceiverError:
    """Estimate of a receiver's white noise and slow error."""

    def __init__(self, config: ReceiverConfig) -> None:
        """Begin without any fix.

        Args:
            config: Assumptions about the receiver.
        """
        self._config = config
        self._squares: deque[float] = deque(maxlen=config.window)
        self._last: tuple[float, NDArray[np.float64]] | None = None
        self._white = config.white

    def add(self, stamp: float, offset: NDArray[np.float64]) -> None:
        """Compare a fix with the one before.

        Args:
            stamp: Time of the fix [s].
            offset: Fix less the place of the robot by dead reckoning, in the map's axes [m],
                shape (2,).
        """
        last = self._last
        if last is not None and _SHORTEST <= stamp - last[0] <= _LONGEST:
            # A difference of two has twice the variance of one.
            self._squares.append(float(((offset - last[1]) ** 2).sum()) / 2)
            self._update_white()
        elif last is not None and 0 <= stamp - last[0] < _SHORTEST:
            return
        self._last = (stamp, offset)

    def _update_white(self) -> None:
        """Estimate the white noise, if it changed."""
        config, count = self._config, len(self._squares)
        seen = float(np.median(self._squares)) / _MEDIAN_SQUARE
        variance = (config.weight * config.white**2 + count * seen) / (config.weight + count)
        white = max(math.sqrt(variance), config.least_white)
        if abs(white - self._white) > _CHANGE * self._white:
            self._white = white

    @property
    def white(self) -> float:
        """Standard deviation of the white noise of each horizontal axis [m]."""
        return self._white

    def slow(self, stated: float) -> float:
        """Return the standard deviation of the slow error of each horizontal axis [m].

        Args:
            stated: Variance that the receiver states, of each horizontal axis [m2].
        """
        config = self._config
        rest = max(stated, config.total**2) - self._white**2
        return max(math.sqrt(max(rest, 0.0)), config.least_slow)
