"""Commands and ground of the tests that drive a plant of the default robot."""

import numpy as np

from andabata.machine.kinematics import SkidSteer
from andabata.machine.robot import RobotModel

ROBOT = RobotModel()
KINEMATICS = SkidSteer(ROBOT)


def slope(angle_deg):
    """Return the height of a plane that rises along x, as a function of x and y [m]."""
    return lambda x, y: np.tan(np.deg2rad(angle_deg)) * x


def twist(vehicle, speed, rate, seconds):
    """Drive with a forward speed [m/s] and a yaw rate [rad/s]; return the rows of the ticks."""
    return vehicle.drive(KINEMATICS.wheel_speeds(speed, rate), round(seconds * 100))
