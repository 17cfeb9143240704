"""Rollouts: arcs driven ahead in the head, and the yaw rate that the cheapest of them begins with.

The robot turns only so sharply: of the ways that a map shows it can take those that begin with an
arc it can drive (the dynamic window's idea, Fox et al. 1997, at constant speed; three arcs in a row
are an assumption). Where none leads on it turns on the spot or backs out, as a skid-steer can and
the paper's never does; over ground that it knows it hastens.
"""

import math
from itertools import product

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.kinematics import apply_dead_zone
from andabata.machine.robot import RobotModel
from andabata.navigation.planning.grid_planner import GridPlanner
from andabata.navigation.planning.local_planner import LocalPlanner
from terrain.kernel import kernel

_PERIOD = 0.1
"""Time of a control step [s]."""

STEP = 0.2
"""Time between the points of an arc [s]."""

ARRIVED = 0.8
"""A rollout that comes nearer to the goal than this is at its end [m]."""

AROUND = 8.0
"""Rollouts look up the way on where it costs so much more than the best one at most [m]."""

_LINGERING = 2.5
"""Who moves about within this of a place stays there [m]."""

_RECENT = 90.0
"""What is longer ago than this does not count as staying [s]."""

_NO_WAY = 1e3
_CONTACT = 1e4
"""Costs of a place without a way on [m], and of a square metre of room that is missing."""


