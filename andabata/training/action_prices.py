"""Prices in seconds of all first actions, on the true map: a teacher of whoever sees the map.

Each action is priced as held for longer than a decision's period, so that actions differ by more
than a student can confuse, and whoever takes the cheapest does not turn to and fro. The best of
some arcs in a row follows, and the rest of the way costs what the time field says there. So one
state gives as many labels as there are actions, and what the map of the robot cannot show is
weighed by the mean over what it may hide.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.robot import RobotModel
from andabata.training.time_field import TimeField, TimeFieldConfig, time_field
from terrain.kernel import kernel
from worlds.traversability_map import TraversabilityMap

_STEP = 0.1
"""Time between the points of an arc [s]."""

_STANDING = 0.05
"""Speed below which the robot counts as standing [m/s]."""

_NO_WAY = 300.0
"""Time to the goal where no way leads on [s]."""


class ActionPricesConfig(BaseModel):
    """Settings of a teacher.

    Attributes:
        field: Settings of the times of the rest of the way.
        hold: Time for which a first action is priced as held [s].
        arc_time: Duration of each of the two arcs that may follow an action [s].
        arc_speed: Speed of these arcs [m/s].
        rates: Yaw rates of these arcs, as shares of the steering limit.
        contact: Price of a metre of missing clearance around the body, at each point [s].
        margin: Clearance around the body that is worth a detour [m]: a map of 0.2 m does not tell
            a pass from a contact.
        nearness: Price of a metre of that margin that is missing, at each point [s].
        haste: Price of a point at full speed without any clearance, in periods between points:
            falls to none at ``field.open_clearance``.
        turn: Time of a radian between the robot's heading and the way on [s].
        reversal: Price of a stop, to reverse, to turn on the spot or to turn back there [s].
        arrival: Distance from the goal at which a way ends [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    field: TimeFieldConfig = Field(default_factory=TimeFieldConfig)
    hold: float = Field(default=1.6, gt=0)
    arc_time: float = Field(default=1.2, gt=0)
    arc_speed: float = Field(default=0.45, gt=0)
    rates: tuple[float, ...] = (-1.0, -0.6, -0.3, 0.0, 0.3, 0.6, 1.0)
    contact: float = Field(default=100.0, ge=0)
    margin: float = Field(default=0.15, ge=0)
    nearness: float = Field(default=30.0, ge=0)
    haste: float = Field(default=3.0, ge=0)
    turn: float = Field(default=1.0, ge=0)
    reversal: float = Field(default=1.5, ge=0)
    arrival: float = Field(default=0.3, gt=0)


class _Motion(NamedTuple):
    """Numbers of the simulated motions.

    Attributes:
        points: Number of points of an action.
        arc_points: Number of points of an arc.
        arc_speed: Speed of an arc [m/s].
        radius: Radius of the two circles that cover the body [m].
        offset: Distance of their middles from the robot's [m].
        swing: Radius of the circle that the turning body sweeps [m].
        contact: Price of a metre of missing clearance at a point [s].
        margin: Clearance around the body that is kept [m].
        nearness: Price of a metre of it that is missing at a point [s].
        haste: Price of haste at a point [s].
        full_speed: Speed at which haste has its whole price [m/s].
        open_clearance: Clearance without haste [m].
        turn: Time of a radian [s].
        arrival: Distance at which a way ends [m].
    """

    points: int
    arc_points: int
    arc_speed: float
    radius: float
    offset: float
    swing: float
    contact: float
    margin: float
    nearness: float
    haste: float
    full_speed: float
    open_clearance: float
    turn: float
    arrival: float


class _Ground(NamedTuple):
    """True map and the times over it.

    Attributes:
        clearance: Clearance [m], zero on forbidden ground, float32, shape (n, m).
        cell: Edge of its cells [m].
        field: Times to the goal.
        goal: Goal in the map [m], shape (2,).
    """

    clearance: NDArray[np.float32]
    cell: float
    field: TimeField
    goal: NDArray[np.float64]


class ActionPrices:
    """Prices of actions in one world.

    Attributes:
        truth: True map.
    """

    def __init__(
        self,
        truth: TraversabilityMap,
        robot: RobotModel,
        actions: NDArray[np.float64],
        config: ActionPricesConfig | None = None,
    ) -> None:
        """Prepare for a world.

        Args:
            truth: True map.
            robot: Body and steering limit.
            actions: Speed [m/s] and yaw rate [rad/s] of each action, shape (k, 2).
            config: Settings.
        """
        self._config = config or ActionPricesConfig()
        self.truth = truth
        self._actions = np.array(actions, dtype=np.float64)
        settings = self._config
        self._rates = np.array(settings.rates) * robot.max_steering
        self._motion = _Motion(
            points=max(round(settings.hold / _STEP), 1),
            arc_points=round(settings.arc_time / _STEP),
            arc_speed=settings.arc_speed,
            radius=robot.half_radius,
            offset=robot.length / 4,
            swing=float(np.hypot(robot.length / 2, robot.width / 2)),
            contact=settings.contact * _STEP,
            margin=settings.margin,
            nearness=settings.nearness * _STEP,
            haste=settings.haste * _STEP,
            full_speed=float(np.abs(self._actions[:, 0]).max()),
            open_clearance=settings.field.open_clearance,
            turn=settings.turn,
            arrival=settings.arrival,
        )
        self._ground: _Ground | None = None

    def head_for(self, goal: NDArray[np.float64]) -> None:
        """Take a goal in the map [m], shape (2,); the same goal again costs nothing."""
        if self._ground is None or not np.array_equal(self._ground.goal, goal):
            there, truth = np.array(goal, dtype=np.float64), self.truth
            field = time_field(truth, there, self._config.field)
            self._ground = _Ground(truth.clearance, truth.cell, field, there)

    def prices(
        self, position: NDArray[np.float64], yaw: float, speed: float, rate: float
    ) -> NDArray[np.float64]:
        """Return the time to the goal with each first action [s], shape (k,).

        Args:
            position: True position in the map [m], shape (2,).
            yaw: True heading [rad].
            speed: Speed that is driven [m/s]: to reverse costs a stop.
            rate: Yaw rate that is driven [rad/s]: so does turning back on the spot.

        Raises:
            ValueError: Before a goal.
        """
        if self._ground is None:
            raise ValueError("head_for: expected it before the first price, got none")
        place = np.array([position[0], position[1], yaw])
        prices = np.empty(len(self._actions))
        _write_prices(place, self._actions, self._rates, self._ground, self._motion, prices)
        if abs(speed) > _STANDING:
            prices[self._actions[:, 0] * speed <= 0.0] += self._config.reversal
        else:
            turns = self._actions[:, 0] == 0.0
            prices[turns & (self._actions[:, 1] * rate < 0.0)] += self._config.reversal
        return prices


@kernel
def _write_prices(
    place: NDArray[np.float64],
    actions: NDArray[np.float64],
    rates: NDArray[np.float64],
    ground: _Ground,
    motion: _Motion,
    prices: NDArray[np.float64],
) -> None:
    """Write the time to the goal with each first action [s]."""
    for k in range(len(actions)):
        x, y, yaw, cost, there = _drive(
            *(place[0], place[1], place[2], actions[k, 0], actions[k, 1]),
            *(motion.points, ground, motion),
        )
        prices[k] = cost if there else cost + _cheapest(x, y, yaw, rates, ground, motion)


@kernel
def _cheapest(
    x: float,
    y: float,
    yaw: float,
    rates: NDArray[np.float64],
    ground: _Ground,
    motion: _Motion,
) -> float:
    """Return the time of the best two arcs from a pose and of the rest of the way [s].

    To stay and turn towards the way on is another choice.
    """
    best = _rest(x, y, yaw, ground.field, motion, 2.0 * motion.turn)
    for rate in rates:
        u, v, turned, first, there = _drive(
            x, y, yaw, motion.arc_speed, rate, motion.arc_points, ground, motion
        )
        if there:
            best = min(best, first)
            continue
        for then in rates:
            p, q, heading, second, there = _drive(
                u, v, turned, motion.arc_speed, then, motion.arc_points, ground, motion
            )
            cost = first + second
            if not there and cost < best:
                cost += _rest(p, q, heading, ground.field, motion, motion.turn)
            best = min(best, cost)
    return best


@kernel
def _drive(
    x: float,
    y: float,
    yaw: float,
    speed: float,
    rate: float,
    points: int,
    ground: _Ground,
    motion: _Motion,
) -> tuple[float, float, float, float, bool]:
    """Return the pose at the end of an arc, its time with the prices of risks [s], and if there."""
    cost = 0.0
    for _ in range(points):
        middle = yaw + rate * _STEP / 2.0
        x += speed * _STEP * np.cos(middle)
        y += speed * _STEP * np.sin(middle)
        yaw += rate * _STEP
        if np.hypot(x - ground.goal[0], y - ground.goal[1]) < motion.arrival:
            return x, y, yaw, cost, True
        cost += _STEP
        if speed == 0.0:
            clearance = _clearance(ground, x, y)
            missing = motion.swing - clearance
        else:
            u, v = motion.offset * np.cos(yaw), motion.offset * np.sin(yaw)
            clearance = min(_clearance(ground, x + u, y + v), _clearance(ground, x - u, y - v))
            missing = motion.radius - clearance
            near = max(1.0 - clearance / motion.open_clearance, 0.0)
            cost += motion.haste * near * (speed / motion.full_speed) ** 2
        cost += motion.nearness * min(max(missing + motion.margin, 0.0), motion.margin)
        cost += motion.contact * max(missing, 0.0)
    return x, y, yaw, cost, False


@kernel
def _rest(x: float, y: float, yaw: float, field: TimeField, motion: _Motion, turn: float) -> float:
    """Return the time of the way on from a pose [s].

    Times are those between the nodes around the place from which a way leads on: by the nearest one
    alone, actions that differ by less than a node would cost the same.
    """
    n, m = field.times.shape
    u = min(max((x - field.corner[0]) / field.edge - 0.5, 0.0), n - 2.0)
    v = min(max((y - field.corner[1]) / field.edge - 0.5, 0.0), m - 2.0)
    i, j = int(u), int(v)
    total = weight = 0.0
    for p in range(2):
        for q in range(2):
            time = field.times[i + p, j + q]
            share = (1.0 - abs(i + p - u)) * (1.0 - abs(j + q - v))
            if np.isfinite(time):
                total += share * time
                weight += share
    if weight < 1e-6:
        return _NO_WAY
    off = field.directions[min(int(u + 0.5), n - 1), min(int(v + 0.5), m - 1)] - yaw
    return total / weight + turn * abs(np.arctan2(np.sin(off), np.cos(off)))


@kernel
def _clearance(ground: _Ground, x: float, y: float) -> float:
    """Return the clearance of the cell of a place, the nearest of the map beyond it [m]."""
    n, m = ground.clearance.shape
    i = int(np.floor((x - ground.field.corner[0]) / ground.cell))
    j = int(np.floor((y - ground.field.corner[1]) / ground.cell))
    return float(ground.clearance[min(max(i, 0), n - 1), min(max(j, 0), m - 1)])
