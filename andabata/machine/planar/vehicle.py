"""Dynamics of a differential robot on flat ground: delay, acceleration, lag, slip, odometry.

A command is limited to what the wheels can do and acts after a delay. The speed that the robot's
own controller asks for follows it with limited accelerations, and the body follows that as a
first-order lag (assumption: the order of both), or as a skid-steered base does. Slip turns speed
into other motion than the wheels measure.
"""

import math
from typing import Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, field_validator, model_validator

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import (
    Corners,
    Obstacles,
    box_footprint,
    check_convex,
    reach_of,
    touches,
)
from andabata.machine.planar.motion import ODOM_X, RATE_V, PlanarMotion, V, W, drive_period
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.planar.odometry import OdometryErrors
from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.skid_steer import SkidSteerConfig, Swing, swing_of
from worlds.rooms.mover_motion import Movers

Interval = tuple[float, float]
"""Least and largest value."""


class DynamicsRanges(BaseModel):
    """Ranges that dynamics are drawn from for each drive, uniformly.

    Attributes:
        delay: Delay of a command [s].
        lag: Time constant of the body's lag [s].
        acceleration: Largest acceleration [m/s2].
        yaw_acceleration: Largest yaw acceleration [rad/s2].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    delay: Interval
    lag: Interval
    acceleration: Interval
    yaw_acceleration: Interval

    @model_validator(mode="after")
    def _check_order(self) -> Self:
        """Refuse ranges that end before they begin, or begin below zero."""
        for name in type(self).model_fields:
            low, high = getattr(self, name)
            if not 0 <= low <= high:
                raise ValueError(f"{name}: expected 0 <= least <= largest, got {low}, {high}")
        return self


class PlanarVehicleConfig(BaseModel):
    """A differential robot on flat ground.

    Attributes:
        footprint: Corners of its convex outline around its centre, counter-clockwise [m].
        period: Control period [s].
        substeps: Number of steps of integration, and checks for contact, in a period.
        delay: Time from a command to its effect [s]; it ends with the next step of integration.
        lag: Time constant with which the body follows its controller [s]; 0 for none.
        acceleration: Largest acceleration and deceleration [m/s2].
        yaw_acceleration: Largest yaw acceleration [rad/s2].
        max_speed: Largest speed, forwards and backwards [m/s].
        max_wheel_speed: Largest |v| + ``half_track`` |w| [m/s].
        half_track: Half of the effective track [m].
        gain_spread: Largest deviation of the gains of speed and yaw rate from 1; both are drawn for
            each drive.
        slip: Standard deviation of the ratio of motion to the wheels' motion, drawn for each period
            (assumption: for speed and yaw rate alike).
        odometry_scale: Standard deviation of the ratio of distances by odometry to true ones, drawn
            for each drive.
        odometry_turn: Standard deviation of the heading by odometry after a metre [rad]; it grows
            with the root of the way.
        speed_noise: Standard deviation of the measured speed [m/s] (assumption, as the next).
        yaw_rate_noise: Standard deviation of the measured yaw rate [rad/s].
        range_noise: Standard deviation of the laser's ranges [m].
        ranges: Ranges that the dynamics are drawn from for each drive; None takes those above.
        skid_steer: Traits of a skid-steered base beyond delay, acceleration and lag; None for a
            robot that shows nothing else.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    footprint: Corners = box_footprint(0.508, 0.430)
    period: float = Field(default=0.05, gt=0, le=1)
    substeps: int = Field(default=5, ge=1, le=100)
    delay: float = Field(default=0.05, ge=0, le=2)
    lag: float = Field(default=0.10, ge=0, le=2)
    acceleration: float = Field(default=3.0, gt=0, le=100)
    yaw_acceleration: float = Field(default=8.0, gt=0, le=1000)
    max_speed: float = Field(default=2.0, gt=0, le=20)
    max_wheel_speed: float = Field(default=2.0, gt=0, le=20)
    half_track: float = Field(default=0.28, gt=0, le=5)
    gain_spread: float = Field(default=0.03, ge=0, lt=1)
    slip: float = Field(default=0.03, ge=0, lt=1)
    odometry_scale: float = Field(default=0.01, ge=0, lt=1)
    odometry_turn: float = Field(default=0.005, ge=0, lt=1)
    speed_noise: float = Field(default=0.02, ge=0, lt=1)
    yaw_rate_noise: float = Field(default=0.02, ge=0, lt=1)
    range_noise: float = Field(default=0.01, ge=0, lt=1)
    ranges: DynamicsRanges | None = None
    skid_steer: SkidSteerConfig | None = None

    @field_validator("footprint")
    @classmethod
    def _check_footprint(cls, corners: Corners) -> Corners:
        """Refuse outlines that are not convex."""
        return check_convex(corners)

    @model_validator(mode="after")
    def _check_lag(self) -> Self:
        """Refuse a response of second order that has no lag."""
        least = self.ranges.lag[0] if self.ranges else self.lag
        if self.skid_steer is not None and least == 0:
            raise ValueError("lag: expected above 0 with skid_steer, got 0; leave skid_steer out")
        return self

    @property
    def delay_steps(self) -> int:
        """Delay in steps of integration."""
        return self.steps_of(self.delay)

    def steps_of(self, delay: float) -> int:
        """Return a delay [s] in steps of integration."""
        return math.ceil(delay / self.period * self.substeps - 1e-9)

    @property
    def odometry_errors(self) -> OdometryErrors:
        """Errors of the odometry, for this control period."""
        return OdometryErrors(self.odometry_scale, self.odometry_turn, self.slip)

    def drawn(self, rng: np.random.Generator) -> "PlanarVehicleConfig":
        """Return the vehicle of one drive: dynamics drawn from the ranges, if there are any."""
        if self.ranges is None:
            return self
        update: dict[str, object] = {
            name: float(rng.uniform(*getattr(self.ranges, name)))
            for name in DynamicsRanges.model_fields
        }
        return self.model_copy(update=update | {"ranges": None})

    def limited(self, command: Twist) -> Twist:
        """Return a command within the limits of speed; the wheels' limit keeps its curvature.

        Raises:
            ValueError: If the command is not finite.
        """
        if not (math.isfinite(command.linear) and math.isfinite(command.angular)):
            raise ValueError(f"command: expected a finite twist [m/s, rad/s], got {command}")
        speed = min(max(command.linear, -self.max_speed), self.max_speed)
        wheels = abs(speed) + self.half_track * abs(command.angular)
        scale = min(1.0, self.max_wheel_speed / max(wheels, 1e-12))
        return Twist(speed * scale, command.angular * scale)


