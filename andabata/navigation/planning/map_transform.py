"""Where ``odom``, in which the robot plans, lies in the map, in which its goals are."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import Pose


class MapTransform(NamedTuple):
    """Transform from ``odom`` to the map.

    Attributes:
        c: Cosine of the turn.
        s: Sine of the turn.
        x: Shift along x [m].
        y: Shift along y [m].
    """

    c: float = 1.0
    s: float = 0.0
    x: float = 0.0
    y: float = 0.0

    def to_map(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return places of ``odom`` in the map [m], shape (k, 2)."""
        turn = np.array([[self.c, self.s], [-self.s, self.c]])
        return np.asarray(places @ turn + (self.x, self.y))


def transform_of(pose: Pose, odometry: Pose) -> MapTransform:
    """Return the transform by which a robot's pose in ``odom`` is its pose in the map.

    Args:
        pose: Pose in the map.
        odometry: Pose in ``odom``.
    """
    turn = pose.yaw - odometry.yaw
    c, s = math.cos(turn), math.sin(turn)
    (x, y), (map_x, map_y) = odometry.position[:2].tolist(), pose.position[:2].tolist()
    return MapTransform(c, s, map_x - (c * x - s * y), map_y - (s * x + c * y))
