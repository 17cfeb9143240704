"""Plans that rollouts are tested on, and what is selected over them."""

from types import SimpleNamespace

import numpy as np

from andabata.machine.kinematics import Twist, executed_twist
from andabata.machine.robot import RobotModel
from andabata.navigation.planning.cost_map import CostConfig, CostWeights
from andabata.navigation.planning.cost_to_go import search_for
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.planning.trajectory_rollouts import (
    TrajectoryRollouts,
    TrajectoryRolloutsConfig,
)
from tests.support.situations import GRID, ORIGIN, odds_of

ROBOT = RobotModel()
SPEED, LIMIT = ROBOT.speed, ROBOT.max_steering
AHEAD = np.array([8.0, 0.0])
CONFIG = TrajectoryRolloutsConfig()
CELL = 0.2


def planner_of(ranges, goal=AHEAD):
    """Return a planner that has seen sectors free so far [m], with a plan to a goal."""
    planner = LocalPlanner(GRID, rollouts=CONFIG)
    for _ in range(20):
        planner.occupancy.update(odds_of(ranges), ORIGIN, 0.0)
    planner.subgoal(ORIGIN, goal)
    return planner


def driven_up_to(ranges):
    """Return a planner of a robot that came from behind and saw sectors free so far [m]."""
    planner = LocalPlanner(GRID, rollouts=CONFIG)
    for x in np.arange(-4.0, 0.05, 0.1):
        planner.occupancy.update(odds_of(ranges), np.array([x, 0.0]), 0.0)
    planner.subgoal(ORIGIN, AHEAD)
    return planner


def rollouts_of(**settings):
    """Return rollouts with some settings of their own."""
    return TrajectoryRollouts(ROBOT, TrajectoryRolloutsConfig(**settings))


def selected(planner, rate, yaw=0.0, **settings):
    """Return the twist for a command of a yaw rate."""
    return rollouts_of(**settings).select(planner.plan, CELL, ORIGIN, yaw, rate)


def synthetic(goal=AHEAD, clearance=3.0, cost=1.0, rest=None):
    """Return a plan on even ground: each field may be a number or a function of x and y [m].

    The rest of the way is the straight line to the goal, unless it is given.
    """
    n, corner = 256, np.array([-25.6, -25.6])
    x, y = (np.mgrid[:n, :n] + 0.5) * CELL + corner[:, None, None]

    def field(values, scale=1.0):
        found = values(x, y) if callable(values) else values
        return np.ascontiguousarray(np.broadcast_to(found, (n, n)) / scale, dtype=np.float32)

    straight = rest if rest is not None else lambda x, y: np.hypot(x - goal[0], y - goal[1])
    costs, cost_to_go = field(cost), field(straight, CELL)
    # Its queue is empty: the search has been everywhere.
    search = search_for(costs, cost_to_go, 1.0, 1.0)
    return SimpleNamespace(
        costs=costs,
        clearance=field(clearance, CELL),
        traversed_clearance=field(clearance, CELL),
        cost_to_go=cost_to_go,
        search=search,
        goal=np.asarray(goal, dtype=float),
        corner=corner,
        weights=CostWeights.of(CostConfig(), 1.0, 3.0),
    )


def nowhere(**options):
    """Return a plan whose goal is far away and whose rest of the way costs nothing."""
    return synthetic(goal=(200.0, 0.0), rest=0.0, **options)


def chosen(plan, rate, position=ORIGIN, yaw=0.0, rollouts=None, **settings):
    """Return the twist for a command over a synthetic plan."""
    rollouts = rollouts or rollouts_of(**settings)
    return rollouts.select(plan, CELL, np.asarray(position, dtype=float), yaw, rate)


def checked(plan, command, position=ORIGIN, yaw=0.0, stalled_time=0.0, rollouts=None, **settings):
    """Return what becomes of a command with a speed of its own over a synthetic plan."""
    rollouts = rollouts or rollouts_of(**settings)
    place = np.asarray(position, dtype=float)
    return rollouts.check(plan, CELL, place, yaw, command, stalled_time)


def all_prices(plan, rollouts, rate=0.0, position=ORIGIN, yaw=0.0):
    """Return the costs of all moves [m], shape (arcs + turns + arcs backwards,), and select one."""
    rollouts._candidates.rates[0] = executed_twist(Twist(SPEED, rate), ROBOT).angular
    at = rollouts._situation(plan, CELL, np.asarray(position, dtype=float), yaw, None)
    found = rollouts._price(at, -np.inf, rollouts._candidates).copy()
    chosen(plan, rate, position, yaw, rollouts)
    return found


def prices(plan, rollouts=None, rate=0.0, **settings):
    """Return the costs of arcs, turns and arcs backwards over a synthetic plan [m]."""
    return np.split(all_prices(plan, rollouts or rollouts_of(**settings), rate), [6, 18])
