"""A controller with a local map: the map says where to head for, and has a veto."""

from andabata.navigation.controller import Controller, ControllerInput
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.planning.trajectory_rollouts import TrajectoryRollouts


class GuidedController:
    """A controller that heads for the sub-goals of a local map and steers where that leads on.

    Attributes:
        local_planner: What it remembers and plans.
        pace: What the rollouts say, else 1.
        hold: The rollouts', else the controller's.
    """

    def __init__(
        self,
        controller: Controller,
        local_planner: LocalPlanner,
        rollouts: TrajectoryRollouts | None = None,
    ) -> None:
        """Put a map before a controller.

        Args:
            controller: Where would it steer?
            local_planner: Where to head for; its numbers are counted in looks.
            rollouts: Where does that lead; None lets the controller have its way.
        """
        self._controller = controller
        self.local_planner = local_planner
        self._rollouts = rollouts
        self.hold = controller.hold if rollouts is None else rollouts.config.hold
        self.reset()

    def reset(self) -> None:
        """Forget the last drive."""
        self.local_planner.reset()
        self._controller.reset()
        if self._rollouts is not None:
            self._rollouts.reset()
        self.pace = 1.0

    def steer(self, view: ControllerInput) -> float:
        """Return the controller's yaw rate for the sub-goal, or a better one [rad/s]."""
        wish = self._controller.steer(self.local_planner.guide(view))
        if self._rollouts is None:
            return wish
        there = view.odometry
        rate, self.pace = self._rollouts.choose(
            self.local_planner, there.position[:2], there.yaw, wish
        )
        return rate
