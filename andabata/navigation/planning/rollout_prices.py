"""Prices of rollouts: what the cheapest way costs that begins with an arc or a turn.

Rollouts are cut short where they cannot win: what a way has cost, its length and the plan's cost of
the rest are a bound that needs no simulation. What moves costs by time: where it is expected when
the robot gets there.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.mover_forecast import mover_price
from andabata.navigation.planning.cost_to_go import is_settled, settle
from andabata.navigation.planning.rollout_inputs import (
    BodyCircles,
    Candidates,
    Place,
    PlannedGround,
    RolloutMotion,
    Stops,
)
from terrain.kernel import kernel

STEP = 0.2
"""Time between the points of an arc [s]."""

_CHECK_STEP = 0.1
"""Time between the points of a twist that is checked [s]."""

_MARGIN = 8.0
"""Cost above the robot's up to which the way on is looked up [m]."""

_NO_WAY = 1e3
"""Cost of a place without a way on [m]."""

_CONTACT = 1e4
"""Cost of a square metre of missing clearance [m]."""

_ROUNDING = 1e-3
"""Cost that bounds stay below what they bound, so that rounding cannot choose [m]."""


@kernel
def price_moves(
    moves: Candidates,
    motion: RolloutMotion,
    ground: PlannedGround,
    place: Place,
    body: BodyCircles,
    stops: Stops,
    prices: NDArray[np.float64],
) -> None:
    """Write the cost [m] of the cheapest way that begins with each arc, turn, arc backwards.

    It is infinite for moves that are not cheaper than the first arc by the margin, or than a move
    before them: they need not be simulated to the end.

    Args:
        moves: First moves.
        motion: Sampling of an arc.
        ground: Plan around the robot.
        place: Pose of the robot.
        body: BodyCircles of the robot.
        stops: Costs of stops; an infinite negative margin gives all prices.
        prices: Result: arcs, turns, arcs backwards, shape (a + t + r,).
    """
    enough = np.inf
    arcs, turns = len(moves.rates), len(moves.rates) + len(moves.turns)
    for k in range(len(prices)):
        if k < arcs:
            price = _price_arc(moves, motion, ground, place, body, k, enough)
        elif k < turns:
            turn = moves.turns[k - arcs]
            stop = stops.turn_cost if turn * stops.turning <= 0 else 0.0
            price = _price_turn(moves, motion, ground, place, body, turn, enough - stop) + stop
        else:
            rate, stop = moves.reverse_rates[k - turns], stops.reverse_cost
            price = _price_reverse(motion, ground, place, body, rate, enough - stop) + stop
        prices[k] = price if price < enough else np.inf
        if k == 0:
            enough = price - stops.override_margin
        elif price < enough and stops.override_margin > -np.inf:
            enough = price


@kernel
def is_clear(
    ground: PlannedGround, place: Place, body: BodyCircles, twist: tuple[float, float], time: float
) -> bool:
    """Return True if the body lacks no clearance while it drives a twist.

    Args:
        ground: Plan around the robot.
        place: Pose of the robot.
        body: Body of the robot.
        twist: Speed [m/s] and yaw rate [rad/s].
        time: Time for which it is driven [s].
    """
    speed, rate = twist
    if speed == 0.0:
        swept = _between(ground.clearance, place.x, place.y) * ground.cell
        return bool(swept >= body.swing_radius)
    x, y, yaw = place
    stride = speed * _CHECK_STEP / ground.cell
    for _ in range(int(np.ceil(time / _CHECK_STEP))):
        middle = yaw + rate * _CHECK_STEP / 2
        x, y = x + stride * np.cos(middle), y + stride * np.sin(middle)
        yaw += rate * _CHECK_STEP
        if _missing(ground.traversed_clearance, ground.cell, body, x, y, yaw) > 0.0:
            return False
    return True


class _Arc(NamedTuple):
    """End of an arc.

    Attributes:
        place: Pose there.
        cost: Cost of the way [m].
        is_goal: True if it ended at the goal.
    """

    place: Place
    cost: float
    is_goal: bool


@kernel
def _drive(
    motion: RolloutMotion,
    ground: PlannedGround,
    place: Place,
    body: BodyCircles,
    rate: float,
    stride: float,
) -> _Arc:
    """Return the end of an arc of some yaw rate, backwards where the stride is negative.

    Its cost is that of its time: the same for an arc that leads farther, and for standing still.
    """
    x, y, yaw = place
    cell = ground.cell
    driven = missing = 0.0
    is_goal = False
    for k in range(motion.points):
        middle = yaw + rate * motion.time / 2
        x, y = x + stride * np.cos(middle) / cell, y + stride * np.sin(middle) / cell
        yaw += rate * motion.time
        is_goal = np.hypot(x - ground.goal_x, y - ground.goal_y) < ground.goal_radius
        if is_goal:
            break
        driven += motion.stride * _rate_at(ground.costs, body.cost_share, x, y)
        missing += _missing(ground.traversed_clearance, cell, body, x, y, yaw)
        if len(ground.movers.radii):
            driven += _price_movers(ground, body, Place(x, y, yaw), (k + 1, motion.time))
    return _Arc(Place(x, y, yaw), driven + _CONTACT * missing, is_goal)


