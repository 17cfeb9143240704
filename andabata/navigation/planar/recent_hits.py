"""Hits around a robot on flat ground: those of the last scan, and older ones where it is blind.

A laser that does not look behind loses what the robot drives past, which its rear corners meet in a
turn. What the last scan can see counts as it sees it: older hits there would only add noise.
"""

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.navigation.planar.scan_points import ScanPoints
from terrain.kernel import kernel


class RecentHitsConfig(BaseModel):
    """Settings of ``RecentHits``.

    Attributes:
        max_range: Largest range of a hit [m].
        keyframes: Number of older scans that are remembered.
        keyframe_distance: Distance driven between two of them [m].
        keyframe_angle: Turn between two of them [rad].
        keyframe_range: Largest distance of remembered hits from the robot that saw them [m].
        keyframe_stride: Number of hits of which one is remembered.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    max_range: float = Field(default=10.0, gt=0)
    keyframes: int = Field(default=20, ge=0)
    keyframe_distance: float = Field(default=0.10, gt=0)
    keyframe_angle: float = Field(default=0.20, gt=0)
    keyframe_range: float = Field(default=1.5, gt=0)
    keyframe_stride: int = Field(default=3, ge=1)


class RecentHits:
    """Remembers a few scans along the way.

    Attributes:
        config: Settings.
    """

    def __init__(self, config: RecentHitsConfig | None = None) -> None:
        """Take the settings."""
        self.config = config or RecentHitsConfig()
        self.reset(PlanarLidarConfig())

    def reset(self, lidar: PlanarLidarConfig) -> None:
        """Forget all scans.

        Args:
            lidar: Laser of the robot.
        """
        self._points = ScanPoints(lidar)
        self._origin = np.array([lidar.x, lidar.y])
        self._middle = math.radians(lidar.yaw_deg)
        self._half_field = math.radians(lidar.fov_deg) / 2
        self._scans: list[NDArray[np.float64]] = []
        self._last: PlanarPose | None = None

    def update(self, readings: PlanarReadings) -> NDArray[np.float64]:
        """Take in a scan and return the hits around in the robot's frame [m], shape (k, 2).

        Args:
            readings: Measurements of this period.
        """
        config, pose = self.config, readings.odometry
        seen = self._points.hits(readings.ranges, config.max_range)
        blind = [
            _behind(scan, *pose, self._origin, self._middle, self._half_field)
            for scan in self._scans
        ]
        if config.keyframes and self._has_moved(pose):
            near = seen[np.hypot(*seen.T) < config.keyframe_range][:: config.keyframe_stride]
            c, s = math.cos(pose.yaw), math.sin(pose.yaw)
            self._scans.append(near @ np.array([[c, s], [-s, c]]) + (pose.x, pose.y))
            self._scans = self._scans[-config.keyframes :]
            self._last = pose
        return np.vstack([seen, *blind])

    def _has_moved(self, pose: PlanarPose) -> bool:
        """Return True if the robot is far enough from where it last remembered a scan."""
        if self._last is None:
            return True
        turned = abs(math.remainder(pose.yaw - self._last.yaw, math.tau))
        way = math.hypot(pose.x - self._last.x, pose.y - self._last.y)
        return way > self.config.keyframe_distance or turned > self.config.keyframe_angle


@kernel
def _behind(
    places: NDArray[np.float64],
    x: float,
    y: float,
    yaw: float,
    laser: NDArray[np.float64],
    middle: float,
    half_field: float,
) -> NDArray[np.float64]:
    """Return the places out of the laser's field of view in the robot's frame [m], shape (j, 2).

    Args:
        places: Places in the frame of the pose [m], shape (k, 2).
        x: Position of the robot [m].
        y: Position of the robot [m].
        yaw: Heading [rad].
        laser: Position of the laser in the robot's frame [m], shape (2,).
        middle: Heading of the laser from the robot's [rad].
        half_field: Half of the field of view [rad].
    """
    cosine, sine = np.cos(yaw), np.sin(yaw)
    unseen = np.empty_like(places)
    count = 0
    for k in range(len(places)):
        dx, dy = places[k, 0] - x, places[k, 1] - y
        ahead, left = cosine * dx + sine * dy, cosine * dy - sine * dx
        bearing = np.arctan2(left - laser[1], ahead - laser[0]) - middle
        if abs(np.pi - (np.pi - bearing) % (2.0 * np.pi)) > half_field:
            unseen[count, 0], unseen[count, 1] = ahead, left
            count += 1
    return unseen[:count].copy()
