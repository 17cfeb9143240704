"""Deterministic policies: a perceptron drives, and noise around its actions explores."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rl.policies.exploration import Exploration, RandomTurns
from rl.policies.mlp import PerceptronPolicy

EXPLORATION = "exploration"
"""Key of the description under which a policy that plays to learn has its ``Exploration``."""


@dataclass
class _Turn:
    """A random turn that a robot is making.

    Attributes:
        shares: Actions of the turn, shape (n_actions,).
        left: Number of decisions that are left of it.
    """

    shares: NDArray[np.float64]
    left: int


@dataclass(frozen=True)
class DeterministicPolicy(PerceptronPolicy):
    """A multilayer perceptron that gives the actions themselves.

    Attributes are those of ``PerceptronPolicy``. Without an ``Exploration`` under ``EXPLORATION``
    in ``info`` it explores nothing: its random actions are the best ones.
    """

    architecture = "deterministic"
    outputs_per_action = ("action",)

    def __post_init__(self) -> None:
        """Check that layers, spaces and exploration fit together."""
        super().__post_init__()
        exploration = Exploration.model_validate(self.info.get(EXPLORATION, {}))
        if exploration.random_turns is not None:
            self.observations.term(exploration.random_turns.term)
        low, high = np.array(self.actions.low), np.array(self.actions.high)
        # The shares of a standing robot: the value of each action that is nearest to 0.
        rest = np.clip(-(low + high) / (high - low), -1.0, 1.0)
        object.__setattr__(self, "_exploration", exploration)
        object.__setattr__(self, "_rest", rest)
        object.__setattr__(self, "_turns", {})

    def explore_many(
        self, observations: NDArray[np.float32], rngs: Sequence[np.random.Generator]
    ) -> NDArray[np.float64]:
        """Return noisy actions of several robots, shape (n, n_actions), as ``explore`` of each.

        A random turn lasts over several calls: a robot is known by its generator, and has another
        one in each episode.

        Args:
            observations: Observations, float32, shape (n, n_observations).
            rngs: Generator of each robot.
        """
        exploration: Exploration = self._exploration  # type: ignore[attr-defined]
        shares = self.best_many(observations)
        for row, rng in zip(shares, rngs, strict=True):
            row += exploration.sigma * rng.standard_normal(len(row))
        np.clip(shares, -1.0, 1.0, out=shares)
        if exploration.random_turns is not None:
            near = exploration.random_turns.are_near(observations, self.observations)
            for row, is_near, rng in zip(shares, near.tolist(), rngs, strict=True):
                turn = self._turn(exploration.random_turns, is_near, rng)
                row[:] = row if turn is None else turn
        return shares

    def _turn(
        self, turns: RandomTurns, is_near: bool, rng: np.random.Generator
    ) -> NDArray[np.float64] | None:
        """Return the shares of the turn that a robot makes or begins, None if it makes none."""
        making: dict[np.random.Generator, _Turn] = self._turns  # type: ignore[attr-defined]
        turn = making.get(rng)
        if turn is None:
            if not (is_near and rng.random() < turns.probability):
                return None
            turn = _Turn(
                self._drawn_turn(rng), int(rng.integers(turns.steps[0], turns.steps[1] + 1))
            )
            making[rng] = turn
        turn.left -= 1
        if not turn.left:
            del making[rng]
        return turn.shares

    def _drawn_turn(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Return the shares of a random turn: a random yaw rate, and everything else at rest."""
        drawn = rng.uniform(-1.0, 1.0, self.actions.size)
        turning = np.array([name == "angular" for name in self.actions.names])
        rest: NDArray[np.float64] = self._rest  # type: ignore[attr-defined]
        return np.where(turning, drawn, rest)
