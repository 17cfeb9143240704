"""Navigators that see no obstacle: what a benchmark gives to those who do not look."""

import math

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarReadings
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.navigation.planar.scan_points import in_robot_frame


class StraightConfig(BaseModel):
    """Settings of ``StraightNavigator`` (assumption).

    Attributes:
        gain: Yaw rate for a radian of error [1/s].
        speed: Speed towards the goal [m/s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    gain: float = Field(default=2.0, gt=0)
    speed: float = Field(default=1.0, gt=0)


class StraightNavigator:
    """Turns to the goal and drives, whatever stands there."""

    def __init__(self, config: StraightConfig | None = None) -> None:
        """Take the settings."""
        self.config = config or StraightConfig()
        self._goal = (0.0, 0.0)

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Take the goal; see ``PlanarNavigator``."""
        self._goal = goal

    def act(self, readings: PlanarReadings) -> Twist:
        """Return full speed towards the goal, none away from it."""
        x, y = in_robot_frame(self._goal, readings.odometry)
        bearing = math.atan2(y, x)
        return Twist(self.config.speed * max(math.cos(bearing), 0.0), self.config.gain * bearing)


class RandomNavigator:
    """Holds a random speed and yaw rate for a while, then draws others."""

    def __init__(
        self, vehicle: PlanarVehicleConfig, rng: np.random.Generator, hold: int = 10
    ) -> None:
        """Take the limits of the robot.

        Args:
            vehicle: Robot as far as it is known.
            rng: Source of randomness.
            hold: Number of control periods with one command.
        """
        self._vehicle, self._rng, self._hold = vehicle, rng, hold
        self._count, self._command = 0, Twist(0.0, 0.0)

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Draw anew with the next command; see ``PlanarNavigator``."""
        self._count = 0

    def act(self, readings: PlanarReadings) -> Twist:
        """Return the command of this period."""
        if self._count % self._hold == 0:
            fastest = self._vehicle.max_wheel_speed / self._vehicle.half_track
            speed = self._rng.uniform(0.0, self._vehicle.max_speed)
            self._command = Twist(float(speed), float(self._rng.uniform(-fastest, fastest) / 2))
        self._count += 1
        return self._command
