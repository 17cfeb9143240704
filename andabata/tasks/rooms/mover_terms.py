"""Movers as a part of observations in rooms: the nearest tracked ones, in the robot's frame.

They come from the tracker of the shield (``MoverShield``), in training and in driving alike, so
that a policy learns with its misses, its errors and the time until it believes a track.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.navigation.mover_tracks import TrackedMovers
from andabata.navigation.planar.circle_tracks import CircleTracks
from andabata.navigation.planar.hit_layer import LaserPose
from andabata.navigation.planar.mover_shield import MoverShield
from andabata.tasks.rooms.kernel import MIN_RANGE

MOVER_COLUMNS = 6
"""Numbers of a mover: cos a / d and sin a / d of its bearing a and the distance d of its centre
[1/m], velocity over ground, ahead and to the left [m/s], radius [m], 1 for a mover and 0 for none.
"""


class SeenMovers:
    """Nearest tracked movers of many robots.

    Attributes:
        rows: Movers of each robot as it observes them, float32, shape (n, k, ``MOVER_COLUMNS``).
    """

    def __init__(
        self,
        count: int,
        movers: int,
        lidar: PlanarLidarConfig,
        period: float,
        shields: Sequence[MoverShield],
    ) -> None:
        """Begin without tracks.

        Args:
            count: Number n of robots.
            movers: Number k of movers of each; 0 tracks nothing.
            lidar: Laser.
            period: Time between two scans [s].
            shields: Shield of each robot, whose tracks are taken; none where there is none.
        """
        self.rows = np.zeros((count, movers, MOVER_COLUMNS), dtype=np.float32)
        self._shields = shields
        own = 0 if shields or not movers else count
        self._trackers = [CircleTracks(lidar, period) for _ in range(own)]

    def restart(self, k: int) -> None:
        """Forget what robot ``k`` saw; its shield forgets by itself."""
        if self._trackers:
            self._trackers[k].reset()

    def update(
        self,
        numbers: Sequence[int],
        poses: NDArray[np.float64],
        reciprocals: NDArray[np.float32],
    ) -> None:
        """Take the scans of some robots, after their shields did.

        Args:
            numbers: Indices of the robots.
            poses: x, y [m] and yaw [rad] that all robots believe in, shape (n, 3).
            reciprocals: Reciprocals of the beams of those robots [1/m], shape (m, b).
        """
        count = self.rows.shape[1]
        for k, row in zip(numbers, reciprocals, strict=True) if count else ():
            pose = LaserPose(*poses[k].tolist())
            if self._shields:
                tracked = self._shields[k].movers
            else:
                tracked = self._trackers[k].update(pose, 1.0 / row)
            self.rows[k] = nearest_movers(tracked, pose, count)


def nearest_movers(movers: TrackedMovers, pose: LaserPose, count: int) -> NDArray[np.float32]:
    """Return the nearest movers as they are observed, float32, shape (count, ``MOVER_COLUMNS``).

    The nearest comes first; rows without one are 0, as if it were infinitely far away.

    Args:
        movers: Movers, in the frame of the pose.
        pose: Pose of the robot.
        count: Number of rows.
    """
    c, s = np.cos(pose.yaw), np.sin(pose.yaw)
    rotation = np.array([[c, -s], [s, c]])
    offsets = (movers.places - pose[:2]) @ rotation
    distances = np.maximum(np.hypot(*offsets.T), MIN_RANGE)
    nearest = np.argsort(distances - movers.radii, kind="stable")[:count]
    rows = np.zeros((count, MOVER_COLUMNS), dtype=np.float32)
    seen = rows[: len(nearest)]
    seen[:, :2] = (offsets / distances[:, None] ** 2)[nearest]
    seen[:, 2:4] = (movers.velocities @ rotation)[nearest]
    seen[:, 4], seen[:, 5] = movers.radii[nearest], 1.0
    return rows
