"""Rollouts: a command stands where it is safe; else a cheaper arc, a turn, or backing out."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from andabata.machine.kinematics import Twist, executed_twist
from andabata.machine.robot import RobotModel
from andabata.navigation.planning.cost_map import CostConfig, CostWeights
from andabata.navigation.planning.cost_to_go import search_for
from andabata.navigation.planning.geofence_bounds import EVERYWHERE
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.planning.rollout_prices import Place
from andabata.navigation.planning.trajectory_rollouts import (
    TrajectoryRollouts,
    TrajectoryRolloutsConfig,
    arc_fan,
)
from tests.situations import GRID, ORIGIN, between, odds_of

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


def chosen(plan, rate, position=ORIGIN, yaw=0.0, rollouts=None, **settings):
    """Return the twist for a command over a synthetic plan."""
    rollouts = rollouts or rollouts_of(**settings)
    return rollouts.select(plan, CELL, np.asarray(position, dtype=float), yaw, rate)


def test_a_safe_command_stands():
    """Straight on and a gentle turn towards a free goal are driven as commanded."""
    free = planner_of(np.inf)
    assert selected(free, 0.0) == Twist(SPEED, 0.0)
    assert selected(free, 0.2) == Twist(SPEED, 0.2)


def test_a_command_into_a_wall_is_replaced():
    """The robot steers around the wall on the shorter side."""
    command = selected(planner_of(between(-35, 60, 1.2)), 0.0)
    assert command.angular < 0  # The way round is shorter on the right.
    assert command.linear == SPEED


def test_walls_are_kept_away_from_where_there_is_space():
    """Both ways lead on; the straight one passes the wall at a hand's breadth."""
    beside = planner_of(between(20, 160, 0.75))
    needed = ROBOT.half_radius + CONFIG.margin
    places = np.array([[x, 0.0] for x in np.arange(0.0, 1.2, 0.2)]) - beside.plan.corner
    clearance = beside.plan.clearance[tuple((places / CELL).astype(int).T)] * CELL
    assert (clearance > needed).all()
    assert selected(beside, 0.0, cost_share=0.0).angular == 0.0
    assert selected(beside, 0.0).angular < 0.0


def test_where_every_arc_ends_in_a_wall_it_turns_on_the_spot():
    """In a pocket it turns at the limit; once it faces the way out, it drives."""
    pocket = planner_of(between(-150, 150, 0.8), np.array([-8.0, 0.0]))
    command = selected(pocket, 0.0)
    assert (abs(command.angular), command.linear) == (LIMIT, 0.0)
    assert selected(pocket, 0.0, yaw=np.pi) == Twist(SPEED, 0.0)


def test_a_goal_behind_is_turned_to_rather_than_circled():
    """With clearance for an arc it is driven; without the cost of stops it turns on the spot."""
    behind = planner_of(np.inf, np.array([-8.0, 0.5]))
    assert selected(behind, 0.5).linear == SPEED
    assert selected(behind, -0.5, stop_cost=0.0) == Twist(0.0, 0.5)


def test_a_turn_that_has_begun_goes_on():
    """Between two ways of equal cost the robot does not alternate."""
    pocket = planner_of(between(-150, 150, 0.8), np.array([-8.0, 0.0]))
    rollouts = rollouts_of()
    first = rollouts.select(pocket.plan, CELL, ORIGIN, 0.0, 0.0)
    for yaw in np.sign(first.angular) * np.array([-0.2, 0.5, 1.0, 2.0]):
        assert rollouts.select(pocket.plan, CELL, ORIGIN, yaw, 0.0) == first


@pytest.mark.parametrize("heading", [0.0, 0.5, 2.0, -1.1])
def test_the_way_that_it_came_is_a_way_back(heading):
    """Even when nothing else is left; backwards where there is no space to turn round."""
    planner = LocalPlanner(GRID, rollouts=CONFIG)
    blocked = np.full((GRID.n_sectors, GRID.n_rings), np.inf, dtype=np.float32)
    ahead = np.array([np.cos(heading), np.sin(heading)])
    for x in np.arange(-4.0, 0.05, 0.1):
        planner.occupancy.update(blocked, x * ahead, heading)
    planner.subgoal(ORIGIN, -4.0 * ahead)
    turned = selected(planner, 0.0, yaw=heading + np.pi)
    assert abs(turned.angular) <= 0.25
    assert turned.linear == SPEED * CONFIG.max_speed_scale
    backwards = selected(planner, 0.0, yaw=heading)
    assert abs(backwards.angular) <= 0.25
    assert backwards.linear == -SPEED