@kernel
def _price_arc(
    moves: Candidates,
    motion: RolloutMotion,
    ground: PlannedGround,
    place: Place,
    body: BodyCircles,
    which: int,
    enough: float,
) -> float:
    """Return the cost of the cheapest way that begins with an arc [m], infinite from enough on.

    Who stands still drives on after an arc's time, or stands for as long as rollouts look ahead.
    """
    stride = motion.stride * moves.scales[which]
    arc = _drive(motion, ground, place, body, moves.rates[which], stride)
    if arc.is_goal:
        return arc.cost
    at = _Begin(arc.place, arc.cost, motion.points)
    price = _cheapest_follower(moves.after_arc, motion, ground, at, body, enough)
    if stride == 0.0:
        points = motion.points + moves.after_arc.shape[1]
        longer = RolloutMotion(points, motion.stride, motion.time)
        arc = _drive(longer, ground, place, body, 0.0, 0.0)
        price = min(price, arc.cost + _rest_from(ground, arc.place, enough - arc.cost))
    return price


@kernel
def _price_turn(
    moves: Candidates,
    motion: RolloutMotion,
    ground: PlannedGround,
    place: Place,
    body: BodyCircles,
    turn: float,
    enough: float,
) -> float:
    """Return the cost of the cheapest way that begins with a turn on the spot, like an arc's."""
    # On the spot the corners sweep a circle, and no passage that was driven helps.
    swept = _between(ground.clearance, place.x, place.y) * ground.cell
    missing = motion.points * max(body.swing_radius - swept, 0.0) ** 2
    cost = body.turn_cost * abs(turn) + _CONTACT * missing
    turned = Place(place.x, place.y, place.yaw + turn)
    points = int(np.ceil(abs(turn) / (body.turn_rate * motion.time)))
    if len(ground.movers.radii):
        for k in range(points):
            u, v, time = place.x * ground.cell, place.y * ground.cell, (k + 1) * motion.time
            price = mover_price(u, v, (0.0, 0.0), body.swing_radius, time, ground.movers)
            cost += motion.time * price
    at = _Begin(turned, cost, points)
    return _cheapest_follower(moves.after_turn, motion, ground, at, body, enough)


@kernel
def _price_reverse(
    motion: RolloutMotion,
    ground: PlannedGround,
    place: Place,
    body: BodyCircles,
    rate: float,
    enough: float,
) -> float:
    """Return the cost of an arc backwards and the rest of the way, like an arc's."""
    arc = _drive(motion, ground, place, body, rate, -motion.stride)
    if arc.is_goal:
        return arc.cost
    return arc.cost + _rest_from(ground, arc.place, enough - arc.cost)


@kernel
def _rest_from(ground: PlannedGround, place: Place, enough: float) -> float:
    """Return the cost of the way on from a place [m]; above enough it is only a bound."""
    x, y, search, cell = place.x, place.y, ground.search, ground.cell
    end = _cell_of(x, y, len(ground.costs))
    settle(search, end, enough / cell, _MARGIN / cell)
    return _rest(search.cost_to_go[end], ground.goal_x - x, ground.goal_y - y, cell)


class _Begin(NamedTuple):
    """Begin of the arcs that follow a first move.

    Attributes:
        place: Pose at its end.
        price: Cost of it [m].
        points: Number of points that it took.
    """

    place: Place
    price: float
    points: int


