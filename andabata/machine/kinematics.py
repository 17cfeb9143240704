"""Skid-steer kinematics with an effective track (the paper's inverse and direct kinematics).

A command passes ``apply_dead_zone``, then ``SkidSteer.wheel_speeds``.
"""

import math
from dataclasses import dataclass

from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import WheelSpeeds


@dataclass(frozen=True)
class Twist:
    """Planar velocity of the body in ``base_footprint``.

    Attributes:
        linear: Forward speed [m/s].
        angular: Yaw rate [rad/s], positive to the left.
    """

    linear: float
    angular: float


class SkidSteer:
    """Inverse and direct kinematics of a skid-steer body.

    A skid-steer body turns about centres of rotation that lie further out than its wheels: the same
    wheel speeds turn it less than they would a differential drive. ``RobotModel.slip_factor`` is
    the ratio of the effective to the geometric track.
    """

    def __init__(self, robot: RobotModel) -> None:
        """Take wheel radius, effective track and speed limit of a robot.

        Args:
            robot: Parameters of the body.
        """
        self._radius = robot.wheel_radius
        self._half_track = robot.effective_track / 2
        self._limit = robot.max_wheel_speed

    def wheel_speeds(self, speed: float, yaw_rate: float) -> WheelSpeeds:
        """Return the wheel speeds for a twist within the wheels' limit.

        Where one side exceeds the limit both are scaled down together, which keeps the curvature.

        Args:
            speed: Forward speed [m/s].
            yaw_rate: Yaw rate [rad/s], positive to the left.

        Raises:
            ValueError: If a number is not finite.
        """
        if not (math.isfinite(speed) and math.isfinite(yaw_rate)):
            raise ValueError(f"twist: expected finite numbers, got ({speed}, {yaw_rate})")
        wheels = self.unlimited_wheel_speeds(speed, yaw_rate)
        fastest = max(abs(wheels.left), abs(wheels.right))
        if fastest <= self._limit:
            return wheels
        scale = self._limit / fastest
        return WheelSpeeds(wheels.left * scale, wheels.right * scale)

    def unlimited_wheel_speeds(self, speed: float, yaw_rate: float) -> WheelSpeeds:
        """Return the wheel speeds of a measured twist, whatever the limit.

        Args:
            speed: Forward speed [m/s].
            yaw_rate: Yaw rate [rad/s].
        """
        left = (speed - yaw_rate * self._half_track) / self._radius
        right = (speed + yaw_rate * self._half_track) / self._radius
        return WheelSpeeds(left, right)

    def twist(self, wheels: WheelSpeeds) -> tuple[float, float]:
        """Return forward speed [m/s] and yaw rate [rad/s] of wheel speeds."""
        left, right = wheels.left * self._radius, wheels.right * self._radius
        return (left + right) / 2, (right - left) / (2 * self._half_track)


def apply_dead_zone(action: float, dead_zone: float) -> float:
    """Return the executed yaw rate: commands smaller than the dead zone become zero.

    Args:
        action: Commanded yaw rate [rad/s].
        dead_zone: Smallest magnitude that is executed [rad/s].
    """
    return 0.0 if abs(action) < dead_zone else action


def executed_twist(command: Twist, robot: RobotModel) -> Twist:
    """Return the twist that a robot drives for a command: steering limit, then dead zone.

    Every command passes here once, in simulation, in training and on the robot.

    Args:
        command: Wanted twist.
        robot: Steering limit and dead zone.

    Raises:
        ValueError: If the command is not finite.
    """
    if not (math.isfinite(command.angular) and math.isfinite(command.linear)):
        raise ValueError(f"command: expected a finite twist [m/s, rad/s], got {command}")
    limit = robot.max_steering
    clipped = min(max(command.angular, -limit), limit)
    return Twist(command.linear, apply_dead_zone(clipped, robot.dead_zone))
