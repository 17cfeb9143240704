"""Navigator for flat ground at speed: sampling MPC over remembered hits and a time-to-go field.

The laser's hits are remembered around the robot. Over them stands the field of the time to the
goal, at the end of which the rollouts of the controller are judged. How the robot follows commands
is identified from its own commands and odometry while it drives, unless it is known. What moves can
be followed, and priced where it will be at the time of each step.
"""

import math
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, model_validator

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import inner_radius_of, reach_of
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarReadings
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.navigation.mover_forecast import NO_MOVERS, MoverForecastConfig, forecast_of
from andabata.navigation.mover_tracks import TrackedMovers
from andabata.navigation.planar.circle_tracks import CircleTracks, CircleTracksConfig
from andabata.navigation.planar.dynamics import (
    PlanarDynamics,
    WheelLimits,
    observed,
)
from andabata.navigation.planar.dynamics_identification import (
    DynamicsIdentification,
    DynamicsIdentificationConfig,
)
from andabata.navigation.planar.hit_layer import HitLayer, HitLayerConfig, LaserPose
from andabata.navigation.planar.nearest_hits import empty_hits, find_nearest
from andabata.navigation.planar.sampling_mpc import SamplingMpc, SamplingMpcConfig
from andabata.navigation.planar.time_to_go import TimeToGo, TimeToGoConfig, limits_of


class MpcMoversConfig(BaseModel):
    """Settings of what the navigator knows of movers.

    Attributes:
        tracks: Settings of the tracks in its scans.
        are_known: True to take what truly moves, seen or not, in the place of tracks: an upper
            bound, in simulation alone.
        clear_margin: Distance from the edge of a mover within which hits are its own [m].
        forecast: Where movers are expected, and what it costs to be near them [s/s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    tracks: CircleTracksConfig = CircleTracksConfig(max_range=10.0)
    are_known: bool = False
    clear_margin: float = Field(default=0.1, ge=0)
    forecast: MoverForecastConfig = MoverForecastConfig()


class MpcNavigatorConfig(BaseModel):
    """Settings of the navigator.

    Attributes:
        hits: Settings of the hit layer.
        time_to_go: Settings of the field.
        mpc: Settings of the controller.
        identification: Settings of the identification.
        min_speed: Least speed, negative backwards [m/s].
        max_yaw_rate: Largest yaw rate [rad/s].
        replan_every: Number of periods between two fields.
        stuck_time: Time without displacement after which the robot is stuck [s].
        stuck_radius: Displacement that is one [m].
        recovery_risk: Share of its margin that a stuck robot gives up.
        standing_time: Time without half of such a displacement after which driving backwards costs
            nothing [s].
        recovery_distance: Distance from the place where the robot stood beyond which driving
            backwards costs again [m].
        movers: Settings of tracks and forecast; None takes what moves for what stands.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    hits: HitLayerConfig = HitLayerConfig(cell=0.05, cells=256)
    time_to_go: TimeToGoConfig = TimeToGoConfig()
    mpc: SamplingMpcConfig = SamplingMpcConfig()
    identification: DynamicsIdentificationConfig = DynamicsIdentificationConfig()
    min_speed: float = Field(default=-0.5, le=0)
    max_yaw_rate: float = Field(default=4.0, gt=0)
    replan_every: int = Field(default=2, ge=1)
    stuck_time: float = Field(default=2.5, gt=0)
    stuck_radius: float = Field(default=0.25, gt=0)
    recovery_risk: float = Field(default=1.0, ge=0, le=1)
    standing_time: float = Field(default=1.0, gt=0)
    recovery_distance: float = Field(default=0.4, ge=0)
    movers: MpcMoversConfig | None = None

    @model_validator(mode="after")
    def _check_times(self) -> Self:
        """Refuse a robot that is stuck before it stands."""
        if self.standing_time > self.stuck_time:
            raise ValueError(
                f"standing_time: expected at most stuck_time, {self.stuck_time} s, "
                f"got {self.standing_time} s"
            )
        return self


WITH_MOVERS = MpcNavigatorConfig(movers=MpcMoversConfig())
"""Settings of a navigator that follows what moves and prices where it will be."""

WITH_TRUE_MOVERS = MpcNavigatorConfig(movers=MpcMoversConfig(are_known=True))
"""Settings of one that is told what moves."""


