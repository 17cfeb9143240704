"""Prices of rollouts: known answers, and those of a plain simulation."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from andabata.machine.kinematics import Twist
from andabata.navigation.arrival import ARRIVAL_DISTANCE
from andabata.navigation.planning.geofence_bounds import EVERYWHERE
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.planning.trajectory_rollouts import TrajectoryRollouts
from tests.support.rollout_plans import (
    CELL,
    CONFIG,
    LIMIT,
    ROBOT,
    SPEED,
    all_prices,
    chosen,
    nowhere,
    planner_of,
    prices,
    rollouts_of,
    selected,
    synthetic,
)
from tests.support.situations import GRID, ORIGIN

ARC = 33 * 0.06
"""Length of three arcs in a row [m]: 33 steps of 0.2 s at 0.3 m/s."""

AFTER_TURN = 32 * 0.06
"""Length of the two longer arcs after a turn [m]."""

TURNS = np.arange(1, 7) * np.pi / 6


def test_free_ground_costs_the_way_and_stops_cost_extra():
    """Arcs cost their length, turns their time and a stop, backing out two stops and a turn."""
    arcs, turns, back = prices(nowhere())
    np.testing.assert_allclose(arcs, ARC)
    np.testing.assert_allclose(turns, np.tile(0.6 * TURNS + 3.0 + AFTER_TURN, 2))
    np.testing.assert_allclose(back, 11 * 0.06 + 6.0 + 0.6 * np.pi)
    _, turns, back = prices(nowhere(), stop_cost=0.5)
    np.testing.assert_allclose(turns, np.tile(0.6 * TURNS + 0.5 + AFTER_TURN, 2))
    np.testing.assert_allclose(back, 11 * 0.06 + 1.0 + 0.6 * np.pi)


def test_the_plans_extra_costs_count_by_their_share():
    """Ground of three times the cost counts twice with a share of one half."""
    arcs, turns, back = prices(nowhere(cost=3.0))
    np.testing.assert_allclose(arcs, 2.0 * ARC)
    np.testing.assert_allclose(turns, np.tile(0.6 * TURNS + 3.0 + 2.0 * AFTER_TURN, 2))
    np.testing.assert_allclose(back, 2.0 * 11 * 0.06 + 6.0 + 0.6 * np.pi)
    arcs, *_ = prices(nowhere(cost=3.0), cost_share=1.0)
    np.testing.assert_allclose(arcs, 3.0 * ARC)


def test_missing_clearance_costs_its_square_in_every_part_of_a_rollout():
    """Each point of each arc counts, forward and backward; a turn sweeps a larger circle."""
    arcs, turns, back = prices(nowhere(clearance=0.2))
    lack = 1e4 * (ROBOT.half_radius + 0.06 - 0.2) ** 2
    swept = 1e4 * (np.hypot(0.67, 0.54) / 2 + 0.06 - 0.2) ** 2
    np.testing.assert_allclose(arcs, ARC + 33 * lack, rtol=1e-5)
    expected = 0.6 * TURNS + 3.0 + AFTER_TURN + 11 * swept + 32 * lack
    np.testing.assert_allclose(turns, np.tile(expected, 2), rtol=1e-5)
    np.testing.assert_allclose(back, 0.66 + 6.0 + 0.6 * np.pi + 11 * lack, rtol=1e-5)
    arcs, *_ = prices(nowhere(clearance=0.2), margin=0.0)
    lack = 1e4 * (ROBOT.half_radius - 0.2) ** 2
    np.testing.assert_allclose(arcs, ARC + 33 * lack, rtol=1e-5)


def test_a_passage_that_was_driven_helps_arcs_and_not_turns():
    """Arcs need traversed clearance, a turn on the spot the plain one."""
    plan = nowhere(clearance=0.2)
    plan.traversed_clearance = np.full_like(plan.clearance, 0.5 / CELL)
    arcs, turns, back = prices(plan)
    swept = 1e4 * (np.hypot(0.67, 0.54) / 2 + 0.06 - 0.2) ** 2
    np.testing.assert_allclose(arcs, ARC, rtol=1e-5)
    np.testing.assert_allclose(back, 0.66 + 6.0 + 0.6 * np.pi, rtol=1e-5)
    expected = 0.6 * TURNS + 3.0 + AFTER_TURN + 11 * swept
    np.testing.assert_allclose(turns, np.tile(expected, 2), rtol=1e-5)


def simulated(plan, moves, start):
    """Return the least cost of sequences of (steps, speed, rate), by a plain simulation [m].

    Args:
        plan: Synthetic plan.
        moves: Sequences that begin alike.
        start: Position [m] and heading.
    """

    def at(grid, points):
        places = (points - plan.corner) / CELL - 0.5
        return map_coordinates(grid.astype(float), places.T, order=1)

    costs = []
    for sequence in moves:
        steps = np.array([row for count, *row in sequence for _ in range(count)])
        speeds, turns = steps[:, 0] * 0.2, steps[:, 1] * 0.2
        yaws = start[2] + np.cumsum(turns)
        middles = yaws - turns / 2
        chords = speeds[:, None] * np.stack([np.cos(middles), np.sin(middles)], axis=1)
        points = np.array(start[:2]) + np.cumsum(chords, axis=0)
        to_goal = np.hypot(*(points - plan.goal).T)
        arrived = np.flatnonzero(to_goal < ARRIVAL_DISTANCE)
        last = arrived[0] if len(arrived) else len(points)
        points, yaws = points[:last], yaws[:last]
        ahead = ROBOT.length / 4 * np.stack([np.cos(yaws), np.sin(yaws)], axis=1)
        clearance = CELL * np.minimum(
            at(plan.traversed_clearance, points + ahead),
            at(plan.traversed_clearance, points - ahead),
        )
        lack = np.maximum(ROBOT.half_radius + CONFIG.margin - clearance, 0.0)
        rates = 1.0 + CONFIG.cost_share * (at(plan.costs, points) - 1.0)
        cost = 0.2 * SPEED * rates.sum() + 1e4 * (lack**2).sum()
        if not len(arrived):
            i, j = ((points[-1] - plan.corner) / CELL).astype(int)
            cost += plan.cost_to_go[i, j] * CELL
        costs.append(cost)
    return min(costs)


@pytest.mark.parametrize("seed", range(6))
def test_prices_are_those_of_a_plain_simulation(seed):
    """On uneven ground each first move costs as much as the cheapest way that begins with it."""
    rng = np.random.default_rng(seed)
    phase, goal = rng.uniform(0, 6.0, 4), rng.uniform(-2.5, 2.5, 2)

    def wave(x, y):
        return np.sin(2.0 * x + phase[0]) + np.cos(2.5 * y + phase[1])

    plan = synthetic(
        goal,
        clearance=lambda x, y: 0.45 + 0.08 * wave(x, y),
        cost=lambda x, y: 2.0 + 0.5 * wave(y, x),
    )
    plan.clearance = np.full_like(plan.clearance, 3.0 / CELL)
    start = (*rng.uniform(-1.0, 1.0, 2), rng.uniform(-3.0, 3.0))
    rollouts = rollouts_of()
    found = all_prices(plan, rollouts, 0.4, start[:2], start[2])
    arcs, turns, back = np.split(found, [6, 18])
    rates = [LIMIT * share for share in CONFIG.rates]
    pairs = [(a, b) for a in rates for b in rates]
    for rate, price in zip([0.4, *rates], arcs, strict=True):
        ways = [[(11, SPEED, rate), (11, SPEED, a), (11, SPEED, b)] for a, b in pairs]
        assert price == pytest.approx(simulated(plan, ways, start), rel=1e-4)
    for turn, price in zip([*TURNS, *-TURNS], turns, strict=True):
        ways = [[(16, SPEED, a), (16, SPEED, b)] for a, b in pairs]
        cost = simulated(plan, ways, (*start[:2], start[2] + turn))
        assert price == pytest.approx(cost + 0.6 * abs(turn) + 3.0, rel=1e-4)
    for rate, price in zip([-LIMIT / 2, 0.0, LIMIT / 2], back, strict=True):
        cost = simulated(plan, [[(11, -SPEED, rate)]], start)
        assert price == pytest.approx(cost + 6.0 + 0.6 * np.pi, rel=1e-4)


@pytest.mark.parametrize("seed", range(8))
def test_what_is_not_simulated_could_not_have_been_selected(seed):
    """Among obstacles the move is the one that all prices, with the whole search, would select."""
    rng = np.random.default_rng(seed)
    log_odds = np.full((256, 256), -1.0, dtype=np.float32)
    log_odds[rng.uniform(size=log_odds.shape) < 0.02] = 2.0
    plan = LocalPlanner(GRID, rollouts=CONFIG).plan
    twists = set()
    for _ in range(20):
        goal, yaw, rate = rng.uniform(-20.0, 20.0, 2), *rng.uniform(-3.0, 3.0, 2)
        position = rng.uniform(-1.0, 1.0, 2)
        centre = np.floor(position / CELL).astype(np.int64)
        plan.plan(log_odds, centre, EVERYWHERE, position, goal)
        twist = chosen(plan, rate, position, yaw)
        twists.add(twist)
        rollouts = rollouts_of()
        found = all_prices(plan, rollouts, rate, position, yaw)
        best = 0 if found[0] <= found.min() + CONFIG.override_margin else found.argmin()
        moves = rollouts._candidates
        rates = [rate, *moves.rates[1:], *moves.turns, *moves.reverse_rates]
        expected = LIMIT * np.sign(rates[best]) if 6 <= best < 18 else rates[best]
        assert twist.angular == pytest.approx(expected)
        assert np.sign(twist.linear) == (1 if best < 6 else -1 if best >= 18 else 0)
    assert len(twists) > 5


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.8])
def test_front_and_rear_of_the_body_need_clearance(yaw):
    """A wall along the way needs less clearance than one across it."""
    c, s = np.cos(yaw), np.sin(yaw)
    needed = ROBOT.half_radius + 0.06
    across = nowhere(clearance=lambda x, y: 1.2 - c * x - s * y)
    along = nowhere(clearance=lambda x, y: needed + 0.01 - c * y + s * x)
    for plan, is_free in ((across, False), (along, True)):
        rollouts = rollouts_of(rates=(0.0,))
        straight = all_prices(plan, rollouts, yaw=yaw)[0]
        assert (straight < ARC + 1e-3) == is_free
        assert straight >= ARC - 1e-9
    # The front circle lies a quarter of the length ahead, at each point of the way.
    rollouts = rollouts_of(rates=(0.0,))
    found = all_prices(across, rollouts, yaw=yaw)
    points = 0.06 * np.arange(1, 34)
    lack = np.maximum(needed - (1.2 - points - ROBOT.length / 4), 0.0)
    assert found[0] == pytest.approx(ARC + 1e4 * (lack**2).sum(), rel=1e-3)


def test_turning_costs_time_even_without_stops():
    """A goal to the front is reached by an arc rather than a turn, though stops cost nothing."""
    goal = 3.0 * np.array([np.cos(0.6), np.sin(0.6)])
    command = chosen(synthetic(goal), 0.5, stop_cost=0.0, override_margin=0.0)
    assert command.linear > 0
    assert command.angular > 0


def test_a_turn_is_paid_for_when_it_begins():
    """A turn to the same side goes on without a stop; one to the other side costs a stop."""
    rollouts = rollouts_of(override_margin=0.0)
    behind = synthetic(goal=(-8.0, 0.5), clearance=0.5, rest=lambda x, y: 5.0 * np.hypot(x + 8, y))
    first = chosen(behind, 0.0, rollouts=rollouts)
    assert first == Twist(0.0, LIMIT)
    _, turns, _ = prices(nowhere(), rollouts=rollouts)
    np.testing.assert_allclose(turns[:6], 0.6 * TURNS + AFTER_TURN)
    np.testing.assert_allclose(turns[6:], 0.6 * TURNS + AFTER_TURN + 3.0)
    # That call selected an arc: the turn has ended.
    _, turns, _ = prices(nowhere(), rollouts=rollouts)
    np.testing.assert_allclose(turns, np.tile(0.6 * TURNS + AFTER_TURN + 3.0, 2))
    chosen(behind, 0.0, rollouts=rollouts)
    rollouts.reset()
    _, turns, _ = prices(nowhere(), rollouts=rollouts)
    np.testing.assert_allclose(turns, np.tile(0.6 * TURNS + AFTER_TURN + 3.0, 2))


def test_a_rollout_ends_at_the_goal():
    """The way behind the goal costs nothing: an obstacle there does not matter."""
    plan = synthetic(goal=(1.0, 0.0), clearance=lambda x, y: np.where(x > 1.3, 0.0, 3.0))
    arcs, *_ = prices(plan)
    # The first point nearer than 0.3 m ends it: 0.72 m, of which 11 steps are driven.
    assert arcs[0] == pytest.approx(0.66)
    near = synthetic(goal=(0.5, 0.0))
    arcs, *_ = prices(near)
    assert arcs[0] == pytest.approx(0.18)


def test_a_rollout_ends_where_the_robot_stops():
    """The goal's radius is the robot's own: with 0.8 m the rollout ends half a metre before."""
    plan = synthetic(goal=(1.5, 0.0))
    rollouts = TrajectoryRollouts(ROBOT, CONFIG, goal_radius=0.8)
    arcs, *_ = prices(plan, rollouts)
    assert arcs[0] == pytest.approx(0.66)


@pytest.mark.parametrize("rate", [-3.0, 3.0])
def test_a_command_beyond_the_limit_is_priced_at_the_limit(rate):
    """The controller's own number comes back; the robot limits it when it is executed."""
    goal = np.array([0.0, np.sign(rate) * 6.0])
    assert selected(planner_of(np.inf, goal), rate).angular == rate


