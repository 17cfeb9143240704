"""Grid planner: costs of known value, cost to go of a plain search, and sub-goals on the path."""

from heapq import heapify, heappop, heappush

import numpy as np
import pytest

from andabata.navigation.planning.cost_bound import bound_of, least_cost
from andabata.navigation.planning.cost_map import CostWeights, Passage
from andabata.navigation.planning.geofence_bounds import EVERYWHERE
from andabata.navigation.planning.grid_planner import GridPlanner

CELLS, CELL = 64, 0.2
WEIGHTS = CostWeights(
    lethal_log_odds=1.0,
    max_log_odds=3.0,
    inscribed_radius=0.5,
    inflation_radius=1.3,
    inscribed_cost=15.0,
    inflation_cost=2.0,
    unknown_cost=0.5,
    uncertain_cost=3.0,
    lethal_cost=50.0,
)
MIDDLE = CELLS // 2
ORIGIN, CENTRE = np.zeros(2), np.zeros(2, dtype=np.int64)


def make(weights=WEIGHTS, margin=4.0, lookahead=(1.5, 5.0), passage=(0.4, 0.25, 0.7)):
    """Return a planner over a small square."""
    return GridPlanner(CELLS, CELL, weights, lookahead, margin, Passage(*passage))


def free(value=-1.0):
    """Return log odds of the same value everywhere."""
    return np.full((CELLS, CELLS), value, dtype=np.float32)


def cells_of(plan, *places):
    """Return the cells of some places [m]."""
    return [tuple(np.floor((place - plan.corner) / CELL).astype(int)) for place in places]


def planned(log_odds, start=ORIGIN, goal=(3.0, 0.0), geofence=EVERYWHERE, hits=None, **options):
    """Return a planner around the origin with its plan, and the sub-goal."""
    plan = make(**options)
    return plan, plan.plan(log_odds, CENTRE, geofence, np.array(start), np.array(goal), hits)


def a_plan(seed, margin=4.0, goal=None):
    """Return a plan over a random grid, its start and its goal, in cells."""
    rng = np.random.default_rng(seed)
    log_odds = rng.choice([-1.0, 0.0, 0.5, 2.0], (CELLS, CELLS), p=[0.5, 0.3, 0.15, 0.05])
    plan = make(margin=margin)
    start, drawn = rng.uniform(-6.0, 6.0, (2, 2))
    goal = drawn if goal is None else goal
    centre = np.floor(start / CELL).astype(np.int64)
    plan.plan(log_odds.astype(np.float32), centre, EVERYWHERE, start, goal)
    return plan, *cells_of(plan, start, plan.goal)


def dijkstra(costs, last):
    """Return the cost of the way to a cell from everywhere, shape (n, n).

    A cell beyond the square is reached from each cell of its edge, over unknown ground.
    """
    n = len(costs)
    found = np.full(costs.shape, np.inf)
    queue = [(0.0, last)]
    if not (0 <= last[0] < n and 0 <= last[1] < n):
        edge = [(i, j) for i in range(n) for j in range(n) if {i, j} & {0, n - 1}]
        queue = [
            (np.hypot(last[0] - i, last[1] - j) * (1 + WEIGHTS.unknown_cost), (i, j))
            for i, j in edge
        ]
        heapify(queue)
    for length, cell in queue:
        found[cell] = length
    while queue:
        here, (i, j) = heappop(queue)
        if here > found[i, j]:
            continue
        for p in range(max(i - 1, 0), min(i + 2, len(costs))):
            for q in range(max(j - 1, 0), min(j + 2, len(costs))):
                length = here + np.hypot(p - i, q - j) * (costs[i, j] + costs[p, q]) / 2
                if length < found[p, q]:
                    found[p, q] = length
                    heappush(queue, (length, (p, q)))
    return found


@pytest.mark.parametrize("seed", range(8))
def test_the_cost_to_go_is_that_of_a_plain_search(seed):
    """It is exact at the robot and within the margin around it, and never too low elsewhere."""
    plan, first, last = a_plan(seed)
    true = dijkstra(plan.costs.astype(float), last)
    assert plan.cost_to_go[first] == pytest.approx(true[first], rel=1e-5)
    bound = bound_of(plan.search.first, plan.search.octagon, plan.search.unknown)
    apart = np.array([[least_cost(bound, i, j) for j in range(CELLS)] for i in range(CELLS)])
    known = true + apart <= true[first] + 4.0 / CELL - 1.0
    assert known.sum() > 100
    np.testing.assert_allclose(plan.cost_to_go[known], true[known], rtol=1e-5)
    assert (plan.cost_to_go >= true * (1 - 1e-5)).all()


@pytest.mark.parametrize("seed", range(4))
def test_a_goal_beyond_the_square_is_reached_from_every_cell_of_its_edge(seed):
    """The edge cell is chosen by the whole way, not by its distance to the goal alone."""
    goal = 30.0 * np.array([np.cos(seed + 0.5), np.sin(seed + 0.5)])
    plan, first, last = a_plan(seed, goal=goal)
    assert min(last) < 0 or max(last) >= CELLS
    true = dijkstra(plan.costs.astype(float), last)
    assert plan.cost_to_go[first] == pytest.approx(true[first], rel=1e-5)
    assert (plan.cost_to_go >= true * (1 - 1e-5)).all()


