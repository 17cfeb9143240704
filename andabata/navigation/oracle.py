"""The upper bound: the best way on the true map, from the true pose."""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.robot import RobotModel
from andabata.navigation.controller import ControllerInput
from andabata.navigation.planning.trajectory_rollouts import (
    ARRIVED,
    STEP,
    TrajectoryRolloutsConfig,
    fan,
)
from worlds.world import World


class OracleController:
    """Drives a fan of arcs in its head and takes the one with the cheapest way on to the goal.

    It knows what no robot knows, the true map and pose, but moves as the robot does: always
    forward, and only so sharply.
    """

    pace = 1.0
    hold = 3

    def __init__(
        self, world: World, robot: RobotModel, config: TrajectoryRolloutsConfig | None = None
    ) -> None:
        """Prepare for one world.

        Args:
            world: Whose truth is used.
            robot: Speed and steering limit.
            config: Numbers.
        """
        self._truth = world.truth
        self._config = config or TrajectoryRolloutsConfig()
        self._fan, self._first = fan(robot, self._config)
        self._stride = robot.speed * STEP
        self.reset()

    def reset(self) -> None:
        """Forget the goal."""
        self._goal: NDArray[np.float64] | None = None

    def steer(self, view: ControllerInput) -> float:
        """Return the yaw rate of the best arc [rad/s].

        Raises:
            ValueError: If the view holds no truth.
        """
        if view.truth is None:
            raise ValueError(
                "truth: expected the true state (the oracle drives in simulation only), got none"
            )
        if self._goal is None or not np.array_equal(self._goal, view.goal):
            self._goal = np.array(view.goal, dtype=np.float64)
            self._cost = self._truth.cost_to_go(self._goal, self._config.room, self._config.shy)
        return self._choose(view.truth.pose.position[:2], view.truth.pose.yaw)

    def _choose(self, here: NDArray[np.float64], yaw: float) -> float:
        """Return the first yaw rate of the cheapest rollout."""
        c, s = np.cos(yaw), np.sin(yaw)
        x = here[0] + c * self._fan[..., 0] - s * self._fan[..., 1]
        y = here[1] + s * self._fan[..., 0] + c * self._fan[..., 1]
        to_goal = np.hypot(x - self._goal[0], y - self._goal[1])  # type: ignore[index]
        arrived = np.minimum.accumulate(to_goal, axis=1) < ARRIVED
        driven = self._stride * (~arrived).sum(axis=1)  # Or it would arrive tomorrow, for ever.
        clearance = np.where(arrived, np.inf, self._truth.clearance_at(x, y))
        worst = np.maximum(self._config.room - clearance, 0.0)
        onward = np.where(arrived[:, -1], 0.0, self._cost(x[:, -1], y[:, -1]))
        crowded = np.clip(1.0 - clearance, 0.0, None).mean(axis=1)
        # Without a way on, the arc that ends nearest the goal; contact weighs more than anything.
        onward = np.where(np.isfinite(onward), onward, 1e3 + to_goal[:, -1])
        price = driven + onward + self._config.shy * crowded + 1e4 * (worst**2).sum(axis=1)
        return float(self._first[np.argmin(price)])