_PLAIN = PlanarVehicleConfig()

PLANAR_VEHICLES = {
    "barn": _PLAIN,
    # Wheels of 0.098 m, 0.262 m apart along the heading and 0.376 m across it, 0.04 m wide: the
    # box around them without bumpers (assumption).
    "barn-hull": _PLAIN.model_copy(update={"footprint": box_footprint(0.458, 0.416)}),
    "barn-slow": _PLAIN.model_copy(update={"acceleration": 1.5, "lag": 0.25, "delay": 0.15}),
    # Yaw accelerations are not stated where the ranges come from (assumption).
    "barn-drawn": _PLAIN.model_copy(
        update={
            "ranges": DynamicsRanges(
                delay=(0.0, 0.2),
                lag=(0.05, 0.3),
                acceleration=(1.5, 4.0),
                yaw_acceleration=(4.0, 10.0),
            )
        }
    ),
    # Between barn and barn-slow in its numbers, of another structure.
    "barn-skid": _PLAIN.model_copy(
        update={
            "acceleration": 2.5,
            "yaw_acceleration": 6.0,
            "lag": 0.15,
            "delay": 0.08,
            "skid_steer": SkidSteerConfig(),
        }
    ),
}
"""Vehicles by name: the benchmark's with a box around all of it, with the wheels' outline, with
slow dynamics, with dynamics drawn for each drive, and a skid-steered base."""


