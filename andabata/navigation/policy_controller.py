"""Steers with a trained policy (Sanchez et al. 2023, section 4)."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematics import Twist
from andabata.navigation.controller import ControllerInput
from rl.policy import Policy, with_observations
from rl.spaces import ActionSpec, ObservationSpec, points_of, steering_points


class PolicyController:
    """Drives a policy: named parts of the situation in, a twist out."""

    def __init__(self, policy: Policy, cruise_speed: float) -> None:
        """Take a loaded policy.

        Args:
            policy: Trained actor.
            cruise_speed: Forward speed where the policy has no action for it [m/s].

        Raises:
            ValueError: If the policy asks for observations that a robot does not have.
        """
        self._policy = policy
        self._cruise_speed = cruise_speed
        unknown = [t.name for t in policy.observations.terms if t.name not in _TERMS]
        if unknown:
            raise ValueError(f"policy: expected observations {', '.join(_TERMS)}, got {unknown}")

    def reset(self) -> None:
        """Let the policy forget the last drive."""
        self._policy.reset()

    def act(self, situation: ControllerInput) -> Twist:
        """Return the policy's twist for a situation.

        Raises:
            ValueError: If the scan's largest range is another than in training.
        """
        observations = self._fitted(situation).observations
        if "ranges" in _names(observations):
            trained = observations.term("ranges").high
            if situation.scan.max_range != trained:
                raise ValueError(
                    f"outer_radius: expected {trained} m, as the policy was trained, "
                    f"got {situation.scan.max_range} m"
                )
        actions = self._policy.act(observation_of(observations, situation))
        return twist_of(self._policy.actions, actions, self._cruise_speed)

    def _fitted(self, situation: ControllerInput) -> Policy:
        """Return the policy for as many sectors as the scan has, if it reads a set of points.

        A policy of a fixed vector stays as it is: its observation refuses another number.
        """
        observations, sectors = self._policy.observations, len(situation.scan.ranges)
        if "points" in _names(observations) and observations.term("points").shape[0] != sectors:
            reach, limit = (observations.term(name).high for name in ("ranges", "previous_actions"))
            spaces = steering_points(sectors, reach, limit)
            self._policy = with_observations(self._policy, spaces)
        return self._policy


def observation_of(
    observations: ObservationSpec, situation: ControllerInput
) -> NDArray[np.float32]:
    """Return the observation of a situation, float32, shape (n,)."""
    parts = {name: _TERMS[name](situation) for name in _names(observations)}
    return observations.vector(parts)


def twist_of(actions: ActionSpec, values: NDArray[np.float64], cruise_speed: float) -> Twist:
    """Return the twist of actions in SI units, shape (n_actions,).

    Args:
        actions: Names of the actions: ``angular``, ``linear``.
        values: Values of the terms.
        cruise_speed: Forward speed without an action for it [m/s].
    """
    parts = dict(zip(actions.names, (float(value) for value in values), strict=True))
    return Twist(parts.get("linear", cruise_speed), parts.get("angular", 0.0))


def _names(observations: ObservationSpec) -> list[str]:
    """Return the names of the parts."""
    return [term.name for term in observations.terms]


_TERMS: dict[str, Any] = {
    "ranges": lambda situation: situation.scan.finite(),
    "points": lambda situation: points_of(situation.scan.known())[0],
    "mask": lambda situation: points_of(situation.scan.known())[1],
    "previous_actions": lambda situation: situation.previous_steering,
    "heading_error": lambda situation: [situation.heading_error],
}
"""Parts of observations that a situation gives, by name."""
