"""A controller of your own, off-road: it turns to the open sector nearest the goal.

``andabata evaluate --world natural-test --trials 3 --seed 7300 --controllers
examples/own_controller.py:OpenSector,straight,planner`` compares it with others; ``andabata drive
--controller examples/own_controller.py:OpenSector+planner`` drives it with the local planner
around it.
"""

import numpy as np

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.machine.kinematics import Twist
from andabata.navigation.controller import ControllerInput


class OpenSector:
    """Steers by the virtual scan alone, without a memory."""

    def __init__(self, config: SimulatedRobotConfig, rng: np.random.Generator) -> None:
        """Take the settings of the robot; ``rng`` is for laws that draw."""
        self.speed = config.robot.speed
        self.bearings = config.grid.bearings
        self.width = config.robot.width

    def reset(self) -> None:
        """Forget the last drive: there is nothing to forget."""

    def act(self, situation: ControllerInput) -> Twist:
        """Return the wanted speed [m/s] and yaw rate [rad/s]; the robot limits them."""
        ranges = situation.scan.finite()  # [m], one of each sector, counter-clockwise from -pi
        reach = min(situation.goal_distance, 4.0)
        # A sector is open if its neighbours within half of the width at 2 m are as far, too.
        beside = int(np.ceil(np.arctan(self.width / 4.0) / np.diff(self.bearings[:2])[0]))
        nearest = np.min([np.roll(ranges, k) for k in range(-beside, beside + 1)], axis=0)
        turns = np.abs((self.bearings - situation.heading_error + np.pi) % (2 * np.pi) - np.pi)
        best = np.argmin(np.where(nearest >= reach, turns, turns + 10.0 - nearest))
        return Twist(self.speed, float(np.clip(1.5 * self.bearings[best], -0.8, 0.8)))
