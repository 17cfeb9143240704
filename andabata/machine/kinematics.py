"""Skid-steer kinematics with an effective track (the paper's inverse and direct kinematics)."""

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
    """Body twist to wheel speeds and back.

    A skid-steer body turns about centres of rotation that lie further out than its wheels, so that
    the same wheel speeds turn it less than a differential drive would turn. ``slip_factor`` says
    how much.
    """

    def __init__(self, robot: RobotModel) -> None:
        """Take the wheel radius and the effective track of a robot."""
        self._radius = robot.wheel_radius
        self._half_track = robot.effective_track / 2
        self._limit = robot.max_wheel_speed

    def wheel_speeds(self, speed: float, yaw_rate: float) -> WheelSpeeds:
        """Return the wheel speeds for a twist, scaled down together where one exceeds its limit.

        Args:
            speed: Forward speed [m/s].
            yaw_rate: Yaw rate [rad/s], positive to the left.

        Raises:
            ValueError: If a number is not finite.
        """
        if not (math.isfinite(speed) and math.isfinite(yaw_rate)):
            raise ValueError(f"twist: expected finite numbers, got ({speed}, {yaw_rate})")
        wheels = self.unlimited_wheel_speeds(speed, yaw_rate)
        scale = min(1.0, self._limit / max(abs(wheels.left), abs(wheels.right), 1e-12))
        return WheelSpeeds(wheels.left * scale, wheels.right * scale)

    def unlimited_wheel_speeds(self, speed: float, yaw_rate: float) -> WheelSpeeds:
        """Return the wheel speeds that a measured twist [m/s, rad/s] stands for."""
        left = (speed - yaw_rate * self._half_track) / self._radius
        right = (speed + yaw_rate * self._half_track) / self._radius
        return WheelSpeeds(left, right)

    def twist(self, wheels: WheelSpeeds) -> tuple[float, float]:
        """Return forward speed [m/s] and yaw rate [rad/s] of wheel speeds."""
        left, right = wheels.left * self._radius, wheels.right * self._radius
        return (left + right) / 2, (right - left) / (2 * self._half_track)


def apply_dead_zone(action: float, dead_zone: float) -> float:
    """Return the executed yaw rate: commands inside (-dead_zone, dead_zone) drive straight on."""
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