def test_a_command_in_the_dead_zone_is_priced_as_straight_on():
    """What is executed is what is simulated; the command itself comes back."""
    rollouts = rollouts_of()
    assert chosen(nowhere(), 0.1, rollouts=rollouts).angular == 0.1
    assert rollouts._candidates.rates[0] == 0.0
    chosen(nowhere(), 0.9, rollouts=rollouts)
    assert rollouts._candidates.rates[0] == LIMIT


def test_a_stay_of_known_length_relaxes_the_clearance_by_its_share():
    """Nothing after one no-progress time, all of it after twice that, and no more."""
    rollouts = rollouts_of()
    body = rollouts._body
    radii = []
    for _ in range(150):
        relaxed = rollouts._relaxed(np.array([3.0, 4.0]))
        radii.append(body.radius - relaxed.radius)
        assert body.swing_radius - relaxed.swing_radius == pytest.approx(radii[-1])
    # Each decision stands for half a second.
    np.testing.assert_allclose(radii[:60], 0.0)
    np.testing.assert_allclose(radii[89], 0.1)
    np.testing.assert_allclose(radii[119:], 0.2)
    far = rollouts._relaxed(np.array([3.0, 6.6]))
    assert far.radius == body.radius
    near = rollouts._relaxed(np.array([3.0, 6.4]))
    assert near.radius == pytest.approx(body.radius - 0.2)
    rollouts.reset()
    assert rollouts._relaxed(np.array([3.0, 4.0])).radius == body.radius


def test_a_stay_is_forgotten_after_its_memory():
    """Places of more than a minute and a half ago count no more."""
    rollouts = rollouts_of()
    for _ in range(150):
        rollouts._relaxed(ORIGIN)
    radii = [rollouts._relaxed(np.array([10.0, 0.0])).radius for _ in range(30)]
    assert radii[0] == rollouts._body.radius
    assert rollouts._relaxed(ORIGIN).radius == pytest.approx(rollouts._body.radius - 0.2)
    for _ in range(150):
        rollouts._relaxed(np.array([10.0, 0.0]))
    assert rollouts._relaxed(ORIGIN).radius == rollouts._body.radius