class MpcNavigator:
    """Drives to a goal on flat ground by laser and odometry, without a map.

    Attributes:
        config: Settings.
        mpc: Controller.
        hits: Hit layer.
        time_to_go: Field of the time to the goal.
        identification: Identification of the dynamics, used unless they are known.
        dynamics: Dynamics that the last command was planned with.
    """

    def __init__(
        self,
        vehicle: PlanarVehicleConfig,
        rng: np.random.Generator,
        config: MpcNavigatorConfig | None = None,
        are_dynamics_known: bool = False,
    ) -> None:
        """Prepare for a robot.

        Args:
            vehicle: Outline, limits and period of the robot; its dynamics count if they are known.
            rng: Source of randomness; each drive takes the same draws.
            config: Settings.
            are_dynamics_known: True to take the dynamics of ``vehicle``, False to identify them.
        """
        self.config = config = config or MpcNavigatorConfig()
        hits, footprint, max_speed = config.hits, vehicle.footprint, vehicle.max_speed
        self._period, self._half_width = vehicle.period, inner_radius_of(footprint)
        self._max_speed = max_speed
        self._known = _dynamics_of(vehicle) if are_dynamics_known else None
        self.hits = HitLayer(hits)
        speeds = limits_of(self._half_width, max_speed, config.mpc.margin, config.time_to_go)
        self.time_to_go = TimeToGo(hits.cells, hits.cell, speeds, config.time_to_go)
        reach = reach_of(footprint) + config.mpc.margin.at(max_speed) + 2 * hits.cell
        self._nearest = empty_hits(hits.cells, hits.cell, reach)
        limits = WheelLimits(
            config.min_speed,
            max_speed,
            vehicle.max_wheel_speed,
            vehicle.half_track,
            config.max_yaw_rate,
        )
        self.mpc = SamplingMpc(config.mpc, limits, footprint, vehicle.period)
        self.identification = DynamicsIdentification(config.identification, vehicle.period)
        self._past = np.zeros((round(_MEMORY / vehicle.period), 2))
        self._speeds = np.zeros((len(self._past) + 1, 2))
        self._places = np.zeros((round(config.stuck_time / vehicle.period), 2))
        self._standing = round(config.standing_time / vehicle.period)
        self._seed = int(rng.integers(1 << 62))
        self.reset(PlanarLidarConfig(), (0.0, 0.0))

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Forget the last drive, and its dynamics.

        Args:
            lidar: Laser of the robot.
            goal: Goal in the frame of the odometry [m].
        """
        self.hits.reset()
        self.mpc.reset()
        self.identification.reset()
        self._bearings, self._max_range = lidar.bearings, lidar.max_range
        self._laser = LaserPose(lidar.x, lidar.y, math.radians(lidar.yaw_deg))
        movers = self.config.movers
        self._tracks = None if movers is None else CircleTracks(lidar, self._period, movers.tracks)
        self._forecast = NO_MOVERS
        self._goal = np.array(goal, dtype=np.float64)
        self._past[:], self._speeds[:], self._places[:] = 0.0, 0.0, np.inf
        self._stood = np.full(2, np.inf)
        self._periods = 0
        self._rng = np.random.default_rng(self._seed)
        self.dynamics = self._known or self.identification.estimate().mean

    def act(self, readings: PlanarReadings) -> Twist:
        """Return the command of this control period.

        Args:
            readings: Measurements at its begin.

        Raises:
            ValueError: If the pose or the speeds are not finite, or there is not one range for each
                beam of the laser.
        """
        pose, velocity = readings.odometry, readings.velocity
        self._check(readings)
        position = np.array([pose.x, pose.y])
        # What the last command has done.
        self._speeds[:-1] = self._speeds[1:].copy()
        self._speeds[-1] = velocity.linear, velocity.angular
        if self._known is None and self._periods:
            self.identification.update(Twist(*self._past[-1].tolist()), velocity)
            self.dynamics = self.identification.estimate().mean
        # What stands around, and how long the way takes from where.
        self._remember(readings)
        if self._periods % self.config.replan_every == 0:
            self.time_to_go.update(self._nearest, position, self._goal)
        # What to do next.
        state = observed(*pose, self._past, self._speeds, self.dynamics, self._period)
        command = self.mpc.command(
            state,
            self._past,
            self.dynamics,
            self._nearest,
            self.time_to_go.field,
            self._goal,
            self._rng,
            *self._stuck(position),
            self._forecast,
        )
        self._past[:-1] = self._past[1:].copy()
        self.took(command)
        self._periods += 1
        return command

    def took(self, command: Twist) -> None:
        """Take note that the robot was given another command in the last period.

        Args:
            command: Command within the robot's limits, of another navigator.
        """
        self._past[-1] = command.linear, command.angular

    def _check(self, readings: PlanarReadings) -> None:
        """Refuse readings that cannot be used."""
        numbers = (*readings.odometry, readings.velocity.linear, readings.velocity.angular)
        if not all(math.isfinite(number) for number in numbers):
            raise ValueError(f"readings: expected finite pose and speeds, got {numbers}")
        if readings.ranges.shape != self._bearings.shape:
            raise ValueError(
                f"ranges: expected one for each beam of the laser, {self._bearings.shape}, got "
                f"{readings.ranges.shape}; reset the navigator with the robot's laser"
            )

    def _remember(self, readings: PlanarReadings) -> None:
        """Take a scan into the hit layer, and find the nearest hits."""
        robot = LaserPose(*readings.odometry)
        position = np.array([robot.x, robot.y])
        self.hits.follow(position)
        self.hits.update(self._laser.on(robot), self._bearings, readings.ranges, self._max_range)
        self.hits.clear(position, self._half_width - _RIM)
        self._follow(robot, readings)
        find_nearest(self.hits, self._nearest)

    def _follow(self, robot: LaserPose, readings: PlanarReadings) -> None:
        """Follow what moves, and keep none of its hits as obstacles."""
        config = self.config.movers
        if config is None or self._tracks is None:
            return
        if config.are_known:
            tracks = _known_movers(readings)
        else:
            tracks = self._tracks.update(robot, np.asarray(readings.ranges, dtype=np.float64))
        for place, radius in zip(tracks.places, tracks.radii.tolist(), strict=True):
            self.hits.clear(place, radius + config.clear_margin)
        here = np.array([robot.x, robot.y])
        self._forecast = forecast_of(tracks, config.forecast, here, self._max_speed)

    def _stuck(self, position: NDArray[np.float64]) -> tuple[float, float]:
        """Return the shares of the margin and of the cost of ways backwards to give up.

        Both are 0 unless the robot is stuck.
        """
        config = self.config
        self._places[:-1] = self._places[1:].copy()
        self._places[-1] = position
        moved = np.hypot(*(self._places - position).T)
        # A robot that stands has to back out, which must not end after the first step.
        if moved[-self._standing :].max() < config.stuck_radius / 2:
            self._stood = position
        is_backing = math.dist(self._stood, position) < config.recovery_distance
        is_stuck = moved.max() < config.stuck_radius
        return (config.recovery_risk if is_stuck else 0.0), (1.0 if is_backing else 0.0)


def _known_movers(readings: PlanarReadings) -> TrackedMovers:
    """Return what truly moves, as tracks without doubt.

    Raises:
        ValueError: If the readings do not tell it.
    """
    if readings.movers is None:
        raise ValueError(
            "movers: expected those of a simulated robot, got none; leave are_known off elsewhere"
        )
    numbers = np.arange(len(readings.movers), dtype=np.float64)
    x, y, vx, vy, radii = readings.movers.T
    ages, doubts = np.full_like(numbers, np.inf), np.zeros_like(numbers)
    places, velocities = np.column_stack((x, y)), np.column_stack((vx, vy))
    return TrackedMovers(places, velocities, radii, ages, doubts, numbers)


def _dynamics_of(vehicle: PlanarVehicleConfig) -> PlanarDynamics:
    """Return the dynamics of a vehicle as the model has them."""
    return PlanarDynamics(
        vehicle.delay, vehicle.lag, vehicle.acceleration, vehicle.yaw_acceleration
    )


_MEMORY = 1.0
"""Time over which commands and speeds are kept to find what the robot's controller asks for [s]."""

_RIM = 0.02
"""Distance from the robot's edge, inwards, from which on the ground under it is free [m]."""