def test_it_drives_faster_over_known_ground_with_clearance_on_both_sides():
    """Twice the speed in the open, half of the extra speed beside a wall, none near one."""
    free = driven_up_to(np.full(GRID.n_sectors, np.inf))
    assert selected(free, 0.1) == Twist(2.0 * SPEED, 0.1)
    assert selected(free, 0.1, max_speed_scale=1.0) == Twist(SPEED, 0.1)
    assert selected(planner_of(np.inf), 0.1) == Twist(SPEED, 0.1)  # The ground is unknown.
    # A wall beside its way.
    speeds = [selected(driven_up_to(between(60, 120, far)), 0.0).linear for far in (2.4, 1.2, 0.8)]
    assert speeds == [2.0 * SPEED, 1.5 * SPEED, SPEED]


def test_a_fast_arc_is_checked_as_far_as_it_leads():
    """The wall ahead is in the way of the fast arc alone."""
    ahead = driven_up_to(between(-20, 20, 3.0))
    assert selected(ahead, 0.0, max_speed_scale=1.0, arc_time=1.0).linear == SPEED
    speeds = [
        selected(ahead, 0.0, max_speed_scale=scale, arc_time=2.2).linear for scale in (1.2, 3.0)
    ]
    assert speeds == [1.2 * SPEED, SPEED]


def test_a_turn_on_the_spot_is_simulated_as_far_ahead_as_an_arc():
    """With a shorter horizon a turn would seem freer than an arc."""
    moves, motion = rollouts_of()._candidates, rollouts_of()._motion
    assert abs(motion.points + moves.after_arc.shape[1] - moves.after_turn.shape[1]) <= 1


def test_arcs_move_as_the_robot_does():
    """All sequences of rates, at constant speed, with the heading of their chords."""
    paths, first = arc_fan(ROBOT, CONFIG.rates, CONFIG.arcs, CONFIG.arc_time)
    assert paths.shape == (125, 33, 3)
    steps = np.hypot(*np.diff(paths[..., :2], axis=1).transpose(2, 0, 1))
    np.testing.assert_allclose(steps, SPEED * 0.2, rtol=2e-3)
    assert set(np.round(first, 3)) == {-0.5, -0.25, 0.0, 0.25, 0.5}
    np.testing.assert_allclose(paths[first == 0][0, 10], [0.66, 0.0, 0.0], atol=1e-9)
    # A left circle of radius speed over rate, within the error of its chords.
    left = paths[(first == 0.5) & (np.abs(paths[:, -1, 2] - 3.3) < 1e-9)][0]
    time = 0.2 * np.arange(1, 34)
    np.testing.assert_allclose(left[:, 2], 0.5 * time, atol=1e-9)
    np.testing.assert_allclose(left[:, 0], 0.6 * np.sin(0.5 * time), atol=1e-3)
    np.testing.assert_allclose(left[:, 1], 0.6 * (1 - np.cos(0.5 * time)), atol=1e-3)


@pytest.mark.parametrize("rate", [-3.0, 3.0])
def test_a_command_beyond_the_limit_is_priced_at_the_limit(rate):
    """The controller's own number comes back; the robot limits it when it is executed."""
    goal = np.array([0.0, np.sign(rate) * 6.0])
    assert selected(planner_of(np.inf, goal), rate).angular == rate


@pytest.mark.parametrize(("relaxation", "gets_out"), [(0.0, False), (0.2, True)])
def test_a_robot_without_progress_keeps_less_clearance_in_the_end(relaxation, gets_out):
    """A pen whose gap seems too narrow, since obstacles are whole cells, is left after a while."""
    planner = LocalPlanner(GRID, rollouts=CONFIG)
    log_odds = planner.occupancy.log_odds
    log_odds[:] = -2.0
    for k in range(-9, 10):
        for i, j in ((k, -9), (k, 8), (-9, k), (8, k)):
            log_odds[i % 256, j % 256] = 3.0
    log_odds[8, [-1, 0]] = -2.0
    planner.subgoal(ORIGIN, AHEAD)
    rollouts = rollouts_of(clearance_relaxation=relaxation, action_repeat=5)
    position, yaw, left = np.zeros(2), 0.0, 0
    for step in range(200):
        command = rollouts.select(planner.plan, CELL, position, yaw, 0.0)
        position = position + 0.5 * command.linear * np.array([np.cos(yaw), np.sin(yaw)])
        yaw += 0.5 * command.angular
        if np.abs(position).max() > 2.2:
            left = step
            break
    assert (left > 0) == gets_out
    if gets_out:
        assert 0.5 * left > CONFIG.no_progress_time