class TrajectoryRolloutsConfig(BaseModel):
    """Numbers of the rollouts.

    Attributes:
        arc_time: An arc is driven for this long [s].
        arcs: Arcs in a row; their number and time make the horizon.
        rates: Yaw rates of an arc, shares of the steering limit.
        room: Clearance that the oracle keeps where it can, to which the body is a circle [m].
        margin: Room that a robot with a map keeps around its body [m].
        patience: Time about one place after which the robot begins to keep less room; after twice
            as long it keeps ``squeeze`` less [s]. Nothing that it may do leads on, and the map's
            walls are whole squares: gaps between them are wider than they look.
        squeeze: See ``patience`` [m].
        shy: Extra cost of a metre for each metre of clearance short of one metre, to the oracle.
        crowd: Of what the plan says that a metre costs more than a metre, this share counts.
        hold: Control steps between two decisions: as many as actions are held for in training.
        turns: Turns on the spot to each side, up to half a one.
        pause: Each stop, to turn on the spot or to back out, costs this much more than the time
            that it takes [m].
        trust: A wish stands when its cheapest way costs so much more than the cheapest at most [m].
        haste: Share of the speed at which an arc is driven over ground that is known to be free,
            with room on both sides, or where the robot came through; 1 is the paper's one speed.
        close: With less room than that half of the haste is left, down to this distance from
            walls [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    arc_time: float = Field(default=2.2, gt=0)
    arcs: int = Field(default=3, ge=2, le=5)
    rates: tuple[float, ...] = (-1.0, -0.5, 0.0, 0.5, 1.0)
    room: float = Field(default=0.45, gt=0)
    margin: float = Field(default=0.06, ge=0)
    patience: float = Field(default=30.0, gt=0)
    squeeze: float = Field(default=0.2, ge=0)
    shy: float = Field(default=1.0, ge=0)
    crowd: float = Field(default=0.5, ge=0)
    hold: int = Field(default=5, ge=1)
    turns: int = Field(default=6, ge=1)
    pause: float = Field(default=3.0, ge=0)
    trust: float = Field(default=0.3, ge=0)
    haste: float = Field(default=2.0, ge=1, le=3)
    close: float = Field(default=0.9, gt=0)


class TrajectoryRollouts:
    """Rollouts over a local map."""

    def __init__(self, robot: RobotModel, config: TrajectoryRolloutsConfig) -> None:
        """Prepare for a body.

        Args:
            robot: Speed and steering limit.
            config: Numbers.
        """
        self.config = config
        self._robot = robot
        self._rates = np.array([0.0, *config.rates]) * robot.max_steering
        rest = config.model_copy(update={"arcs": config.arcs - 1})
        # What follows an arc, and what follows a turn on the spot: whoever looks less far ahead
        # would seem to have more room.
        after = {
            "arcs": config.arcs - 1,
            "arc_time": config.arc_time * config.arcs / (config.arcs - 1),
        }
        self._tails = np.ascontiguousarray(fan(robot, rest)[0])
        self._ways = np.ascontiguousarray(fan(robot, config.model_copy(update=after))[0])
        self._points = round(config.arc_time / STEP)
        turns = np.arange(1, config.turns + 1) * np.pi / config.turns
        self._turns = np.concatenate([turns, -turns])
        # Backing out is priced without what follows it: a turn, which has its own price from there.
        self._backs = np.array([-0.5, 0.0, 0.5]) * robot.max_steering
        self._prices = np.zeros(len(self._rates) + len(self._turns) + len(self._backs))
        # Two circles, before and behind the middle, cover the body; one the body that turns.
        ahead, room = robot.length / 4, robot.half_radius + config.margin
        swing = math.hypot(robot.length / 2, robot.width / 2) + config.margin
        per_radian = robot.speed / robot.max_steering
        self._half_turn = np.pi * per_radian
        limits = (room, ahead, swing, config.crowd, ARRIVED, per_radian)
        self._limits = tuple(float(limit) for limit in limits)
        self._places = np.empty((round(_RECENT / (config.hold * _PERIOD)), 2))
        self.reset()

    def reset(self) -> None:
        """Forget where it was, and that it was turning on the spot."""
        self._turning = 0.0
        self._places[:] = np.inf
        self._decisions = 0

    def choose(
        self, local_planner: LocalPlanner, here: NDArray[np.float64], yaw: float, wish: float
    ) -> tuple[float, float]:
        """Return a yaw rate [rad/s] and the share of the speed to drive it at, below 0 backwards.

        They are the wish, or the begin of a way that is cheaper by more than ``trust``: an arc, a
        turn on the spot, or backwards until one of these leads on.

        Args:
            local_planner: With a plan.
            here: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Its heading there [rad].
            wish: Where a controller would steer [rad/s].
        """
        config, limit, cell = self.config, self._robot.max_steering, local_planner.config.cell
        self._rates[0] = apply_dead_zone(min(max(wish, -limit), limit), self._robot.dead_zone)
        plan = local_planner.plan
        x, y = (here - plan.corner) / cell
        goal = (plan.end - plan.corner) / cell
        room, ahead, swing, *others = self._limits
        squeeze = config.squeeze * self._impatience(here)
        _price_ways(
            self._rates,
            self._turns,
            self._backs,
            self._tails,
            self._ways,
            (self._points, self._robot.speed * STEP, STEP, cell),
            (plan.costs, plan.gaps, plan.rooms, plan.onward),
            (x, y, yaw, goal[0], goal[1]),
            (room - squeeze, ahead, swing - squeeze, *others),
            self._prices,
        )
        # A turn is paid for when it begins, and turning back begins another. Whoever backs out
        # stops twice, and has yet to turn.
        arcs, turns = len(self._rates), len(self._rates) + len(self._turns)
        self._prices[arcs:turns] += config.pause * (self._turns * self._turning <= 0)
        self._prices[turns:] += 2.0 * config.pause + self._half_turn
        best = int(np.argmin(self._prices))
        self._turning = 0.0
        if self._prices[0] <= self._prices[best] + config.trust:
            best = 0
        if best < arcs:
            rate = float(self._rates[best])
            return wish if best == 0 else rate, self._pace(plan, (x, y, yaw), rate, cell)
        if best >= turns:
            return float(self._backs[best - turns]), -1.0
        self._turning = math.copysign(limit, self._turns[best - arcs])
        return self._turning, 0.0

    def _impatience(self, here: NDArray[np.float64]) -> float:
        """Return how long the robot has been about a place, 0 for what is usual to 1."""
        self._places[self._decisions % len(self._places)] = here
        self._decisions += 1
        stays = np.hypot(*(self._places - here).T) < _LINGERING
        time = float(stays.sum()) * self.config.hold * _PERIOD
        return min(max(time / self.config.patience - 1.0, 0.0), 1.0)

    def _pace(
        self, plan: GridPlanner, at: tuple[float, float, float], rate: float, cell: float
    ) -> float:
        """Return the largest share of the speed that an arc may be driven at."""
        haste, prices = self.config.haste, plan.prices
        for pace, room in ((haste, prices.shy), ((1.0 + haste) / 2, self.config.close)):
            stride = pace * self._robot.speed * STEP / cell
            crowding = (room / cell, prices.room / cell, prices.shy / cell, prices.crowd)
            arc = (*at, rate * STEP, stride, self._points)
            if _is_free(plan.costs, plan.gaps, crowding, arc):
                return pace
        return 1.0


def fan(
    robot: RobotModel, config: TrajectoryRolloutsConfig
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return all rollouts of the rates of ``config``, and the first rate of each.

    Returns:
        x, y [m] and heading [rad] in the robot's frame, shape (k, m, 3), and the rates [rad/s],
        shape (k,).
    """
    rates = np.array(list(product(config.rates, repeat=config.arcs))) * robot.max_steering
    turns = np.repeat(rates, round(config.arc_time / STEP), axis=1) * STEP
    yaw = np.cumsum(turns, axis=1) - turns / 2
    x = np.cumsum(np.cos(yaw), axis=1) * robot.speed * STEP
    y = np.cumsum(np.sin(yaw), axis=1) * robot.speed * STEP
    return np.stack([x, y, yaw + turns / 2], axis=2), rates[:, 0]


