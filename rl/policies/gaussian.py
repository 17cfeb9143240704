"""Policies that squash a normal distribution: the mean drives, the spread explores."""

import math
from abc import abstractmethod
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rl.policies.squashed import SquashedPolicy

LOG_SIGMA = (-4.0, 0.5)
"""Bounds of the logarithm of the spread of explored actions, before tanh."""


class GaussianPolicy(SquashedPolicy):
    """What policies of means and log sigmas have in common; a subclass computes the two."""

    @abstractmethod
    def _outputs(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return means before tanh and log sigmas, shape (n, 2 n_actions), a row an observation."""

    def explore_many(
        self, observations: NDArray[np.float32], rngs: Sequence[np.random.Generator]
    ) -> NDArray[np.float64]:
        """Return random actions of several robots, shape (n, n_actions), as ``explore`` of each.

        Args:
            observations: Observations, float32, shape (n, n_observations).
            rngs: Generator of each robot.
        """
        count, (low, high) = self.actions.size, LOG_SIGMA
        outputs = self._outputs(np.ascontiguousarray(observations))
        shares = np.empty((len(outputs), count))
        for row, (output, rng) in enumerate(zip(outputs.tolist(), rngs, strict=True)):
            for k in range(count):
                sigma = math.exp(min(max(output[count + k], low), high))
                shares[row, k] = math.tanh(output[k] + sigma * rng.standard_normal())
        return shares
