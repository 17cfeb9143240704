"""Follow the gap: steer to the middle of the widest gap, and to the goal where nothing is near.

Sezer and Gokasan 2012, "A novel obstacle avoidance algorithm: Follow the Gap Method", Robotics and
Autonomous Systems 60 (9). Obstacles are widened by half of the robot's width; what no widened
obstacle hides is a gap. The heading is the mean of those to the middle of the gap and to the goal,
weighed by how near the nearest obstacle is (equation 16). The paper leaves the speed, and how a
heading is driven, to the robot (assumptions).
"""

import math

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarReadings
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.navigation.planar.scan_points import ScanPoints, in_robot_frame


class FollowGapConfig(BaseModel):
    """Settings of ``FollowGapNavigator``.

    Attributes:
        alpha: Weight of the gap at a metre from the nearest obstacle (the paper's alpha).
        look: Distance up to which obstacles count [m].
        radius: Distance by which obstacles are widened [m].
        field: Half of the angle, from straight ahead, in which gaps are looked for [rad].
        to_goal: Share of a gap's width that an angle to the goal is worth: 0 takes the widest gap,
            as the paper does.
        max_speed: Largest speed [m/s].
        creep: Least speed along a heading, however short the free way is [m/s].
        stop: Free way ahead at which the robot is no faster than that [m].
        slow: Free way ahead from which on it drives at its largest speed [m].
        gain: Yaw rate for a radian of error [1/s].
        max_yaw_rate: Largest yaw rate [rad/s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    alpha: float = Field(default=3.0, ge=0)
    look: float = Field(default=1.5, gt=0)
    radius: float = Field(default=0.30, gt=0)
    field: float = Field(default=math.pi / 2, gt=0, le=math.pi)
    to_goal: float = Field(default=1.0, ge=0)
    max_speed: float = Field(default=1.0, gt=0)
    creep: float = Field(default=0.15, ge=0)
    stop: float = Field(default=0.35, ge=0)
    slow: float = Field(default=1.5, gt=0)
    gain: float = Field(default=2.5, gt=0)
    max_yaw_rate: float = Field(default=2.5, gt=0)


class FollowGapNavigator:
    """Steers by the gaps of the last scan alone."""

    def __init__(self, vehicle: PlanarVehicleConfig, config: FollowGapConfig | None = None) -> None:
        """Take the robot as far as it is known, and the settings."""
        self.config = config or FollowGapConfig()
        self._half_width = max(y for _, y in vehicle.footprint)
        self._goal = (0.0, 0.0)
        self._points, self._turn = ScanPoints(PlanarLidarConfig()), 0.0

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Take laser and goal; see ``PlanarNavigator``."""
        self._points, self._goal, self._turn = ScanPoints(lidar), goal, 0.0

    def act(self, readings: PlanarReadings) -> Twist:
        """Return the command of this period."""
        config = self.config
        x, y = in_robot_frame(self._goal, readings.odometry)
        to_goal, away = math.atan2(y, x), math.hypot(x, y)
        # What stands behind the goal is in nobody's way.
        hits = self._points.hits(readings.ranges, min(config.look, away + config.radius))
        if not len(hits):
            return self._steer(to_goal, math.inf)
        distances = np.hypot(*hits.T)
        gap = self._gap(hits, distances, to_goal)
        if gap is None:
            # Closed in: turn on the spot, one way, until there is a gap.
            self._turn = self._turn or math.copysign(0.5 * config.max_yaw_rate, to_goal)
            return Twist(0.0, self._turn)
        self._turn = 0.0
        weight = config.alpha / max(float(distances.min()), 1e-3)
        heading = (weight * gap + to_goal) / (weight + 1.0)
        return self._steer(heading, self._free_way(hits, heading))

    def _gap(
        self, hits: NDArray[np.float64], distances: NDArray[np.float64], to_goal: float
    ) -> float | None:
        """Return the bearing of the middle of the best gap [rad], None without any.

        Args:
            hits: Places of hits [m], shape (k, 2).
            distances: Their distances from the robot's centre [m], shape (k,).
            to_goal: Bearing of the goal [rad].
        """
        config = self.config
        angles = np.linspace(-config.field, config.field, 181)
        bearings = np.arctan2(hits[:, 1], hits[:, 0])
        widths = np.arcsin(np.minimum(config.radius / distances, 1.0))
        apart = np.abs(np.pi - (np.pi - angles[:, None] + bearings) % (2 * np.pi))
        is_free = (apart > widths).all(axis=1)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], is_free.astype(np.int8), [0]])))
        best, bearing = -math.inf, None
        for first, end in edges.reshape(-1, 2).tolist():
            low, high = angles[first], angles[end - 1]
            middle = self._middle(low, high, hits, bearings, distances)
            worth = (high - low) - config.to_goal * abs(min(max(to_goal, low), high) - to_goal)
            if worth > best:
                best, bearing = worth, middle
        return bearing

    def _middle(
        self,
        low: float,
        high: float,
        hits: NDArray[np.float64],
        bearings: NDArray[np.float64],
        distances: NDArray[np.float64],
    ) -> float:
        """Return the bearing of the point between the obstacles on both sides of a gap [rad].

        This is equation 10 of the paper: the angle to the middle of the segment between them, not
        the middle of the angle. A side without an obstacle is taken at the range that counts.
        """
        ends = []
        for angle, side in ((low, -1.0), (high, 1.0)):
            beyond = np.flatnonzero(side * (bearings - angle) >= 0)
            if len(beyond) and abs(angle) < self.config.field - 1e-6:
                ends.append(hits[beyond[np.abs(bearings[beyond] - angle).argmin()]])
            else:
                far = self.config.look
                ends.append(np.array([far * math.cos(angle), far * math.sin(angle)]))
        x, y = (ends[0] + ends[1]).tolist()
        bearing = math.atan2(y, x)
        return bearing if low <= bearing <= high else (low + high) / 2

    def _free_way(self, hits: NDArray[np.float64], heading: float) -> float:
        """Return how far a strip as wide as the robot is free along a heading [m]."""
        c, s = math.cos(heading), math.sin(heading)
        along, aside = hits @ (c, s), hits @ (-s, c)
        ahead = along[(np.abs(aside) < self._half_width + 0.05) & (along > 0)]
        return float(ahead.min(initial=math.inf))

    def _steer(self, heading: float, free_way: float) -> Twist:
        """Return the command that turns to a heading with some free way along it [m]."""
        config = self.config
        yaw_rate = min(max(config.gain * heading, -config.max_yaw_rate), config.max_yaw_rate)
        share = (free_way - config.stop) / (config.slow - config.stop)
        speed = max(config.max_speed * min(max(share, 0.0), 1.0), config.creep)
        return Twist(speed * max(math.cos(heading), 0.0), yaw_rate)