ARC = 33 * 0.06
"""Length of three arcs in a row [m]: 33 steps of 0.2 s at 0.3 m/s."""

AFTER_TURN = 32 * 0.06
"""Length of the two longer arcs after a turn [m]."""

TURNS = np.arange(1, 7) * np.pi / 6


def all_prices(plan, rollouts, rate=0.0, position=ORIGIN, yaw=0.0):
    """Return the costs of all moves [m], shape (arcs + turns + arcs backwards,), and select one."""
    rollouts._candidates.rates[0] = executed_twist(Twist(SPEED, rate), ROBOT).angular
    place = Place(*(np.asarray(position) - plan.corner) / CELL, yaw)
    rollouts._price(plan, CELL, place, rollouts._body, -np.inf)
    found = rollouts._prices.copy()
    chosen(plan, rate, position, yaw, rollouts)
    return found


def prices(plan, rollouts=None, rate=0.0, **settings):
    """Return the costs of arcs, turns and arcs backwards over a synthetic plan [m]."""
    return np.split(all_prices(plan, rollouts or rollouts_of(**settings), rate), [6, 18])


def nowhere(**options):
    """Return a plan whose goal is far away and whose rest of the way costs nothing."""
    return synthetic(goal=(200.0, 0.0), rest=0.0, **options)


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


def test_a_first_arc_into_an_obstacle_is_replaced():
    """A thin obstacle that the first arc passes, and the following arcs no more, counts."""
    plan = synthetic(
        clearance=lambda x, y: np.where((np.abs(x - 0.3) < 0.2) & (y > -0.2), 0.0, 3.0)
    )
    assert chosen(plan, 0.0) != Twist(2.0 * SPEED, 0.0)
    assert chosen(plan, 0.0).angular < 0 or chosen(plan, 0.0).linear <= 0


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
        arrived = np.flatnonzero(to_goal < 0.8)
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


@pytest.mark.parametrize("yaw", [0.0, 1.3])
def test_backing_out_leads_backwards(yaw):
    """Where the way on is behind and neither arc nor turn is free, the robot drives backwards."""
    c, s = np.cos(yaw), np.sin(yaw)
    plan = synthetic(goal=(-8.0 * c, -8.0 * s), clearance=lambda x, y: 0.47 - c * x - s * y)
    assert chosen(plan, 0.0, yaw=yaw).linear == -SPEED
    _, _, back = np.split(rollouts_of()._prices, [6, 18])
    assert len(back) == 3


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


def test_the_command_is_replaced_only_by_a_way_that_is_cheaper_by_the_margin():
    """A detour that costs less than the margin stands; without a margin it is replaced."""
    plan = nowhere(cost=lambda x, y: 1.0 + np.clip(0.6 * y, 0.0, 1.0))
    arcs, *_ = prices(plan, rate=0.5)
    gain = arcs[0] - arcs.min()
    assert 0.05 < gain < 0.3
    assert chosen(plan, 0.5).angular == 0.5
    assert chosen(plan, 0.5, override_margin=gain + 0.001).angular == 0.5
    assert chosen(plan, 0.5, override_margin=gain - 0.001).angular < 0.5


def test_a_command_in_the_dead_zone_is_priced_as_straight_on():
    """What is executed is what is simulated; the command itself comes back."""
    rollouts = rollouts_of()
    assert chosen(nowhere(), 0.1, rollouts=rollouts).angular == 0.1
    assert rollouts._candidates.rates[0] == 0.0
    chosen(nowhere(), 0.9, rollouts=rollouts)
    assert rollouts._candidates.rates[0] == LIMIT


@pytest.mark.parametrize("yaw", [0.0, 2.2])
def test_position_and_heading_place_the_rollouts_in_the_plan(yaw):
    """A robot elsewhere, that faces elsewhere, steers to the side of its goal."""
    position = np.array([5.0, -7.0])
    for side in (1.0, -1.0):
        goal = position + 6.0 * np.array([np.cos(yaw + side * 1.2), np.sin(yaw + side * 1.2)])
        command = chosen(synthetic(goal), 0.0, position, yaw)
        assert np.sign(command.angular) == side


