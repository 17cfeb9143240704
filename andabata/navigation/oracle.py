"""The upper bound: the best way on the true map, from the true pose."""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.robot import RobotModel
from andabata.navigation.arrival import ARRIVAL_DISTANCE
from andabata.navigation.controller import ControllerInput
from andabata.navigation.planning.rollout_prices import STEP
from andabata.navigation.planning.trajectory_rollouts import arc_fan
from worlds.world import World

_CONTACT = 1e4
"""Cost of a square metre of missing clearance [m]."""

_NO_WAY = 1e3
"""Cost of an arc whose end has no way to the goal, beside its distance to it [m]."""


class OracleConfig(BaseModel):
    """Settings of the oracle.

    Attributes:
        rates: Yaw rates of an arc, as shares of the steering limit.
        arcs: Number of arcs in a row.
        arc_time: Duration of an arc [s].
        inscribed_radius: Clearance that is kept where it can be, for which the body is a circle
            [m].
        clearance_cost: Extra cost of a metre for each metre of clearance short of one metre.
        action_repeat: Number of control steps between two decisions.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    rates: tuple[float, ...] = (-1.0, -0.5, 0.0, 0.5, 1.0)
    arcs: int = Field(default=3, ge=1, le=5)
    arc_time: float = Field(default=2.2, gt=0)
    inscribed_radius: float = Field(default=0.45, gt=0)
    clearance_cost: float = Field(default=1.0, ge=0)
    action_repeat: int = Field(default=3, ge=1)


class OracleController:
    """Simulates a fan of arcs and takes the one with the cheapest way on to the goal.

    It knows what no robot knows, the true map and pose, but moves as the paper's robot does: always
    forward at one speed, and only so sharply.

    Attributes:
        config: Settings.
    """

    def __init__(self, world: World, robot: RobotModel, config: OracleConfig | None = None) -> None:
        """Prepare for one world.

        Args:
            world: World whose true map is used.
            robot: Speed and steering limit.
            config: Settings.
        """
        self._truth = world.truth
        self.config = config or OracleConfig()
        self._fan, self._first = arc_fan(
            robot, self.config.rates, self.config.arcs, self.config.arc_time
        )
        self._speed = robot.speed
        self._stride = robot.speed * STEP
        self.reset()

    def reset(self) -> None:
        """Forget the goal."""
        self._goal: NDArray[np.float64] | None = None

    def act(self, situation: ControllerInput) -> Twist:
        """Return the twist of the best arc.

        Raises:
            ValueError: If the situation holds no true state.
        """
        if situation.truth is None:
            raise ValueError(
                "truth: expected the true state (the oracle drives in simulation only), got none"
            )
        if self._goal is None or not np.array_equal(self._goal, situation.goal):
            self._goal = np.array(situation.goal, dtype=np.float64)
            config = self.config
            self._cost = self._truth.cost_to_go(
                self._goal, config.inscribed_radius, config.clearance_cost
            )
        pose = situation.truth.pose
        return Twist(self._speed, self._best_rate(pose.position[:2], pose.yaw, self._goal))

    def _best_rate(
        self, position: NDArray[np.float64], yaw: float, goal: NDArray[np.float64]
    ) -> float:
        """Return the first yaw rate of the cheapest rollout."""
        config = self.config
        c, s = np.cos(yaw), np.sin(yaw)
        x = position[0] + c * self._fan[..., 0] - s * self._fan[..., 1]
        y = position[1] + s * self._fan[..., 0] + c * self._fan[..., 1]
        to_goal = np.hypot(x - goal[0], y - goal[1])
        arrived = np.minimum.accumulate(to_goal, axis=1) < ARRIVAL_DISTANCE
        # What is driven has to count, or a later arrival would be as good, for ever.
        driven = self._stride * (~arrived).sum(axis=1)
        clearance = np.where(arrived, np.inf, self._truth.clearance_at(x, y))
        missing = np.maximum(config.inscribed_radius - clearance, 0.0)
        onward = np.where(arrived[:, -1], 0.0, self._cost(x[:, -1], y[:, -1]))
        crowded = np.clip(1.0 - clearance, 0.0, None).mean(axis=1)
        # Without a way on, the arc that ends nearest the goal; contact weighs more than anything.
        onward = np.where(np.isfinite(onward), onward, _NO_WAY + to_goal[:, -1])
        contact = _CONTACT * (missing**2).sum(axis=1)
        price = driven + onward + config.clearance_cost * crowded + contact
        return float(self._first[np.argmin(price)])
