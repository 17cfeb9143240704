"""A proportional controller towards the goal: it drives the first episodes, and is a baseline.

The law is that with which Zhang et al. begin their training, from Xie et al. 2018: in the robot
frame with x ahead, ``v = clip(10 x, 0, 0.5)`` and ``w = clip(y, -pi/3, pi/3)``. It sees no
obstacle.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rl.policy import Policy, Tensors, policy_to_bytes
from rl.spaces import ActionSpec, ObservationSpec

GOAL = "goal"
"""Name of the term that it reads: distance / ``DISTANCE_UNIT``, cos and sin of the goal's bearing,
or, with two values, distance [m] and bearing [rad]."""

DISTANCE_UNIT = 5.0
"""Distance that the three-valued term counts as one [m]."""

_SPEED_GAIN, _TURN_GAIN = 10.0, 1.0


@dataclass(frozen=True)
class ProportionalPolicy:
    """Drives straight to the goal.

    Actions other than ``linear`` and ``angular`` are 0 or the nearest value to it.

    Attributes:
        weights: Nothing: the law has no weights.
        observations: Space of its observations, with the term ``goal``.
        actions: Space of its actions; their bounds are those of the law.
        info: Origin of the policy, ready for JSON.
        terms: Names of the terms that it reads.
    """

    weights: Tensors
    observations: ObservationSpec
    actions: ActionSpec
    info: dict[str, Any] = field(default_factory=dict)
    terms: tuple[str, ...] | None = (GOAL,)

    architecture = "proportional"

    def __post_init__(self) -> None:
        """Check that there is a goal."""
        if self.weights:
            raise ValueError(f"weights: expected none, got {sorted(self.weights)}")
        names = [term.name for term in self.observations.terms]
        if GOAL not in names or self.observations.term(GOAL).shape not in ((2,), (3,)):
            raise ValueError(
                f"observations: expected a term {GOAL!r} of 2 or 3 values, got {names}; "
                "set warmup_episodes = 0 for a task without one"
            )

    def reset(self) -> None:
        """Nothing is remembered between steps."""

    def best(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the actions as shares from -1 to 1, shape (n_actions,)."""
        return self.best_many(observation[None])[0]

    def explore(
        self, observation: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.float64]:
        """Return the same as ``best``: the law does not explore."""
        return self.best(observation)

    def best_many(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return ``best`` of each row, shape (n, n_actions)."""
        low, high = np.array(self.actions.low), np.array(self.actions.high)
        return 2 * (self._values(observations) - low) / (high - low) - 1

    def explore_many(
        self, observations: NDArray[np.float32], rngs: Sequence[np.random.Generator]
    ) -> NDArray[np.float64]:
        """Return the same as ``best_many``: the law does not explore."""
        return self.best_many(observations)

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the actions for an observation in SI units, shape (n_actions,).

        Raises:
            ValueError: If the observation has another length or is not finite.
        """
        if observation.shape != (self.observations.size,) or not np.isfinite(observation).all():
            raise ValueError(
                f"observation: expected finite numbers of shape ({self.observations.size},), got "
                f"shape {observation.shape}, NaN or infinity"
            )
        return self._values(observation[None])[0]

    def _values(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the actions in SI units, shape (n, n_actions)."""
        goal = observations[:, self.observations.slice_of(GOAL)].astype(np.float64)
        if goal.shape[1] == 3:
            x, y = DISTANCE_UNIT * goal[:, 0] * goal[:, 1:].T
        else:
            x, y = goal[:, 0] * np.cos(goal[:, 1]), goal[:, 0] * np.sin(goal[:, 1])
        wanted = {"linear": _SPEED_GAIN * x, "angular": _TURN_GAIN * y}
        columns = [wanted.get(name, np.zeros(len(x))) for name in self.actions.names]
        return np.clip(np.stack(columns, axis=1), self.actions.low, self.actions.high)

    def tensors(self) -> Tensors:
        """Return nothing: the law has no weights."""
        return {}

    def to_bytes(self) -> bytes:
        """Return the policy as a file's bytes."""
        policy: Policy = self
        return policy_to_bytes(policy)