def test_a_known_way_round_is_taken_to_a_goal_beyond_the_square():
    """A slope before the goal ends the square, but for a trail far from the goal."""
    log_odds = free()
    log_odds[-16:-14, :] = 3.0  # The square wraps around: this is behind the robot.
    log_odds[14:32, :] = 3.0
    log_odds[14:32, -28:-16] = -1.0
    _, place = planned(log_odds, goal=(12.0, 2.0))
    assert place is not None
    assert place[1] < -2.0


def test_no_cost_overtakes_the_ring_of_buckets():
    """Cells wait in a ring that is longer than the dearest step, so that none is taken too soon."""
    dear = WEIGHTS._replace(inscribed_cost=200.0)
    log_odds = free()
    log_odds[:, 20] = 2.0
    plan, _ = planned(log_odds, goal=(0.0, 5.5), weights=dear, margin=8.0)
    first, last = cells_of(plan, ORIGIN, plan.goal)
    true = dijkstra(plan.costs.astype(float), last)
    assert plan.cost_to_go[first] == pytest.approx(true[first], rel=1e-5)


def test_an_obstacle_seen_from_near_costs_more_than_an_uncertain_one():
    """Between two thin walls with enough log odds the robot does not go to and fro."""
    start, goal = np.array([0.0, -2.0]), np.array([0.0, 2.0])
    spent = {}
    for known in (0.9, 1.1, 3.0):
        log_odds = free()
        log_odds[:, :2] = known  # Right across the square, two cells thick.
        plan, _ = planned(log_odds, start, goal, margin=0.0)
        spent[known] = plan.cost_to_go[cells_of(plan, start)[0]]
    assert spent[1.1] > spent[0.9] + 60
    wall = WEIGHTS.lethal_cost * (3.0 - 1.1) * 2
    assert spent[3.0] == pytest.approx(spent[1.1] + wall, rel=0.02)


def test_where_the_robot_has_driven_a_metre_costs_one():
    """The way back through a gap that it came through costs no more than its length."""
    log_odds = free()
    log_odds[2, :], log_odds[-2, :] = 2.0, 2.0
    start, goal = np.array([0.1, -3.0]), np.array([0.1, 3.0])
    spent = {}
    for driven in (False, True):
        log_odds[0, :] = -WEIGHTS.max_log_odds if driven else -1.0
        plan, _ = planned(log_odds, start, goal, margin=0.0)
        spent[driven] = plan.cost_to_go[cells_of(plan, start)[0]] * CELL
    assert spent[False] > 60.0
    assert spent[True] == pytest.approx(6.0, abs=CELL)


def test_the_square_lies_around_its_centre():
    """The corner is half the square below the centre; memory is wrapped around."""
    log_odds, centre = free(), np.array([100, -37])
    log_odds[(100 + 3) % CELLS, (-37 - 5) % CELLS] = 2.0
    plan = make()
    start = (centre + 0.5) * CELL
    plan.plan(log_odds, centre, EVERYWHERE, start, start + 1.0)
    np.testing.assert_allclose(plan.corner, (centre - MIDDLE) * CELL)
    np.testing.assert_array_equal(np.argwhere(plan.clearance == 0), [[MIDDLE + 3, MIDDLE - 5]])
    np.testing.assert_allclose(plan.goal, start + 1.0)
    plan.reset()
    np.testing.assert_array_equal(plan.corner, ORIGIN)
    np.testing.assert_array_equal(plan.goal, ORIGIN)


def test_a_free_goal_needs_no_sub_goal():
    """A straight way that costs hardly more than the path is headed for at once."""
    assert planned(free(), goal=(5.0, -2.0))[1] is None
    assert planned(free(), goal=(0.01, 0.0))[1] is None


@pytest.mark.parametrize("reach", [3.0, 5.0])
@pytest.mark.parametrize("bearing", [0.0, 0.9, -2.3])
def test_the_sub_goal_is_the_farthest_within_the_lookahead(reach, bearing):
    """On the way to a goal beyond the square it lies a cell or less short of the lookahead."""
    direction = np.array([np.cos(bearing), np.sin(bearing)])
    _, place = planned(free(), goal=50.0 * direction, lookahead=(1.5, reach))
    assert reach - 1.5 * CELL < np.hypot(*place) <= reach
    assert place @ direction > 0.9 * reach


@pytest.mark.parametrize("bearing", [0.0, 0.5 * np.pi, np.pi, -0.5 * np.pi])
def test_a_lookahead_beyond_the_square_ends_at_its_edge(bearing):
    """The sub-goal on the way to a goal outside is the edge cell that the path leaves by."""
    direction = np.array([np.cos(bearing), np.sin(bearing)])
    _, place = planned(free(), goal=50.0 * direction, lookahead=(1.5, 10.0))
    edge = (MIDDLE - 0.5) * CELL
    assert place @ direction == pytest.approx(edge, abs=1e-6)
    assert np.abs(place).min() < 1.5 * CELL


