"""Laws that see no obstacle and read the goal alone: what a policy has to beat.

``ProportionalPolicy`` drives the first episodes of a training; ``HeadingPolicy`` is the law that a
path of sub-goals deserves; ``RandomPolicy``, ``AheadPolicy`` and ``AwayPolicy`` are noise, straight
on and the opposite: if one of them does as well in a policy's place, learning earns nothing.
"""

import zlib
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from rl.policy import Policy, Tensors, policy_to_bytes
from rl.spaces import ActionSpec, ObservationSpec

GOAL = "goal"
"""Name of the term that they read: distance / ``DISTANCE_UNIT``, cos and sin of the goal's bearing,
or, with two values, distance [m] and bearing [rad]."""

DISTANCE_UNIT = 5.0
"""Distance that the three-valued term counts as one [m]."""

_SPEED_GAIN = 10.0
"""Speed for each metre to the goal, before it is limited [1/s] (Xie et al. 2018)."""

_HEADING_GAIN = 2.5
"""Yaw rate for each radian of the goal's bearing [1/s] (assumption)."""

_SLOWING = 4
"""Power of the bearing's cosine that the speed is multiplied with (assumption)."""


@dataclass(frozen=True)
class Law(ABC):
    """A law from an observation with the goal in the robot's frame to speed and yaw rate.

    Actions other than ``linear`` and ``angular`` are 0 or the nearest value to it.

    Attributes:
        weights: Nothing, unless the law has constants of its robot.
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

    architecture = ""
    constants: ClassVar[frozenset[str]] = frozenset()

    def __post_init__(self) -> None:
        """Check that there is a goal, and what the law knows of its robot."""
        if set(self.weights) != self.constants:
            expected = ", ".join(sorted(self.constants)) or "none"
            raise ValueError(f"weights: expected {expected}, got {sorted(self.weights)}")
        names = [term.name for term in self.observations.terms]
        if GOAL not in names or self.observations.term(GOAL).shape not in ((2,), (3,)):
            raise ValueError(
                f"observations: expected a term {GOAL!r} of 2 or 3 values, got {names}; "
                "set warmup_episodes = 0 for a task without one"
            )

    @abstractmethod
    def _wanted(self, observations: NDArray[np.float32]) -> Mapping[str, NDArray[np.float64]]:
        """Return actions by name, before they are limited, shape (n,) each."""

    def reset(self) -> None:  # noqa: B027 - a part of the protocol, not one to fill in.
        """Nothing is remembered between steps."""

    def best(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the actions as shares from -1 to 1, shape (n_actions,)."""
        return self.best_many(observation[None])[0]

    def explore(
        self, observation: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.float64]:
        """Return the same as ``best``: a law does not explore."""
        return self.best(observation)

    def best_many(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return ``best`` of each row, shape (n, n_actions)."""
        low, high = np.array(self.actions.low), np.array(self.actions.high)
        return 2 * (self._values(observations) - low) / (high - low) - 1

    def explore_many(
        self, observations: NDArray[np.float32], rngs: Sequence[np.random.Generator]
    ) -> NDArray[np.float64]:
        """Return the same as ``best_many``: a law does not explore."""
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
        wanted, count = self._wanted(observations), len(observations)
        columns = [wanted.get(name, np.zeros(count)) for name in self.actions.names]
        return np.clip(np.stack(columns, axis=1), self.actions.low, self.actions.high)

    def _goals(
        self, observations: NDArray[np.float32]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the goals ahead of the robots and to their left [m], shape (n,) each."""
        goal = observations[:, self.observations.slice_of(GOAL)].astype(np.float64)
        if goal.shape[1] == 3:
            x, y = DISTANCE_UNIT * goal[:, 0] * goal[:, 1:].T
            return x, y
        return goal[:, 0] * np.cos(goal[:, 1]), goal[:, 0] * np.sin(goal[:, 1])

    def _towards(
        self, bearing: NDArray[np.float64], speed: NDArray[np.float64]
    ) -> dict[str, NDArray[np.float64]]:
        """Return a turn to a bearing, and a speed that falls the more there is to turn.

        Args:
            bearing: Bearing to turn to [rad], shape (n,).
            speed: Speed straight ahead, before it is limited [m/s], shape (n,).
        """
        wanted = {"angular": _HEADING_GAIN * bearing}
        if "linear" in self.actions.names:
            fastest = self.actions.high[self.actions.names.index("linear")]
            slowed = np.maximum(np.cos(bearing), 0.0) ** _SLOWING
            wanted["linear"] = np.clip(speed, 0.0, fastest) * slowed
        return wanted

    def tensors(self) -> Tensors:
        """Return what the law knows of its robot; nothing for most laws."""
        return dict(self.weights)

    def to_bytes(self) -> bytes:
        """Return the policy as a file's bytes."""
        policy: Policy = self
        return policy_to_bytes(policy)


@dataclass(frozen=True)
class GoalLaw(Law):
    """A law from the goal alone."""

    def _wanted(self, observations: NDArray[np.float32]) -> Mapping[str, NDArray[np.float64]]:
        """Return actions by name, before they are limited, shape (n,) each."""
        return self._by_goal(*self._goals(observations))

    @abstractmethod
    def _by_goal(
        self, x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> Mapping[str, NDArray[np.float64]]:
        """Return actions by name, before they are limited.

        Args:
            x: Distance of each goal ahead of the robot [m], shape (n,).
            y: Distance of each goal to its left [m], shape (n,).
        """


@dataclass(frozen=True)
class ProportionalPolicy(GoalLaw):
    """The law of the first episodes of Zhang et al. (arXiv 2010.10209), from Xie et al. 2018.

    In the robot's frame with x ahead: ``v = clip(10 x, 0, 0.5)`` and ``w = clip(y, -pi/3, pi/3)``.
    """

    architecture = "proportional"

    def _by_goal(
        self, x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> Mapping[str, NDArray[np.float64]]:
        """Return speed and yaw rate in proportion to the goal's coordinates."""
        return {"linear": _SPEED_GAIN * x, "angular": y}


@dataclass(frozen=True)
class HeadingPolicy(GoalLaw):
    """Turns towards the goal and drives as fast as it faces it: at a right angle it stands.

    With the goal's bearing a: ``w = 2.5 a``, and ``v`` is that of ``ProportionalPolicy``, limited,
    times ``max(cos a, 0)^4``. With sub-goals of a planner it keeps to the path where the
    proportional law cuts corners.
    """

    architecture = "heading"

    def _by_goal(
        self, x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> Mapping[str, NDArray[np.float64]]:
        """Return speed and yaw rate by the goal's bearing."""
        bearing = np.arctan2(y, x)
        return self._towards(bearing, _SPEED_GAIN * x)


@dataclass(frozen=True)
class AheadPolicy(GoalLaw):
    """Drives straight ahead at full speed, wherever the goal is."""

    architecture = "ahead"

    def _by_goal(
        self, x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> Mapping[str, NDArray[np.float64]]:
        """Return full speed and no turn."""
        return {"linear": np.full(len(x), np.inf)}


@dataclass(frozen=True)
class AwayPolicy(GoalLaw):
    """Steers hard away from the goal's side at full speed: the opposite of what a policy should."""

    architecture = "away"

    def _by_goal(
        self, x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> Mapping[str, NDArray[np.float64]]:
        """Return full speed and the sharpest turn away."""
        return {"linear": np.full(len(x), np.inf), "angular": np.where(y >= 0, -np.inf, np.inf)}


@dataclass(frozen=True)
class RandomPolicy(GoalLaw):
    """Draws uniform actions: noise in a policy's place.

    The noise is a function of the goal's coordinates, so that the same drive comes out again, in
    any number of processes and beside any other robots.
    """

    architecture = "random"

    def _by_goal(
        self, x: NDArray[np.float64], y: NDArray[np.float64]
    ) -> Mapping[str, NDArray[np.float64]]:
        """Return noise for every action."""
        seeds = [zlib.crc32(place.tobytes()) for place in np.stack([x, y], axis=1)]
        low, high = self.actions.low, self.actions.high
        noise = np.array([np.random.default_rng(seed).uniform(low, high) for seed in seeds])
        return dict(zip(self.actions.names, noise.T, strict=True))