@kernel
def _cheapest_follower(
    followers: NDArray[np.float64],
    motion: RolloutMotion,
    ground: PlannedGround,
    at: _Begin,
    body: BodyCircles,
    enough: float,
) -> float:
    """Return the cost [m] of a first move with the cheapest arcs that may follow it.

    Args:
        followers: Arcs, see ``Candidates``.
        motion: Sampling of an arc.
        ground: Plan around the robot.
        at: End of the first move.
        body: BodyCircles of the robot.
        enough: Cost [m] from which on it does not matter: then it is infinite.
    """
    place, price, begun = at
    cell, points = ground.cell, followers.shape[1]
    search, margin = ground.search, _MARGIN / cell
    cost_to_go = search.cost_to_go
    length = motion.stride * points
    # What a way costs at the least, but for the rest; less where it may end at the goal.
    least = price + length - _ROUNDING
    away = np.hypot(place.x - ground.goal_x, place.y - ground.goal_y)
    if (away - ground.goal_radius) * cell < length:
        least = -np.inf
    cheapest = enough
    c, s = np.cos(place.yaw), np.sin(place.yaw)
    begin = _nearest_end(followers, cost_to_go, cell, place)
    for order in range(len(followers)):
        if least >= cheapest:
            break
        # The likeliest first: it leaves little to the others.
        k = (begin + order) % len(followers)
        a, b = followers[k, points - 1, 0] / cell, followers[k, points - 1, 1] / cell
        x, y = place.x + c * a - s * b, place.y + s * a + c * b
        end, limit = _cell_of(x, y, len(cost_to_go)), (cheapest - least) / cell
        # The search goes on only where its answer could matter.
        if not is_settled(search, end, limit, margin):
            settle(search, end, limit, margin)
        rest = _rest(cost_to_go[end], ground.goal_x - x, ground.goal_y - y, cell)
        if least + rest >= cheapest:
            continue
        more, there = price, False
        for t in range(points):
            a, b = followers[k, t, 0] / cell, followers[k, t, 1] / cell
            x, y = place.x + c * a - s * b, place.y + s * a + c * b
            if np.hypot(x - ground.goal_x, y - ground.goal_y) < ground.goal_radius:
                there = True
                break
            more += motion.stride * _rate_at(ground.costs, body.cost_share, x, y)
            yaw = place.yaw + followers[k, t, 2]
            more += _CONTACT * _missing(ground.traversed_clearance, cell, body, x, y, yaw)
            if len(ground.movers.radii):
                more += _price_movers(ground, body, Place(x, y, yaw), (begun + t + 1, motion.time))
            # Costs only grow: what is dearer already needs no end.
            if more > cheapest:
                break
        cheapest = min(cheapest, more if there else more + rest)
    return cheapest if cheapest < enough else np.inf


@kernel
def _nearest_end(
    followers: NDArray[np.float64], cost_to_go: NDArray[np.float32], cell: float, place: Place
) -> int:
    """Return the arcs whose end costs least as far as the search has been."""
    last = followers.shape[1] - 1
    c, s = np.cos(place.yaw), np.sin(place.yaw)
    nearest, least = 0, np.inf
    for k in range(len(followers)):
        a, b = followers[k, last, 0] / cell, followers[k, last, 1] / cell
        end = _cell_of(place.x + c * a - s * b, place.y + s * a + c * b, len(cost_to_go))
        if cost_to_go[end] < least:
            nearest, least = k, cost_to_go[end]
    return nearest


@kernel
def _rate_at(costs: NDArray[np.float32], share: float, x: float, y: float) -> float:
    """Return the cost of a metre at a place, of whose extra costs a share counts."""
    return 1.0 + share * (_between(costs, x, y) - 1.0)


@kernel
def _missing(
    clearance: NDArray[np.float32], cell: float, body: BodyCircles, x: float, y: float, yaw: float
) -> float:
    """Return the square of the clearance that the driving body lacks at a pose [m2].

    Two circles, before and behind the middle, cover the body: the nearer one counts.
    """
    u, v = body.offset / cell * np.cos(yaw), body.offset / cell * np.sin(yaw)
    nearest = min(_between(clearance, x + u, y + v), _between(clearance, x - u, y - v))
    return max(body.radius - nearest * cell, 0.0) ** 2


@kernel
def _price_movers(
    ground: PlannedGround, body: BodyCircles, place: Place, point: tuple[int, float]
) -> float:
    """Return what movers add to the cost of a point of a rollout [m].

    Args:
        ground: Plan around the robot.
        body: BodyCircles of the robot.
        place: Pose there.
        point: Number of the point, from 1 on, and the time between two [s].
    """
    ahead = body.offset * np.cos(place.yaw), body.offset * np.sin(place.yaw)
    x, y, time = place.x * ground.cell, place.y * ground.cell, point[0] * point[1]
    return point[1] * mover_price(x, y, ahead, body.radius, time, ground.movers)


@kernel
def _rest(cost_to_go: float, aside: float, ahead: float, cell: float) -> float:
    """Return the cost of the way on from a place [m].

    Args:
        cost_to_go: Cost of it in the plan [cells].
        aside: Distance to the goal along x [cells].
        ahead: Distance to the goal along y [cells].
        cell: Edge of a cell [m].
    """
    rest = cost_to_go * cell
    return rest if rest < _NO_WAY else _NO_WAY + np.hypot(aside, ahead) * cell


@kernel
def _cell_of(x: float, y: float, n: int) -> tuple[int, int]:
    """Return the cell of a place, the nearest of the square for places beyond it."""
    return min(max(int(x), 0), n - 1), min(max(int(y), 0), n - 1)


@kernel
def _between(grid: NDArray[np.float32], x: float, y: float) -> float:
    """Return the value between the middles of the four nearest cells."""
    limit = len(grid) - 2.0
    x, y = min(max(x - 0.5, 0.0), limit), min(max(y - 0.5, 0.0), limit)
    i, j = int(x), int(y)
    a, b = x - i, y - j
    near = grid[i, j] * (1 - a) + grid[i + 1, j] * a
    return float(near * (1 - b) + (grid[i, j + 1] * (1 - a) + grid[i + 1, j + 1] * a) * b)