def walled(gap):
    """Return log odds of a wall at x = 1.2 m with a gap that begins at some y [m]."""
    log_odds = free()
    log_odds[6, :] = 3.0
    log_odds[6, round(gap / CELL) : round(gap / CELL) + 10] = -1.0
    return log_odds


def test_the_sub_goal_can_be_headed_for_straight_away():
    """Behind a wall the sub-goal is where the straight line costs hardly more than the path."""
    plan, place = planned(walled(2.0), goal=(4.0, 0.0))
    assert place is not None
    (first, last) = cells_of(plan, ORIGIN, place)
    spent = plan.cost_to_go[first] - plan.cost_to_go[last]
    share = (np.arange(2000) + 0.5) / 2000
    cells = np.floor((np.outer(share, place) - plan.corner) / CELL).astype(int)
    straight = plan.costs[tuple(cells.T)].mean() * np.hypot(*place) / CELL
    assert straight <= 1.05 * spent + 1.5
    assert place[1] > 1.0
    # A quarter more of the way could not be headed for: it lies behind the wall's end.
    assert np.hypot(*place) > 1.5


def test_the_sub_goal_is_no_nearer_than_the_lookahead_allows():
    """In a bent corridor nearer places are passed over, whatever the straight line costs."""
    log_odds = free(3.0)
    log_odds[-1:2, -1:6] = -1.0
    log_odds[-1:2, :] = np.where(np.arange(CELLS) < 6, -1.0, 3.0)
    log_odds[:30, 3:6] = -1.0
    _, near = planned(log_odds, goal=(5.0, 0.9), lookahead=(0.0, 5.0))
    _, far = planned(log_odds, goal=(5.0, 0.9), lookahead=(2.0, 5.0))
    assert np.hypot(*near) < 1.6
    assert np.hypot(*far) > 2.0 - 1.5 * CELL


def test_the_way_leads_around_the_wall_from_cell_to_cell():
    """It begins in the robot's cell, ends in the goal's, and passes no blocked cell."""
    log_odds = free()
    log_odds[MIDDLE + 5, MIDDLE - 8 : MIDDLE + 4] = 3.0
    rolled = np.roll(log_odds, (MIDDLE, MIDDLE), axis=(0, 1))  # As it is kept: wrapped around.
    plan, _ = planned(rolled, goal=(3.0, 0.0))
    way = plan.way(ORIGIN)
    cells = np.array(cells_of(plan, *way))
    assert np.abs(np.diff(cells, axis=0)).max() == 1
    assert cells[0].tolist() == [MIDDLE, MIDDLE]
    assert np.hypot(*(way[-1] - [3.0, 0.0])) < CELL
    assert (log_odds[cells[:, 0], cells[:, 1]] < 0).all()


def test_there_is_no_way_before_the_first_plan_and_outside_the_square():
    """Nothing is returned."""
    assert make().way(ORIGIN).shape == (0, 2)
    plan, _ = planned(free())
    assert plan.way(np.array([50.0, 0.0])).shape == (0, 2)


def test_a_plan_over_known_clearances_is_that_of_the_map():
    """Sub-goal and costs to go agree where the square of the map is given with its clearances."""
    log_odds = free()
    log_odds[MIDDLE - 12 : MIDDLE + 20, MIDDLE + 8] = 2.0
    centre, goal = np.array([MIDDLE, MIDDLE]), np.array([8.4, 11.4])  # Nothing is wrapped around.
    start = np.array([6.4, 5.4])
    seen, known = make(margin=np.inf), make(margin=np.inf)
    subgoal = seen.plan(log_odds, centre, EVERYWHERE, start, goal)
    clearance = seen.clearance * np.float32(CELL)
    corner = np.array([100.0, -50.0])
    found = known.plan_known(log_odds, clearance, corner, start + corner, goal + corner)
    np.testing.assert_allclose(found - corner, subgoal, atol=1e-9)
    np.testing.assert_allclose(known.cost_to_go, seen.cost_to_go, rtol=1e-4)


def test_another_place_has_its_sub_goal_by_the_last_plan():
    """It is that of a plan from there, without a search."""
    log_odds = free()
    log_odds[MIDDLE - 12 : MIDDLE + 20, MIDDLE + 8] = 2.0
    centre, goal = np.array([MIDDLE, MIDDLE]), np.array([8.4, 11.4])  # Nothing is wrapped around.
    places = np.array([6.4, 5.4]), np.array([4.0, 7.0])
    plans = [make(margin=np.inf) for _ in places]
    first, second = (
        plan.plan(log_odds, centre, EVERYWHERE, place, goal)
        for plan, place in zip(plans, places, strict=True)
    )
    assert not np.array_equal(first, second)
    costs = plans[0].cost_to_go.copy()
    np.testing.assert_array_equal(plans[0].subgoal(places[1]), second)
    np.testing.assert_array_equal(plans[0].subgoal(places[0]), first)
    np.testing.assert_array_equal(plans[0].cost_to_go, costs)