@kernel
def _price_ways(rates, turns, backs, tails, ways, stride, ground, at, limits, prices):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write what the cheapest way costs that begins with each arc, turn on the spot, arc back."""
    points, far, time, cell = stride
    costs, gaps, rooms, onward = ground
    x0, y0, yaw0, goal_x, goal_y = at
    room, ahead, swing, crowd, arrived, per_radian = limits
    ahead, arrived = ahead / cell, arrived / cell
    for k in range(len(prices)):
        if k == len(rates):
            tails = ways
        x, y, yaw = x0, y0, yaw0
        driven = missing = 0.0
        there = False
        back = k - len(rates) - len(turns)
        if k < len(rates) or back >= 0:
            rate, way = (rates[k], far) if back < 0 else (backs[back], -far)
            for _ in range(points):
                middle = yaw + rate * time / 2
                x, y = x + way * np.cos(middle) / cell, y + way * np.sin(middle) / cell
                yaw += rate * time
                there |= np.hypot(x - goal_x, y - goal_y) < arrived
                if there:
                    break
                gap = _gap(rooms, x, y, yaw, ahead) * cell
                driven += far * (1.0 + crowd * (_between(costs, x, y) - 1.0))
                missing += max(room - gap, 0.0) ** 2
        else:
            turn = turns[k - len(rates)]
            driven = per_radian * abs(turn)
            missing = points * max(swing - _between(gaps, x, y) * cell, 0.0) ** 2
            yaw += turn
        price = driven + _CONTACT * missing
        if there or back >= 0:
            prices[k] = price
            if not there:
                prices[k] += _rest(onward, x, y, goal_x, goal_y, cell)
            continue
        prices[k] = np.inf
        c, s = np.cos(yaw), np.sin(yaw)
        for tail in range(len(tails)):
            more, p, q = price, x, y
            there = False
            for t in range(tails.shape[1]):
                a, b = tails[tail, t, 0] / cell, tails[tail, t, 1] / cell
                p, q = x + c * a - s * b, y + s * a + c * b
                if np.hypot(p - goal_x, q - goal_y) < arrived:
                    there = True
                    break
                gap = _gap(rooms, p, q, yaw + tails[tail, t, 2], ahead) * cell
                more += far * (1.0 + crowd * (_between(costs, p, q) - 1.0))
                more += _CONTACT * max(room - gap, 0.0) ** 2
                if more > prices[k]:
                    break
            if not there:
                more += _rest(onward, p, q, goal_x, goal_y, cell)
            prices[k] = min(prices[k], more)


@kernel
def _rest(onward, x, y, goal_x, goal_y, cell):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return what the way on from a place costs [m]."""
    limit = len(onward) - 1
    rest = onward[min(max(int(x), 0), limit), min(max(int(y), 0), limit)] * cell
    if rest < _NO_WAY:
        return rest
    return _NO_WAY + np.hypot(x - goal_x, y - goal_y) * cell


@kernel
def _is_free(costs, gaps, crowding, arc):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Tell whether all along an arc nothing makes a metre dearer but walls at some distance."""
    least, room, shy, crowd = crowding
    x, y, yaw, turn, stride, points = arc
    limit = len(costs) - 1
    for _ in range(points):
        x, y = x + stride * np.cos(yaw + turn / 2), y + stride * np.sin(yaw + turn / 2)
        yaw += turn
        i, j = min(max(int(x), 0), limit), min(max(int(y), 0), limit)
        if costs[i, j] <= 1.0:
            continue
        for_walls = crowd * min(max((shy - gaps[i, j]) / (shy - room), 0.0), 1.0)
        if gaps[i, j] < least or costs[i, j] > 1.0 + for_walls + 1e-3:
            return False
    return True


@kernel
def _gap(gaps, x, y, yaw, ahead):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the gap of the nearer of two circles before and behind the middle, in cells."""
    u, v = ahead * np.cos(yaw), ahead * np.sin(yaw)
    return min(_between(gaps, x + u, y + v), _between(gaps, x - u, y - v))


@kernel
def _between(grid, x, y):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the value between the four nearest cells' middles."""
    limit = len(grid) - 2.0
    x, y = min(max(x - 0.5, 0.0), limit), min(max(y - 0.5, 0.0), limit)
    i, j = int(x), int(y)
    a, b = x - i, y - j
    near = grid[i, j] * (1 - a) + grid[i + 1, j] * a
    return near * (1 - b) + (grid[i, j + 1] * (1 - a) + grid[i + 1, j + 1] * a) * b
