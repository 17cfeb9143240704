"""Dynamic window: of the speeds that the next moment allows, the best that can still stop.

Fox, Burgard and Thrun 1997, "The dynamic window approach to collision avoidance", IEEE Robotics and
Automation Magazine 4 (1): heading, distance and speed are weighed against each other over all
admissible pairs of speed and yaw rate (section IV). Alone it stays in pockets; with a map it heads
for sub-goals of a grid planner, as navigation stacks do (Brock and Khatib 1999).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarReadings
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.navigation.planar.clearance_field import (
    ClearanceField,
    body_clearance,
    body_discs,
    clearance_field,
)
from andabata.navigation.planar.hit_layer import LaserPose
from andabata.navigation.planar.lidar_map import ROOM_COSTS, LidarMap, LidarMapConfig
from andabata.navigation.planar.scan_points import ScanPoints, in_robot_frame
from terrain.kernel import kernel

_STEP = 0.05
"""Distance between two checks along an arc [m]."""

VEHICLE_MAP = LidarMapConfig(
    robot_radius=0.21,
    costs=ROOM_COSTS.model_copy(update={"inscribed_radius": 0.30, "inflation_radius": 0.6}),
)
"""Map for a box of 0.508 x 0.430 m: its half width and a margin are the inscribed radius."""


class DynamicWindowConfig(BaseModel):
    """Settings of ``DynamicWindowNavigator``.

    Attributes:
        heading: Weight of the heading towards the target (the paper's alpha).
        distance: Weight of the way to the next obstacle (its beta).
        speed: Weight of the speed (its gamma).
        window: Time in which the speeds of the window are reached [s].
        look: Largest way that counts [m].
        margin: Least clearance of the body [m].
        margin_time: Clearance that each unit of speed adds [s].
        predict: Time after which the heading is judged [s].
        max_speed: Largest speed [m/s].
        max_yaw_rate: Largest yaw rate [rad/s].
        speeds: Number of speeds in the window.
        yaw_rates: Number of yaw rates in the window.
        map: Settings of the map that gives sub-goals; None heads for the goal itself.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    heading: float = Field(default=1.0, ge=0)
    distance: float = Field(default=0.4, ge=0)
    speed: float = Field(default=0.4, ge=0)
    window: float = Field(default=0.25, gt=0)
    look: float = Field(default=2.5, gt=0)
    margin: float = Field(default=0.03, ge=0)
    margin_time: float = Field(default=0.04, ge=0)
    predict: float = Field(default=0.5, gt=0)
    max_speed: float = Field(default=2.0, gt=0)
    max_yaw_rate: float = Field(default=2.0, gt=0)
    speeds: int = Field(default=7, ge=2)
    yaw_rates: int = Field(default=21, ge=3)
    map: LidarMapConfig | None = VEHICLE_MAP


class _Weights(NamedTuple):
    """Numbers that the compiled choice depends on; see ``DynamicWindowConfig``.

    Attributes:
        heading: Weight of the heading.
        distance: Weight of the way.
        speed: Weight of the speed.
        look: Largest way that counts [m].
        margin: Least clearance [m].
        margin_time: Clearance for each unit of speed [s].
        predict: Time after which the heading is judged [s].
        max_speed: Largest speed [m/s].
        acceleration: Deceleration with which the robot stops [m/s2].
        yaw_acceleration: Deceleration with which it stops to turn [rad/s2].
    """

    heading: float
    distance: float
    speed: float
    look: float
    margin: float
    margin_time: float
    predict: float
    max_speed: float
    acceleration: float
    yaw_acceleration: float


class DynamicWindowNavigator:
    """Chooses a speed and a yaw rate of the dynamic window each period."""

    def __init__(
        self, vehicle: PlanarVehicleConfig, config: DynamicWindowConfig | None = None
    ) -> None:
        """Take the robot as far as it is known, and the settings."""
        self.config = config = config or DynamicWindowConfig()
        self._vehicle, self._discs = vehicle, body_discs(vehicle.footprint)
        self._map = None if config.map is None else LidarMap(config.map)
        self._weights = _Weights(
            heading=config.heading,
            distance=config.distance,
            speed=config.speed,
            look=config.look,
            margin=config.margin,
            margin_time=config.margin_time,
            predict=config.predict,
            max_speed=config.max_speed,
            acceleration=vehicle.acceleration,
            yaw_acceleration=vehicle.yaw_acceleration,
        )
        self.reset(PlanarLidarConfig(), (0.0, 0.0))

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Forget the last drive; see ``PlanarNavigator``."""
        self._lidar, self._goal, self._points = lidar, goal, ScanPoints(lidar)
        self._bearings = lidar.bearings
        self._mount = LaserPose(lidar.x, lidar.y, math.radians(lidar.yaw_deg))
        if self._map is not None:
            self._map.reset()

    def act(self, readings: PlanarReadings) -> Twist:
        """Return the best admissible command of the window, a turn on the spot without any."""
        config = self.config
        x, y = in_robot_frame(self._target(readings), readings.odometry)
        hits = self._points.hits(readings.ranges, config.look + 1.0)
        field = clearance_field(hits, (0.0, 0.0), config.look + 0.5)
        v, w = readings.velocity.linear, readings.velocity.angular
        speeds = _window(v, self._vehicle.acceleration * config.window, 0.0, config.max_speed)
        turn = self._vehicle.yaw_acceleration * config.window
        turns = _window(w, turn, -config.max_yaw_rate, config.max_yaw_rate)
        pair = _best(
            np.linspace(*speeds, config.speeds),
            np.linspace(*turns, config.yaw_rates),
            np.array([x, y]),
            self._discs,
            field,
            self._weights,
        )
        if pair[0] < 0.0:
            return Twist(0.0, math.copysign(0.5 * config.max_yaw_rate, math.atan2(y, x)))
        return Twist(*pair)

    def _target(self, readings: PlanarReadings) -> tuple[float, float]:
        """Return the goal, or the sub-goal of the map, in the frame of the odometry [m]."""
        if self._map is None:
            return self._goal
        ranges = readings.ranges
        pose = np.array(readings.odometry)
        self._map.update(pose, self._bearings, ranges, self._lidar.max_range, self._mount)
        x, y = self._map.subgoal(pose[:2], np.array(self._goal)).tolist()
        return x, y


def _window(value: float, reach: float, low: float, high: float) -> tuple[float, float]:
    """Return what can be reached from a value within limits, the nearest limit if nothing can."""
    return min(max(value - reach, low), high), max(min(value + reach, high), low)


@kernel
def _best(
    speeds: NDArray[np.float64],
    turns: NDArray[np.float64],
    target: NDArray[np.float64],
    discs: NDArray[np.float64],
    field: ClearanceField,
    weights: _Weights,
) -> tuple[float, float]:
    """Return the admissible pair of the largest objective, (-1, 0) without any.

    Args:
        speeds: Speeds of the window [m/s].
        turns: Yaw rates of the window [rad/s].
        target: Place to head for in the robot's frame [m], shape (2,).
        discs: Discs of the body, shape (d, 3).
        field: Distances from the scan's points in the robot's frame.
        weights: Weights and limits.
    """
    best, pair = -np.inf, (-1.0, 0.0)
    for v in speeds:
        for w in turns:
            way = _way(v, w, discs, field, weights)
            # It has to be able to stop before what it meets, and its turn, too.
            if v > np.sqrt(2.0 * way * weights.acceleration):
                continue
            if v > 1e-3 and abs(w) > np.sqrt(2.0 * way * abs(w) / v * weights.yaw_acceleration):
                continue
            x, y, yaw = _pose(v, w, weights.predict)
            off = np.arctan2(target[1] - y, target[0] - x) - yaw
            off = abs(np.pi - (np.pi - off) % (2 * np.pi))
            worth = weights.heading * (1.0 - off / np.pi)
            worth += weights.distance * way / weights.look
            worth += weights.speed * v / weights.max_speed
            if worth > best:
                best, pair = worth, (v, w)
    return pair


@kernel
def _way(
    v: float, w: float, discs: NDArray[np.float64], field: ClearanceField, weights: _Weights
) -> float:
    """Return the free way along an arc [m], the largest that counts at most."""
    margin = weights.margin + weights.margin_time * v
    # Where it is nearer already, it may drive where it gets no nearer.
    margin = min(margin, body_clearance(0.0, 0.0, 0.0, discs, field) - 1e-3)
    # A turn on the spot sweeps the corners: it is checked by its angle, half a turn at most.
    rate = max(v, abs(w) * 0.3)
    if rate < 1e-3:
        return weights.look
    steps = int(min(weights.look, np.inf if v > 0.05 else 1.0) / _STEP)
    for k in range(1, steps + 1):
        x, y, yaw = _pose(v, w, k * _STEP / rate)
        if body_clearance(x, y, yaw, discs, field) < margin:
            return (k - 1) * _STEP
    return weights.look


@kernel
def _pose(v: float, w: float, time: float) -> tuple[float, float, float]:
    """Return where an arc is after a time, from the origin and along x: x, y [m], yaw [rad]."""
    half = 0.5 * w * time
    chord = v * time * (np.sin(half) / half if abs(half) > 1e-9 else 1.0)
    return chord * np.cos(half), chord * np.sin(half), w * time
