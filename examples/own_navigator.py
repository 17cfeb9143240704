"""A navigator of your own, on flat ground: it heads for the goal and stops before what is near.

``andabata evaluate --task barn --fields crowd-5 --trials 1 --set count=5 --set first_seed=7300
--controllers examples/own_navigator.py:StopAndGo,straight,mpc-movers`` compares it with others
among people.
"""

import math

import numpy as np

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarReadings
from andabata.machine.planar.vehicle import PlanarVehicleConfig


class StopAndGo:
    """Drives straight at the goal, and waits while something is before it."""

    def __init__(self, vehicle: PlanarVehicleConfig, rng: np.random.Generator) -> None:
        """Take the robot as far as it is known; ``rng`` is for laws that draw."""
        self.speed = vehicle.max_speed

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Take the laser, and the goal in the frame of the odometry [m]."""
        self.bearings, self.goal = lidar.bearings, goal

    def act(self, readings: PlanarReadings) -> Twist:
        """Return the command of this control period."""
        x, y, yaw = readings.odometry
        bearing = math.atan2(self.goal[1] - y, self.goal[0] - x) - yaw
        bearing = math.atan2(math.sin(bearing), math.cos(bearing))
        ahead = readings.ranges[np.abs(self.bearings) < 0.4].min()  # [m]; infinite without a return
        speed = float(np.clip(ahead - 0.8, 0.0, 0.5 * self.speed))
        return Twist(speed, 2.0 * bearing)