def test_a_rollout_ends_at_the_goal():
    """The way behind the goal costs nothing: an obstacle there does not matter."""
    plan = synthetic(goal=(1.5, 0.0), clearance=lambda x, y: np.where(x > 1.3, 0.0, 3.0))
    arcs, *_ = prices(plan)
    # The first point nearer than 0.8 m ends it: 0.72 m, of which 11 steps are driven.
    assert arcs[0] == pytest.approx(0.66)
    near = synthetic(goal=(1.0, 0.0))
    arcs, *_ = prices(near)
    assert arcs[0] == pytest.approx(0.18)


def test_without_a_way_on_the_nearest_end_to_the_goal_is_taken():
    """Where the plan knows no way the distance to the goal decides."""
    for side in (1.0, -1.0):
        plan = synthetic(goal=(3.0, side * 6.0), rest=np.inf)
        assert np.sign(chosen(plan, 0.0).angular) == side
        arcs, *_ = prices(plan)
        assert (arcs > 1000.0).all()


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


@pytest.mark.parametrize(
    ("clearance", "scale"), [(1.31, 2.0), (1.29, 1.5), (0.91, 1.5), (0.89, 1.0)]
)
def test_the_speed_scale_depends_on_the_clearance(clearance, scale):
    """All of the extra speed from the inflation radius on, half of it from its own clearance on."""
    inflation = 2.0 * np.clip((1.3 - clearance) / 0.8, 0.0, 1.0)
    plan = nowhere(clearance=clearance, cost=1.0 + inflation + 1e-4)
    assert chosen(plan, 0.0).linear == pytest.approx(scale * SPEED)


def test_other_costs_than_inflation_forbid_extra_speed():
    """Uncertain ground of a wide clearance is driven at the plain speed."""
    plan = nowhere(clearance=1.0, cost=1.0 + 2.0 * 0.3 / 0.8 + 0.01)
    assert chosen(plan, 0.0).linear == SPEED


@pytest.mark.parametrize("yaw", [0.0, 1.9])
@pytest.mark.parametrize("rate", [0.5, -0.5])
def test_the_extra_speed_is_checked_along_the_arc_that_is_driven(yaw, rate):
    """Unknown ground on the arc forbids it, on the other side it does not matter."""
    end = 11 * 0.2 * rate / 2
    place = 1.1 * np.array([np.cos(yaw + end), np.sin(yaw + end)])
    for sign, scale in ((1.0, 1.0), (-1.0, 2.0)):
        turned = np.array([[np.cos(2 * yaw), np.sin(2 * yaw)], [np.sin(2 * yaw), -np.cos(2 * yaw)]])
        x0, y0 = place if sign > 0 else turned @ place
        plan = nowhere(
            cost=lambda x, y, a=x0, b=y0: np.where(np.hypot(x - a, y - b) < 0.3, 1.5, 1.0)
        )
        command = chosen(plan, rate, yaw=yaw, override_margin=50.0)
        assert command == Twist(scale * SPEED, rate)


@pytest.mark.parametrize(
    ("begin", "field", "scale"),
    [
        (0.10, lambda x, y: x > 1.2, 2.0),
        (0.15, lambda x, y: x > 1.2, 1.5),
        (0.45, lambda x, y: x > 1.2, 1.0),
        (0.00, lambda x, y: np.abs(y) > 0.8, 2.0),
        (0.00, lambda x, y: np.abs(y) > 0.6, 1.5),
        (0.00, lambda x, y: np.abs(y) > 0.4, 1.0),
    ],
)
@pytest.mark.parametrize("rate", [0.5, -0.5])
def test_the_extra_speed_is_checked_up_to_the_end_of_a_true_arc(begin, field, scale, rate):
    """Twice the speed ends 1.07 m ahead and 0.66 m aside, half the extra speed at three quarters.

    A field of unknown ground begins at the edge of a cell just before or just behind these ends.
    """
    plan = nowhere(cost=lambda x, y: np.where(field(x, y), 1.5, 1.0))
    command = chosen(plan, rate, (begin, 0.0), override_margin=50.0)
    assert command == Twist(pytest.approx(scale * SPEED), rate)
