"""Repetition of satellite fixes: a receiver that hangs sends its last place with new stamps."""

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

_DISTINCT = 10
"""Number of places, each other than the one before, after which a receiver is known to scatter."""

_STANDSTILL = 0.02
"""Way that counts as none [m]."""


class RepetitionConfig(BaseModel):
    """Limits beyond which a receiver that repeats its place hangs.

    Attributes:
        repeats: Least number of repetitions.
        way: Way of the robot in them, for a receiver whose places never repeated before [m].
        coarse_way: Way for one of coarse places, or that holds its place at rest [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    repeats: int = Field(default=2, ge=1)
    way: float = Field(default=0.25, gt=0)
    coarse_way: float = Field(default=2.0, gt=0)


class FixRepetition:
    """Finds fixes that repeat the last place to the bit while the robot moves.

    Attributes:
        is_frozen: True while the receiver repeats itself and is not believed.
        is_repeating: True if the last fix repeats the one before although the robot has moved: no
            reason to move the estimate towards it.
        since: Stamp of the first fix at the last place [s].
    """

    def __init__(self, config: RepetitionConfig) -> None:
        """Begin without any fix.

        Args:
            config: Limits.
        """
        self._config = config
        self._place: tuple[float, ...] | None = None
        self._way = 0.0  # Way since the first fix at the last place.
        self._repeats = self._distinct = 0
        self._is_coarse = False
        self.is_frozen = self.is_repeating = False
        self.since = math.inf

    def drive(self, way: float) -> None:
        """Record a way that was driven, forward or backward [m]."""
        self._way += abs(way)

    def believed(self, fixes: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the fixes without those that repeat the last place while the robot moves.

        Args:
            fixes: Rows as in ``SensorReadings.gnss``, shape (k, 5).
        """
        kept = [self._is_believed(fix) for fix in fixes.tolist()]
        return fixes if all(kept) else fixes[kept]

    def _is_believed(self, fix: list[float]) -> bool:
        """Return true unless a fix repeats the last place; one that is no place is for others."""
        stamp, latitude, longitude, altitude, _ = fix
        if not (math.isfinite(latitude) and math.isfinite(longitude)):
            return True
        # An altitude that is unknown, NaN, is like itself.
        place = latitude, longitude, altitude if math.isfinite(altitude) else 0.0
        if place == self._place:
            self._repeat()
            return not self.is_frozen
        self._is_coarse |= self._repeats > 0 and not self.is_frozen
        self._place, self.since = place, stamp
        self._way, self._repeats = 0.0, 0
        self._distinct += 1
        self.is_frozen = self.is_repeating = False
        return True

    def _repeat(self) -> None:
        """Count a repetition and judge it by the way since the first fix at the place."""
        config = self._config
        self._repeats += 1
        is_enough = self._repeats >= config.repeats
        self._is_coarse |= is_enough and self._way < _STANDSTILL
        scatters = self._distinct >= _DISTINCT and not self._is_coarse
        self.is_repeating = self._way > config.way
        self.is_frozen = is_enough and self._way > (config.way if scatters else config.coarse_way)