class PlanarVehicle:
    """One robot on flat ground.

    Attributes:
        config: Settings of this drive, drawn ones included.
        state: Parts as named above, float64, shape (12,).
        contact: Contact with what it has touched, where it stays.
    """

    def __init__(
        self,
        config: PlanarVehicleConfig,
        start: PlanarPose,
        around: Obstacles,
        rng: np.random.Generator,
    ) -> None:
        """Put a robot down at rest; its odometry begins at zero.

        Args:
            config: Settings.
            start: True pose.
            around: Obstacles.
            rng: Source of randomness of the drive; each period takes as many numbers.
        """
        self.config = config = config.drawn(rng)
        self._rng, self._around = rng, around
        self._odometry_errors = config.odometry_errors
        self._corners = np.array(config.footprint, dtype=np.float64)
        gains = 1.0 + config.gain_spread * rng.uniform(-1.0, 1.0, 2)
        dt = config.period / config.substeps
        skid = config.skid_steer
        self._motion = PlanarMotion(
            dt=dt,
            substeps=config.substeps,
            follow=-math.expm1(-dt / config.lag) if config.lag > 0 else 1.0,
            acceleration=config.acceleration * dt,
            yaw_acceleration=config.yaw_acceleration * dt,
            gain=float(gains[0]),
            yaw_gain=float(gains[1]),
            odometry_scale=config.odometry_errors.drawn_scale(rng),
            odometry_turn=config.odometry_turn,
            reach=reach_of(config.footprint),
            braking=skid.braking if skid else 1.0,
            understeer=skid.understeer if skid else 0.0,
            swing=swing_of(skid.damping, config.lag, dt) if skid else Swing(0.0, 0.0, 0.0, 0.0),
            is_swinging=skid is not None,
        )
        self.state = np.zeros(12)
        self.state[:V] = start
        most = config.steps_of(config.delay + (skid.delay_jitter if skid else 0.0))
        waiting = math.ceil(most / config.substeps) + 1
        self._commands = np.zeros((waiting, 2))
        self._delays = np.full(waiting, config.delay_steps)
        meets = touches(*start, self._corners, self._motion.reach, around)
        self.contact = Contact.OBSTACLE if meets else Contact.NONE
        self._no_movers = Movers.none(config.substeps)

    @property
    def has_contact(self) -> bool:
        """True once it has touched something."""
        return self.contact is not Contact.NONE

    @property
    def pose(self) -> PlanarPose:
        """True pose."""
        return PlanarPose(*self.state[:V].tolist())

    @property
    def odometry(self) -> PlanarPose:
        """Pose by odometry, from the start."""
        return PlanarPose(*self.state[ODOM_X:RATE_V].tolist())

    @property
    def velocity(self) -> Twist:
        """Speed and yaw rate of the wheels, without the noise of their measurement."""
        return Twist(float(self.state[V]), float(self.state[W]))

    def step(self, command: Twist, movers: Movers | None = None) -> None:
        """Drive for one control period.

        Args:
            command: Wanted twist; it is limited, and acts after the delay.
            movers: Movers at the end of each step of integration, the first axis; None for none.

        Raises:
            ValueError: If the command is not finite.
        """
        self._take(self.config.limited(command))
        draws = self._odometry_errors.drawn_period(self._rng)
        if not self.has_contact:
            contact = drive_period(
                self.state,
                self._commands,
                self._delays,
                draws,
                self._motion,
                self._corners,
                self._around,
                self._no_movers if movers is None else movers,
            )
            self.contact = Contact(contact)

    def _take(self, command: Twist) -> None:
        """Put a command in front of those that wait, with its delay."""
        config, skid = self.config, self.config.skid_steer
        self._commands[1:] = self._commands[:-1].copy()
        if skid is not None:
            command = skid.followed(command, config.half_track)
            self._delays[1:] = self._delays[:-1].copy()
            jitter = skid.delay_jitter * float(self._rng.random())
            self._delays[0] = config.steps_of(config.delay + jitter)
        self._commands[0] = command.linear, command.angular
