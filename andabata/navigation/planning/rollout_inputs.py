"""What the prices of rollouts depend on: moves, ground, movers, and the robot itself."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.mover_forecast import MoverForecast
from andabata.navigation.planning.cost_to_go import Search


class Candidates(NamedTuple):
    """First moves among which the cheapest is selected.

    Attributes:
        rates: Yaw rates of arcs [rad/s], the controller's command first, shape (a,).
        scales: Speeds of these arcs as shares of the usual one, 0 to stand still, shape (a,).
        turns: Angles of turns on the spot [rad], shape (t,).
        reverse_rates: Yaw rates of arcs backwards [rad/s], shape (r,).
        after_arc: Arcs that may follow an arc, in its end's frame: x, y [m], heading [rad], shape
            (k, m, 3).
        after_turn: Arcs that may follow a turn: longer, so that both look equally far ahead.
    """

    rates: NDArray[np.float64]
    scales: NDArray[np.float64]
    turns: NDArray[np.float64]
    reverse_rates: NDArray[np.float64]
    after_arc: NDArray[np.float64]
    after_turn: NDArray[np.float64]


class RolloutMotion(NamedTuple):
    """Sampling of an arc.

    Attributes:
        points: Number of points.
        stride: Distance between two [m].
        time: Time between two [s].
    """

    points: int
    stride: float
    time: float


class PlannedGround(NamedTuple):
    """What the plan knows around the robot; see ``GridPlanner``.

    Attributes:
        costs: Cost of a cell's length, float32, shape (n, n).
        clearance: Clearance [cells], float32, shape (n, n).
        traversed_clearance: Clearance, more where the robot came through [cells], shape (n, n).
        search: Search of the cost of the rest of the way [cells].
        cell: Edge of a cell [m].
        goal_x: Goal in the square [cells].
        goal_y: Goal in the square [cells].
        goal_radius: Distance from the goal at which a rollout ends [cells].
        movers: Movers that can reach the robot, their places from the square's corner.
    """

    costs: NDArray[np.float32]
    clearance: NDArray[np.float32]
    traversed_clearance: NDArray[np.float32]
    search: Search
    cell: float
    goal_x: float
    goal_y: float
    goal_radius: float
    movers: MoverForecast


class BodyCircles(NamedTuple):
    """Body of the robot as circles, and what its moves cost.

    Attributes:
        radius: Radius of the two circles that cover the body that drives, with margin [m].
        offset: Distance of their middles before and behind the robot's [m].
        swing_radius: Radius of the circle that the turning body sweeps, with margin [m].
        cost_share: Share of the plan's extra costs that counts.
        turn_cost: Cost of turning on the spot [m/rad].
        turn_rate: Yaw rate of turns on the spot [rad/s].
    """

    radius: float
    offset: float
    swing_radius: float
    cost_share: float
    turn_cost: float
    turn_rate: float


class Place(NamedTuple):
    """A pose in the square of the plan.

    Attributes:
        x: Position [cells].
        y: Position [cells].
        yaw: Heading [rad].
    """

    x: float
    y: float
    yaw: float


class Stops(NamedTuple):
    """Costs of moves that begin with a stop.

    Attributes:
        turning: Yaw rate of the turn on the spot that the robot is in, 0 for none [rad/s].
        turn_cost: Cost of beginning a turn [m]; turning back begins another.
        reverse_cost: Cost of backing out [m].
        override_margin: Cost by which a move has to be cheaper than the first arc to matter [m].
    """

    turning: float
    turn_cost: float
    reverse_cost: float
    override_margin: float
