"""What a robot on flat ground measures in a control period, and what its navigator answers."""

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig


class PlanarPose(NamedTuple):
    """Pose in the plane.

    Attributes:
        x: Position [m].
        y: Position [m].
        yaw: Heading [rad].
    """

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class PlanarReadings:
    """Measurements at the begin of a control period.

    Attributes:
        stamp: Time [s].
        odometry: Pose by dead reckoning, which drifts and never jumps.
        velocity: Measured speed [m/s] and yaw rate [rad/s].
        ranges: Range of each beam of the laser from its origin, infinite without a return, NaN
            where nothing was measured [m], float32, shape (b,).
        movers: True movers, seen or not, in the frame of the odometry: x, y [m], velocity [m/s] and
            radius [m], shape (m, 5). None of a real robot, which cannot know.
    """

    stamp: float
    odometry: PlanarPose
    velocity: Twist
    ranges: NDArray[np.float32]
    movers: NDArray[np.float64] | None = None


class PlanarNavigator(Protocol):
    """Drives a robot on flat ground to one goal by its laser and its odometry, without a map."""

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Forget the last drive.

        Args:
            lidar: Laser of the robot.
            goal: Goal in the frame of the odometry, which begins at the start [m].
        """

    def act(self, readings: PlanarReadings) -> Twist:
        """Return the command of this control period; the robot limits it and is late."""
