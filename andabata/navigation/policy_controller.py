"""Steers with a trained policy (Sanchez et al. 2023, section 4)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematics import Twist
from andabata.navigation.controller import ControllerInput
from andabata.navigation.map_observation import MAP_TERMS
from rl.driving import driving_repeat
from rl.policy import Policy, with_observations
from rl.spaces import ActionSpec, ObservationSpec, points_of, steering_points


class PolicyController:
    """Drives a policy: named parts of the situation in, a twist out.

    Attributes:
        repeat: Number of control steps that the policy holds an action for when it drives alone.
    """

    def __init__(self, policy: Policy, cruise_speed: float) -> None:
        """Take a loaded policy.

        Args:
            policy: Trained actor.
            cruise_speed: Forward speed where the policy has no action for it [m/s].

        Raises:
            ValueError: If the policy asks for observations that a robot does not have.
        """
        self._cruise_speed = cruise_speed
        terms = {term.name: term for term in policy.observations.terms}
        unknown = [name for name in terms if name not in _TERMS]
        if unknown:
            raise ValueError(f"policy: expected observations {', '.join(_TERMS)}, got {unknown}")
        self._policy, self.repeat = policy, driving_repeat(policy)
        self._trained_range = terms["ranges"].high if "ranges" in terms else None
        # A policy of a fixed vector has no such number: its observation refuses another.
        self._sectors = terms["points"].shape[0] if "points" in terms else None

    def reset(self) -> None:
        """Let the policy forget the last drive."""
        self._policy.reset()

    def act(self, situation: ControllerInput) -> Twist:
        """Return the policy's twist for a situation.

        Raises:
            ValueError: If the scan's largest range is another than in training.
        """
        scan, trained = situation.scan, self._trained_range
        if self._sectors is not None and self._sectors != len(scan.ranges):
            self._fit(len(scan.ranges))
        if trained is not None and scan.max_range != trained:
            raise ValueError(
                f"outer_radius: expected {trained} m, as the policy was trained, "
                f"got {scan.max_range} m"
            )
        policy = self._policy
        actions = policy.act(observation_of(policy.observations, situation))
        return twist_of(policy.actions, actions, self._cruise_speed)

    def _fit(self, sectors: int) -> None:
        """Take another number of sectors, which a policy of a set of points can read."""
        observations = self._policy.observations
        reach, limit = (observations.term(name).high for name in ("ranges", "previous_actions"))
        spaces = steering_points(sectors, reach, limit)
        self._policy, self._sectors = with_observations(self._policy, spaces), sectors


def observation_of(
    observations: ObservationSpec, situation: ControllerInput
) -> NDArray[np.float32]:
    """Return the observation of a situation, float32, shape (n,)."""
    parts = {term.name: _TERMS[term.name](situation) for term in observations.terms}
    return observations.vector(parts)


def twist_of(actions: ActionSpec, values: NDArray[np.float64], cruise_speed: float) -> Twist:
    """Return the twist of actions in SI units, shape (n_actions,).

    Args:
        actions: Names of the actions: ``angular``, ``linear``.
        values: Values of the terms.
        cruise_speed: Forward speed without an action for it [m/s].
    """
    parts = dict(zip(actions.names, values.tolist(), strict=True))
    return Twist(parts.get("linear", cruise_speed), parts.get("angular", 0.0))


_TERMS: dict[str, Any] = {
    "ranges": lambda situation: situation.scan.finite(),
    "points": lambda situation: points_of(situation.scan.known())[0],
    "mask": lambda situation: points_of(situation.scan.known())[1],
    "previous_actions": lambda situation: situation.previous_steering,
    "heading_error": lambda situation: [situation.heading_error],
    **MAP_TERMS,
}
"""Parts of observations that a situation gives, by name."""
