"""Points of a planar scan on the robot, and poses relative to it."""

import math

import numpy as np
from numpy.typing import NDArray

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose


class ScanPoints:
    """Turns ranges into places in the robot's frame."""

    def __init__(self, lidar: PlanarLidarConfig) -> None:
        """Take the beams of a laser."""
        bearings = lidar.bearings + math.radians(lidar.yaw_deg)
        self._directions = np.stack([np.cos(bearings), np.sin(bearings)], axis=1)
        self._origin = np.array([lidar.x, lidar.y])
        self._max_range = lidar.max_range

    def hits(self, ranges: NDArray[np.float32], within: float) -> NDArray[np.float64]:
        """Return where beams met something in the robot's frame [m], shape (k, 2).

        Args:
            ranges: Range of each beam [m], shape (b,); NaN, infinite and not positive ones met
                nothing.
            within: Largest range that counts [m].
        """
        met = (ranges > 0) & (ranges < min(within, self._max_range))
        return np.asarray(
            self._origin + ranges[met, None].astype(np.float64) * self._directions[met]
        )


def in_robot_frame(place: tuple[float, float], robot: PlanarPose) -> tuple[float, float]:
    """Return a place in the robot's frame [m].

    Args:
        place: Place in the frame of the robot's pose [m].
        robot: Pose of the robot.
    """
    dx, dy = place[0] - robot.x, place[1] - robot.y
    c, s = math.cos(robot.yaw), math.sin(robot.yaw)
    return c * dx + s * dy, c * dy - s * dx
