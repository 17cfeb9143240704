"""Rollouts: arcs driven ahead in the head, and the yaw rate that the cheapest of them begins with.

The robot moves forward only, and turns only so sharply: of the ways that a map shows it can take
those that begin with an arc it can drive (the dynamic window's idea, Fox et al. 1997, at constant
speed; three arcs in a row are an assumption).
"""

from itertools import product

import numpy as np
from numba import njit
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.machine.robot import RobotModel
from andabata.navigation.local_map import LocalMap
from rl.observation import apply_dead_zone

STEP = 0.2
"""Time between the points of an arc [s]."""

ARRIVED = 0.8
"""A rollout that comes nearer to the goal than this is at its end [m]."""

_NO_WAY = 1e3
_CONTACT = 1e4
"""Costs of a place without a way on [m], and of a square metre of room that is missing."""


class RolloutConfig(BaseModel):
    """Numbers of the rollouts.

    Attributes:
        leg_time: An arc is driven for this long [s].
        legs: Arcs in a row; their number and time make the horizon.
        rates: Yaw rates of an arc, shares of the steering limit.
        room: Clearance that the body's centre keeps where it can [m], where only it is looked at.
        margin: Room around the body itself [m], where the whole body is looked at.
        shy: Extra cost of a metre for each metre of clearance short of one metre.
        hold: Control steps between two decisions.
        trust: A wish stands when its cheapest way costs so much more than the cheapest at most [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    leg_time: float = Field(default=2.2, gt=0)
    legs: int = Field(default=3, ge=2, le=5)
    rates: tuple[float, ...] = (-1.0, -0.5, 0.0, 0.5, 1.0)
    room: float = Field(default=0.45, gt=0)
    margin: float = Field(default=0.06, ge=0)
    shy: float = Field(default=1.0, ge=0)
    hold: int = Field(default=3, ge=1)
    trust: float = Field(default=0.3, ge=0)


class Rollouts:
    """Rollouts over a local map."""

    def __init__(self, robot: RobotModel, config: RolloutConfig) -> None:
        """Prepare for a body.

        Args:
            robot: Speed and steering limit.
            config: Numbers.
        """
        self.config = config
        self._robot = robot
        self._rates = np.array([0.0, *config.rates]) * robot.max_steering
        rest = config.model_copy(update={"legs": config.legs - 1})
        self._tails = np.ascontiguousarray(fan(robot, rest)[0])
        self._points = round(config.leg_time / STEP)
        self._prices = np.zeros(len(self._rates))
        # Two circles, before and behind the middle, cover the body.
        self._ahead = robot.length / 4
        self._room = float(np.hypot(self._ahead, robot.width / 2)) + config.margin

    def choose(
        self, local_map: LocalMap, here: NDArray[np.float64], yaw: float, wish: float
    ) -> float:
        """Return the wish, or the yaw rate of a way that is cheaper by more than ``trust`` [rad/s].

        Args:
            local_map: With a plan.
            here: Position of the robot in ``odom`` [m], shape (2,).
            yaw: Its heading there [rad].
            wish: Where a controller would steer [rad/s].
        """
        config, limit, cell = self.config, self._robot.max_steering, local_map.config.cell
        self._rates[0] = apply_dead_zone(min(max(wish, -limit), limit), self._robot.dead_zone)
        x, y = (here - local_map.corner) / cell
        goal = (local_map.end - local_map.corner) / cell
        _price_arcs(
            self._rates,
            self._tails,
            (self._points, self._robot.speed * STEP, STEP, cell),
            local_map.gaps,
            local_map.onward,
            (x, y, yaw, goal[0], goal[1]),
            (self._room, self._ahead, config.shy, ARRIVED),
            self._prices,
        )
        best = int(np.argmin(self._prices))
        if self._prices[0] <= self._prices[best] + config.trust:
            return wish
        return float(self._rates[best])


def fan(
    robot: RobotModel, config: RolloutConfig
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return all rollouts of the rates of ``config``, and the first rate of each.

    Returns:
        x, y [m] and heading [rad] in the robot's frame, shape (k, m, 3), and the rates [rad/s],
        shape (k,).
    """
    rates = np.array(list(product(config.rates, repeat=config.legs))) * robot.max_steering
    turns = np.repeat(rates, round(config.leg_time / STEP), axis=1) * STEP
    yaw = np.cumsum(turns, axis=1) - turns / 2
    x = np.cumsum(np.cos(yaw), axis=1) * robot.speed * STEP
    y = np.cumsum(np.sin(yaw), axis=1) * robot.speed * STEP
    return np.stack([x, y, yaw + turns / 2], axis=2), rates[:, 0]


@njit(cache=True, nogil=True, error_model="numpy")
def _price_arcs(rates, tails, stride, gaps, onward, at, limits, prices):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write what the cheapest way costs that begins with each rate: driven, onward and too near."""
    points, far, time, cell = stride
    x0, y0, yaw0, goal_x, goal_y = at
    room, ahead, shy, arrived = limits
    head = np.empty((points, 3))
    for k in range(len(rates)):
        x, y, yaw = x0, y0, yaw0
        for t in range(points):
            middle = yaw + rates[k] * time / 2
            x, y = x + far * np.cos(middle) / cell, y + far * np.sin(middle) / cell
            yaw += rates[k] * time
            head[t, 0], head[t, 1], head[t, 2] = x, y, yaw
        c, s = np.cos(yaw), np.sin(yaw)
        prices[k] = np.inf
        for tail in range(len(tails)):
            driven = crowded = missing = 0.0
            p, q = x, y
            there = False
            number = 0
            for t in range(points + tails.shape[1]):
                if t < points:
                    p, q, turn = head[t, 0], head[t, 1], head[t, 2]
                else:
                    a, b = tails[tail, t - points, 0] / cell, tails[tail, t - points, 1] / cell
                    p, q, turn = (
                        x + c * a - s * b,
                        y + s * a + c * b,
                        yaw + tails[tail, t - points, 2],
                    )
                if np.hypot(p - goal_x, q - goal_y) * cell < arrived:
                    there = True
                    break
                driven += far
                number += 1
                u, v = ahead / cell * np.cos(turn), ahead / cell * np.sin(turn)
                gap = min(_between(gaps, p + u, q + v), _between(gaps, p - u, q - v)) * cell
                short = max(room - gap, 0.0)
                missing += short * short
                crowded += max(1.0 - gap, 0.0)
            price = driven + _CONTACT * missing
            if number:
                price += shy * crowded / number
            if not there:
                limit = len(onward) - 1
                i, j = min(max(int(p), 0), limit), min(max(int(q), 0), limit)
                rest = onward[i, j] * cell
                if not rest < _NO_WAY:
                    rest = _NO_WAY + np.hypot(p - goal_x, q - goal_y) * cell
                price += rest
            prices[k] = min(prices[k], price)


@njit(cache=True, nogil=True, error_model="numpy")
def _between(grid, x, y):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the value between the four nearest cells' middles."""
    limit = len(grid) - 2.0
    x, y = min(max(x - 0.5, 0.0), limit), min(max(y - 0.5, 0.0), limit)
    i, j = int(x), int(y)
    a, b = x - i, y - j
    near = grid[i, j] * (1 - a) + grid[i + 1, j] * a
    return near * (1 - b) + (grid[i, j + 1] * (1 - a) + grid[i + 1, j + 1] * a) * b
