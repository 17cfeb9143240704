"""Policies that squash numbers into shares of the actions by tanh."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rl.policy import Policy, Tensors, policy_to_bytes
from rl.spaces import ActionSpec, ObservationSpec


class SquashedPolicy(ABC):
    """What policies with a tanh at their end have in common.

    A subclass computes what is squashed, and how it explores around it.

    Attributes:
        weights: Weights by name.
        observations: Space of its observations.
        actions: Space of its actions.
        info: Origin of the policy: config, commit, stage; ready for JSON.
        terms: Names of the terms that it reads, None for all or the architecture's own.
    """

    architecture: str
    weights: Tensors
    observations: ObservationSpec
    actions: ActionSpec
    info: dict[str, Any]
    terms: tuple[str, ...] | None

    @abstractmethod
    def _outputs(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the outputs of the last layer, a row an observation.

        The first n_actions columns are the best actions before tanh.
        """

    @abstractmethod
    def explore_many(
        self, observations: NDArray[np.float32], rngs: Sequence[np.random.Generator]
    ) -> NDArray[np.float64]:
        """Return random actions of several robots, shape (n, n_actions), as ``explore`` of each.

        Args:
            observations: Observations, float32, shape (n, n_observations).
            rngs: Generator of each robot.
        """

    def reset(self) -> None:  # noqa: B027 - the default, which recurrent policies would replace.
        """Nothing is remembered between steps: the observation holds all memory there is."""

    def best(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the best actions as shares from -1 to 1, shape (n_actions,)."""
        return self.best_many(observation[None])[0]

    def explore(
        self, observation: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.float64]:
        """Return random actions around the best as shares from -1 to 1, shape (n_actions,)."""
        return self.explore_many(observation[None], (rng,))[0]

    def best_many(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the best actions of several robots, shape (n, n_actions), as ``best`` of each.

        Args:
            observations: Observations, float32, shape (n, n_observations).
        """
        means = self._outputs(np.ascontiguousarray(observations))[:, : self.actions.size]
        # Not numpy's tanh: it rounds otherwise, and otherwise again in rows of another length.
        shares = [[math.tanh(mean) for mean in row] for row in means.tolist()]
        return np.array(shares).reshape(means.shape)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the actions for an observation in SI units, shape (n_actions,).

        Raises:
            ValueError: If the observation has another length or is not finite.
        """
        self._check(observation)
        return self.actions.scaled(self.best(observation))

    def tensors(self) -> Tensors:
        """Return the weights by name, for a file."""
        return dict(self.weights)

    def to_bytes(self) -> bytes:
        """Return the policy as a file's bytes."""
        policy: Policy = self
        return policy_to_bytes(policy)

    def _check(self, observation: NDArray[np.float32]) -> None:
        """Refuse observations of another space.

        Raises:
            ValueError: If the observation has another length or is not finite.
        """
        if observation.shape != (self.observations.size,):
            raise ValueError(
                f"observation: expected shape ({self.observations.size},), got {observation.shape}"
            )
        if not np.isfinite(observation).all():
            raise ValueError("observation: expected finite numbers, got NaN or infinity")
