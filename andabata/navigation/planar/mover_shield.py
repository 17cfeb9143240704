"""Mover shield: lets a command pass only if the robot can still get out of movers' way after it.

Movers are tracked in the scans and expected to go on straight. After one period of the command some
constant arc has to stay clear of them, and of what stands, for a while. If none does, the arc that
stays clear from now on and is most like the command is driven, and if there is none, the one that
stays clear longest. Where nothing moves near the robot every command passes: standing obstacles are
the driver's own business.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.navigation.mover_forecast import mover_offset
from andabata.navigation.mover_tracks import TrackedMovers
from andabata.navigation.planar.circle_tracks import CircleTracks, CircleTracksConfig
from andabata.navigation.planar.clearance_field import (
    ClearanceField,
    clearance_at,
    clearance_field,
)
from andabata.navigation.planar.hit_layer import LaserPose
from terrain.kernel import kernel


class MoverShieldConfig(BaseModel):
    """Settings of ``MoverShield``, all of them assumptions.

    Attributes:
        tracks: Settings of the tracks.
        horizon: Time for which an arc has to stay clear [s].
        step: Time between two looks at an arc [s].
        speeds: Number of speeds of the arcs, 0 and the largest included.
        yaw_rates: Number of yaw rates, both limits included.
        mover_margin: Distance to a mover that counts as contact [m].
        margin: Distance to what stands that counts as contact [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    tracks: CircleTracksConfig = CircleTracksConfig()
    horizon: float = Field(default=2.0, gt=0, le=10)
    step: float = Field(default=0.05, gt=0)
    speeds: int = Field(default=5, ge=2)
    yaw_rates: int = Field(default=5, ge=2)
    mover_margin: float = Field(default=0.05, ge=0)
    margin: float = Field(default=0.01, ge=0)


class _Law(NamedTuple):
    """Numbers that the compiled choice depends on.

    Attributes:
        step: Time between two looks [s].
        horizon: Number of looks at an arc.
        period: Number of looks in a control period.
        radius: Radius of the robot [m].
        mover_margin: Distance to a mover that counts as contact [m].
        margin: Distance to what stands that counts as contact [m].
    """

    step: float
    horizon: int
    period: int
    radius: float
    mover_margin: float
    margin: float


class MoverShield:
    """Checks the commands of a round robot that follows each command exactly.

    Attributes:
        config: Settings.
    """

    def __init__(
        self,
        lidar: PlanarLidarConfig,
        radius: float,
        largest: Twist,
        period: float,
        config: MoverShieldConfig | None = None,
    ) -> None:
        """Prepare for a robot.

        Args:
            lidar: Laser.
            radius: Radius [m].
            largest: Largest speed and yaw rate; it drives no way back.
            period: Control period, and time between two scans [s].
            config: Settings.
        """
        self.config = config = config or MoverShieldConfig()
        self._tracks = CircleTracks(lidar, period, config.tracks)
        self._mount = LaserPose(lidar.x, lidar.y, math.radians(lidar.yaw_deg))
        self._bearings, self._reach = lidar.bearings, lidar.max_range * _NEARLY
        speeds = np.linspace(0.0, largest.linear, config.speeds)
        rates = np.linspace(-largest.angular, largest.angular, config.yaw_rates)
        self._arcs = np.array([(speed, rate) for speed in speeds for rate in rates])
        # A speed counts as the share of its limits does, which span 0 to the largest.
        self._scale = np.array([2.0 / largest.linear, 1.0 / largest.angular])
        self._fastest, self._radius = largest.linear, radius
        looks = max(1, round(config.horizon / config.step)), max(1, round(period / config.step))
        self._law = _Law(config.step, *looks, radius, config.mover_margin, config.margin)
        self.reset()

    @property
    def movers(self) -> TrackedMovers:
        """Movers as of the last scan, in the frame of its pose."""
        return self._movers

    def reset(self) -> None:
        """Forget what was seen."""
        self._tracks.reset()
        self._pose, self._hits = LaserPose(), np.zeros((0, 2))
        self._movers = TrackedMovers.none()

    def update(self, pose: LaserPose, ranges: NDArray[np.float64]) -> None:
        """Take a scan.

        Args:
            pose: Pose of the robot, in a frame that does not jump.
            ranges: Range of each beam [m], shape (b,).
        """
        self._pose, self._movers = pose, self._tracks.update(pose, ranges)
        eye, met = self._mount.on(pose), (ranges > 0) & (ranges < self._reach)
        bearings = eye.yaw + self._bearings[met]
        places = np.stack([np.cos(bearings), np.sin(bearings)], axis=1) * ranges[met, None]
        self._hits = places + np.array(eye[:2])

    def safe(self, command: Twist) -> Twist:
        """Return the command, or the one that gets out of the movers' way."""
        near = self._near()
        if not len(near.radii):
            return command
        half = self._fastest * self.config.horizon + self._radius + _SLACK
        pose = np.array(self._pose)
        away = np.hypot(*(self._hits[:, None] - near.places).transpose(2, 0, 1))
        standing = self._hits[(away > near.radii + _SLACK).all(axis=1)]
        far = self._radius + self.config.margin + _SLACK
        field = clearance_field(standing, (pose[0], pose[1]), half, _CELL, far)
        twist = np.array([command.linear, command.angular])
        chosen = _choice(pose, twist, self._arcs, self._scale, near, field, self._law)
        return command if chosen < 0 else Twist(*self._arcs[chosen].tolist())

    def _near(self) -> TrackedMovers:
        """Return the movers that could meet the robot within the horizon."""
        places, velocities, radii = self._movers[:3]
        speeds = np.hypot(*velocities.T) + self._fastest
        gaps = np.hypot(*(places - self._pose[:2]).T) - radii - self._radius
        is_near = gaps < speeds * self.config.horizon + self.config.mover_margin
        return self._movers.select(is_near)


_NEARLY = 1 - 1e-4
"""Share of the largest range from which on a beam has met nothing, in single precision."""

_SLACK = 0.1
"""Distance from a tracked circle up to which hits are its own [m], and by which the field of
distances is larger than what is asked of it."""

_CELL = 0.05
"""Edge of a cell of the field [m]."""


@kernel
def _choice(
    pose: NDArray[np.float64],
    command: NDArray[np.float64],
    arcs: NDArray[np.float64],
    scale: NDArray[np.float64],
    movers: TrackedMovers,
    field: ClearanceField,
    law: _Law,
) -> int:
    """Return the number of the arc to drive, -1 for the command.

    Args:
        pose: x, y [m] and yaw [rad] of the robot, shape (3,).
        command: Speed [m/s] and yaw rate [rad/s], shape (2,).
        arcs: Commands that may be driven afterwards, or instead, shape (a, 2).
        scale: Weights of differences of speeds and of yaw rates, shape (2,).
        movers: Movers.
        field: Distances from what stands.
        law: Numbers of the settings.
    """
    if _clear(pose, command, 0, law.period, movers, field, law) == law.period:
        after, left = _after(pose, command, law.period * law.step), law.horizon - law.period
        for arc in arcs:
            if _clear(after, arc, law.period, left, movers, field, law) == left:
                return -1
    best, longest, least = 0, -1, np.inf
    for k in range(len(arcs)):
        looks = _clear(pose, arcs[k], 0, law.horizon, movers, field, law)
        off = np.sum(((arcs[k] - command) * scale) ** 2)
        if looks > longest or (looks == longest and off < least):
            best, longest, least = k, looks, off
    return best


@kernel
def _clear(
    pose: NDArray[np.float64],
    arc: NDArray[np.float64],
    begin: int,
    looks: int,
    movers: TrackedMovers,
    field: ClearanceField,
    law: _Law,
) -> int:
    """Return the number of looks, of the given ones, before the first that sees a contact.

    Args:
        pose: Pose at the begin, shape (3,).
        arc: Speed [m/s] and yaw rate [rad/s], shape (2,).
        begin: Number of looks since the movers were where they are.
        looks: Number of looks.
        movers: Movers.
        field: Distances from what stands; a robot that turns on the spot does not meet it.
        law: Numbers of the settings.
    """
    for look in range(1, looks + 1):
        place, time = _after(pose, arc, look * law.step), (begin + look) * law.step
        x, y = place[0], place[1]
        if arc[0] > 0.0 and clearance_at(x, y, field) < law.radius + law.margin:
            return look - 1
        for m in range(len(movers.radii)):
            dx, dy = mover_offset(movers.places, movers.velocities, m, time, x, y)
            reach = law.radius + movers.radii[m] + law.mover_margin
            if dx * dx + dy * dy < reach * reach:
                return look - 1
    return looks


@kernel
def _after(pose: NDArray[np.float64], arc: NDArray[np.float64], time: float) -> NDArray[np.float64]:
    """Return a pose after a time on an arc, shape (3,).

    Args:
        pose: x, y [m] and yaw [rad] at the begin, shape (3,).
        arc: Speed [m/s] and yaw rate [rad/s], shape (2,).
        time: Time [s].
    """
    half = 0.5 * arc[1] * time
    # An arc's chord leaves at half the turn; its length is the arc's times sinc.
    chord = arc[0] * time * (np.sin(half) / half if abs(half) > 1e-9 else 1.0)
    middle = pose[2] + half
    return np.array(
        [pose[0] + chord * np.cos(middle), pose[1] + chord * np.sin(middle), middle + half]
    )
