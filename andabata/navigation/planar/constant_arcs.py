"""Constant arcs under a time-to-go: the command whose motion leaves the least time to the goal.

The robot remembers its hits; the grid planner gives the cost to go over them, which is a time where
a metre costs as much more as the robot drives slower near obstacles. Every period a grid of
commands is rolled out with the robot's delay, acceleration and lag, and the one is taken that ends
nearest to the goal in time without touching anything: a trajectory rollout (Gerkey and Konolige
2008) with a navigation function (Brock and Khatib 1999).
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
from andabata.navigation.planar.hit_layer import HitLayer, HitLayerConfig, LaserPose
from andabata.navigation.planar.time_to_go import TimeField, time_at
from andabata.navigation.planning.cost_map import CostConfig, CostWeights, Passage
from andabata.navigation.planning.geofence_bounds import EVERYWHERE
from andabata.navigation.planning.grid_planner import GridPlanner
from terrain.kernel import kernel

_UNREACHABLE = 1e3
"""Time-to-go where the search has not been [s]."""

_CONTACT = 1e4
"""Cost of an arc that touches something; the later it does the less."""


class ConstantArcsConfig(BaseModel):
    """Settings of ``ConstantArcsNavigator``.

    Attributes:
        hits: Settings of the hit layer.
        costs: Costs of a metre; 1 is the metre at the largest speed.
        replan_every: Number of periods between two searches.
        horizon: Time that arcs are rolled out for, by control periods [s].
        speeds: Number of speeds, 0 and the largest included.
        yaw_rates: Number of yaw rates, an odd one.
        max_speed: Largest speed [m/s].
        max_yaw_rate: Largest yaw rate [rad/s].
        reverse: Speed backwards that is tried, too [m/s]; 0 for none.
        margin: Least clearance of the body [m].
        margin_time: Clearance that each unit of speed adds [s].
        soft: Clearance below which closeness costs [m].
        closeness: Cost of a second without clearance [s].
        heading: Cost of a radian between the heading and the way at the end of an arc [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    hits: HitLayerConfig = HitLayerConfig(cells=128)
    costs: CostConfig = CostConfig(
        inscribed_radius=0.28,
        inflation_radius=0.7,
        inscribed_cost=40.0,
        inflation_cost=2.0,
        unknown_cost=0.0,
        uncertain_cost=0.0,
        lethal_cost=0.0,
    )
    replan_every: int = Field(default=4, ge=1)
    horizon: float = Field(default=1.2, gt=0)
    speeds: int = Field(default=8, ge=2)
    yaw_rates: int = Field(default=25, ge=3)
    max_speed: float = Field(default=2.0, gt=0)
    max_yaw_rate: float = Field(default=3.0, gt=0)
    reverse: float = Field(default=0.3, ge=0)
    margin: float = Field(default=0.04, ge=0)
    margin_time: float = Field(default=0.05, ge=0)
    soft: float = Field(default=0.30, gt=0)
    closeness: float = Field(default=2.0, ge=0)
    heading: float = Field(default=0.3, ge=0)


class _Rollout(NamedTuple):
    """Numbers that the compiled rollouts depend on.

    Attributes:
        steps: Number of steps.
        dt: Step [s].
        acceleration: Largest change of speed in a step [m/s].
        yaw_acceleration: Largest change of yaw rate in a step [rad/s].
        follow: Share of the difference that the lag takes in a step.
        margin: Least clearance [m].
        margin_time: Clearance for each unit of speed [s].
        soft: Clearance below which closeness costs [m].
        closeness: Cost of a second without clearance [s].
        heading: Cost of a radian [s].
    """

    steps: int
    dt: float
    acceleration: float
    yaw_acceleration: float
    follow: float
    margin: float
    margin_time: float
    soft: float
    closeness: float
    heading: float


class ConstantArcsNavigator:
    """Rolls out constant commands and takes the one that leaves the least time to the goal."""

    def __init__(
        self, vehicle: PlanarVehicleConfig, config: ConstantArcsConfig | None = None
    ) -> None:
        """Take the robot as far as it is known, and the settings."""
        self.config = config = config or ConstantArcsConfig()
        self._vehicle, self._discs = vehicle, body_discs(vehicle.footprint)
        self._width = max(y for _, y in vehicle.footprint)
        self._hits = HitLayer(config.hits)
        hits, width = config.hits, self._width
        self._plan = GridPlanner(
            hits.cells,
            hits.cell,
            CostWeights.of(config.costs, hits.lethal_log_odds, hits.max_log_odds),
            (0.3, 1.5),
            2.5 * config.max_speed * config.horizon,
            Passage(width, width, width),
        )
        dt = vehicle.period
        self._rollout = _Rollout(
            steps=round(config.horizon / dt),
            dt=dt,
            acceleration=vehicle.acceleration * dt,
            yaw_acceleration=vehicle.yaw_acceleration * dt,
            follow=-math.expm1(-dt / vehicle.lag) if vehicle.lag > 0 else 1.0,
            margin=config.margin,
            margin_time=config.margin_time,
            soft=config.soft,
            closeness=config.closeness,
            heading=config.heading,
        )
        self._commands = self._grid()
        self.reset(PlanarLidarConfig(), (0.0, 0.0))

    def reset(self, lidar: PlanarLidarConfig, goal: tuple[float, float]) -> None:
        """Forget the last drive; see ``PlanarNavigator``."""
        self._lidar, self._goal = lidar, np.array(goal)
        self._bearings = lidar.bearings
        self._mount = LaserPose(lidar.x, lidar.y, math.radians(lidar.yaw_deg))
        self._hits.reset()
        self._plan.reset()
        self._periods = 0
        waiting = math.ceil(self._vehicle.delay / self._vehicle.period - 1e-9)
        self._waiting = np.zeros((waiting, 2))

    def act(self, readings: PlanarReadings) -> Twist:
        """Return the command of this period."""
        config, pose = self.config, LaserPose(*readings.odometry)
        position = np.array(pose[:2])
        self._hits.follow(position)
        eye = self._mount.on(pose)
        self._hits.update(eye, self._bearings, readings.ranges, self._lidar.max_range)
        self._hits.clear(position, self._width - 0.02)
        obstacles = self._hits.obstacles
        if self._periods % config.replan_every == 0:
            layer = self._hits
            self._plan.plan(
                layer.log_odds, layer.centre, EVERYWHERE, position, self._goal, layer.places
            )
        self._periods += 1
        cell = config.hits.cell
        time_to_go = TimeField(
            self._plan.cost_to_go,
            self._plan.corner,
            cell,
            cell / config.max_speed,
            np.full(1, _UNREACHABLE),
        )
        reach = config.max_speed * config.horizon + 0.5
        field = clearance_field(obstacles, (pose.x, pose.y), reach, 0.05, 0.5)
        state = np.array([*pose, readings.velocity.linear, readings.velocity.angular])
        commands = self._commands
        costs = _costs(
            commands,
            self._waiting,
            state,
            self._discs,
            field,
            time_to_go,
            self._goal,
            self._rollout,
        )
        chosen = commands[int(costs.argmin())]
        if len(self._waiting):
            self._waiting = np.vstack([self._waiting[1:], chosen])
        return Twist(*chosen.tolist())

    def _grid(self) -> NDArray[np.float64]:
        """Return the commands that are tried: speed [m/s] and yaw rate [rad/s], shape (k, 2)."""
        config, vehicle = self.config, self._vehicle
        speeds = np.linspace(0.0, config.max_speed, config.speeds).tolist()
        speeds += [-config.reverse] if config.reverse > 0 else []
        commands = []
        for speed in speeds:
            room = (vehicle.max_wheel_speed - abs(speed)) / vehicle.half_track
            # The fastest turns slow the robot down: some of them stay at every speed.
            most = min(config.max_yaw_rate, max(room, 0.25 * config.max_yaw_rate))
            turns = np.linspace(-most, most, config.yaw_rates)
            commands += [(speed, turn) for turn in turns.tolist()]
        return np.array(commands)


@kernel
def _costs(
    commands: NDArray[np.float64],
    waiting: NDArray[np.float64],
    state: NDArray[np.float64],
    discs: NDArray[np.float64],
    field: ClearanceField,
    time_to_go: TimeField,
    goal: NDArray[np.float64],
    rollout: _Rollout,
) -> NDArray[np.float64]:
    """Return the cost of each command [s], shape (k,).

    Args:
        commands: Speeds [m/s] and yaw rates [rad/s], shape (k, 2).
        waiting: Commands that act before, the oldest first, one a period, shape (d, 2).
        state: x, y, yaw, speed and yaw rate now, shape (5,).
        discs: Discs of the body, shape (b, 3).
        field: Distances from remembered hits.
        time_to_go: Time from cells to the goal.
        goal: Goal [m], shape (2,).
        rollout: Numbers of the rollout.
    """
    costs = np.empty(len(commands))
    begin = np.empty(7)
    begin[:5] = state
    begin[5:] = state[3:]
    for k in range(len(waiting)):
        _step(begin, waiting[k], rollout)
    near = body_clearance(begin[0], begin[1], begin[2], discs, field)
    body = np.empty(7)
    for k in range(len(commands)):
        body[:] = begin
        cost = 0.0
        for step in range(rollout.steps):
            _step(body, commands[k], rollout)
            clear = body_clearance(body[0], body[1], body[2], discs, field)
            margin = rollout.margin + rollout.margin_time * abs(body[3])
            # Where it is nearer already, it may drive where it gets no nearer.
            if clear < min(margin, near - 1e-3):
                cost = _CONTACT * (2.0 - step / rollout.steps)
                break
            cost += rollout.closeness * rollout.dt * max(1.0 - clear / rollout.soft, 0.0)
            if np.hypot(goal[0] - body[0], goal[1] - body[1]) < 0.3:
                cost += step * rollout.dt - rollout.steps * rollout.dt
                break
        if cost < _CONTACT:
            cost += _time_left(body, time_to_go, rollout)
        costs[k] = cost
    return costs


@kernel
def _step(body: NDArray[np.float64], command: NDArray[np.float64], rollout: _Rollout) -> None:
    """Move a body for a step: x, y, yaw, speed, yaw rate and those asked for, in place."""
    most = rollout.acceleration
    body[5] += min(max(command[0] - body[5], -most), most)
    most = rollout.yaw_acceleration
    body[6] += min(max(command[1] - body[6], -most), most)
    body[3] += rollout.follow * (body[5] - body[3])
    body[4] += rollout.follow * (body[6] - body[4])
    half = 0.5 * body[4] * rollout.dt
    body[0] += body[3] * rollout.dt * np.cos(body[2] + half)
    body[1] += body[3] * rollout.dt * np.sin(body[2] + half)
    body[2] += 2.0 * half


@kernel
def _time_left(body: NDArray[np.float64], time_to_go: TimeField, rollout: _Rollout) -> float:
    """Return the time-to-go of a pose, and what the turn into the way costs [s]."""
    here = time_at(time_to_go, body[0], body[1])
    if here >= _UNREACHABLE:
        return here
    reach = 2.0 * time_to_go.cell
    x, y = body[0], body[1]
    dx = time_at(time_to_go, x - reach, y) - time_at(time_to_go, x + reach, y)
    dy = time_at(time_to_go, x, y - reach) - time_at(time_to_go, x, y + reach)
    if abs(dx) + abs(dy) < 1e-9 or abs(dx) + abs(dy) > 0.5 * _UNREACHABLE:
        return here
    off = np.arctan2(dy, dx) - body[2]
    off = abs(np.pi - (np.pi - off) % (2 * np.pi))
    return here + rollout.heading * off
