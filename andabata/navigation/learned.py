"""A trained policy at the wheel."""

from andabata.navigation.controller import ControllerInput
from rl.policy import Policy
from rl.spaces import observation


class LearnedController:
    """Steers with a policy file's actor (Sanchez et al. 2023, section 4)."""

    pace = 1.0
    hold = 1

    def __init__(self, policy: Policy) -> None:
        """Take a loaded policy."""
        self._policy = policy

    def reset(self) -> None:
        """The policy remembers nothing between steps: its memory is in the state."""

    def steer(self, view: ControllerInput) -> float:
        """Return the actor's yaw rate for the state of 35 values [rad/s].

        Raises:
            ValueError: If free means another range to the scan than to the policy.
        """
        if view.scan.max_range != self._policy.max_range:
            raise ValueError(
                f"outer_radius: expected {self._policy.max_range} m, as the policy was trained, "
                f"got {view.scan.max_range} m"
            )
        state = observation(view.scan.finite(), view.previous_steering, view.heading_error)
        return self._policy.act(state)
