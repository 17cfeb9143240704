"""Exploration of actors that draw nothing themselves: noise that decays, and random turns."""

from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from rl.spaces import ObservationSpec


class NoiseSchedule(BaseModel):
    """Standard deviation of normal noise on the actions' shares, by decisions.

    Attributes:
        start: Standard deviation before the first decision.
        end: Standard deviation after ``steps`` decisions.
        steps: Number of decisions until ``end``.
        decay: Form of the decay: ``linear``, or ``exponential``, the same factor in each decision.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    start: float = Field(default=0.5, ge=0)
    end: float = Field(default=0.1, ge=0)
    steps: int = Field(default=60_000, ge=1)
    decay: Literal["linear", "exponential"] = "linear"

    @model_validator(mode="after")
    def _check_bounds(self) -> Self:
        if self.decay == "exponential" and not (self.start > 0 and self.end > 0):
            raise ValueError(
                "noise: expected start and end above 0 for an exponential decay, got "
                f"{self.start} and {self.end}; take decay = 'linear'"
            )
        return self

    def sigma(self, decisions: int) -> float:
        """Return the standard deviation after a number of decisions."""
        spent = min(decisions / self.steps, 1.0)
        if self.decay == "exponential":
            return self.start * (self.end / self.start) ** spent
        return self.start + (self.end - self.start) * spent


class RandomTurns(BaseModel):
    """Random turns on the spot near obstacles, each held for some steps (GDAE's public code).

    Attributes:
        term: Name of the observation's term that tells what is near: ranges [m], or their
            reciprocals [1/m].
        values: First and last value of the term that count, from 0; None for all (GDAE: 4 to 15 of
            its 20, those ahead).
        near_range: Range below which the robot is near an obstacle [m].
        probability: Probability of a turn in each decision near an obstacle.
        steps: Least and greatest number of decisions of a turn.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    term: str
    values: tuple[int, int] | None = None
    near_range: float = Field(default=0.6, gt=0)
    probability: float = Field(default=0.15, ge=0, le=1)
    steps: tuple[int, int] = (8, 14)

    @model_validator(mode="after")
    def _check_bounds(self) -> Self:
        if not 1 <= self.steps[0] <= self.steps[1]:
            raise ValueError(f"steps: expected 1 <= least <= greatest, got {self.steps}")
        if self.values is not None and not 0 <= self.values[0] <= self.values[1]:
            raise ValueError(f"values: expected 0 <= first <= last, got {self.values}")
        return self

    def are_near(
        self, observations: NDArray[np.float32], space: ObservationSpec
    ) -> NDArray[np.bool_]:
        """Return which observations are near an obstacle, shape (n,).

        Args:
            observations: Observations, shape (n, n_observations).
            space: Space of the observations.

        Raises:
            KeyError: If there is no term of the name.
        """
        read = observations[:, space.slice_of(self.term)]
        if self.values is not None:
            read = read[:, self.values[0] : self.values[1] + 1]
        if space.term(self.term).unit == "1/m":
            return np.asarray(read.max(axis=1) > 1 / self.near_range)
        return np.asarray(read.min(axis=1) < self.near_range)


class Exploration(BaseModel):
    """Exploration around an actor's best actions.

    Attributes:
        sigma: Standard deviation of normal noise on the actions' shares, which are clipped to their
            bounds.
        random_turns: Random turns near obstacles, or None.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    sigma: float = Field(default=0.0, ge=0)
    random_turns: RandomTurns | None = None
