"""Null controllers: if one of them does as well in the policy's place, learning earns nothing."""

import numpy as np

from andabata.machine.kinematics import Twist
from andabata.machine.robot import RobotModel
from andabata.navigation.controller import ControllerInput


class RandomController:
    """Draws a uniform yaw rate at each decision: noise in the policy's place."""

    def __init__(self, robot: RobotModel, rng: np.random.Generator) -> None:
        """Take a body and a source of noise.

        Args:
            robot: Speed and steering limit.
            rng: Source of the yaw rates.
        """
        self._robot, self._rng = robot, rng

    def reset(self) -> None:
        """Nothing is remembered; the noise goes on."""

    def act(self, situation: ControllerInput) -> Twist:
        """Return a random twist at the robot's speed."""
        limit = self._robot.max_steering
        return Twist(self._robot.speed, float(self._rng.uniform(-limit, limit)))


class AwayController:
    """Steers hard away from the sub-goal: the opposite of what a policy should do."""

    def __init__(self, robot: RobotModel) -> None:
        """Take a body's speed and steering limit."""
        self._robot = robot

    def reset(self) -> None:
        """Nothing is remembered."""

    def act(self, situation: ControllerInput) -> Twist:
        """Return the sharpest twist away from the heading error's side."""
        side = 1.0 if situation.heading_error >= 0 else -1.0
        return Twist(self._robot.speed, -side * self._robot.max_steering)
