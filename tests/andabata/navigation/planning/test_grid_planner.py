"""The plan over a local map: its costs are those of a search that is right by its slowness."""

from heapq import heapify, heappop, heappush

import numpy as np
import pytest

from andabata.navigation.planning.grid_planner import EVERYWHERE, CostWeights, GridPlanner

CELLS, CELL = 64, 0.2
PRICES = CostWeights(
    wall=1.0,
    room=0.5,
    shy=1.3,
    tight=15.0,
    crowd=2.0,
    unseen=0.5,
    doubt=3.0,
    sure=50.0,
    certain=3.0,
)


def a_plan(seed, around=4.0, goal=None):
    """Return a plan over a random map, its start and its goal, in cells."""
    rng = np.random.default_rng(seed)
    evidence = rng.choice([-1.0, 0.0, 0.5, 2.0], (CELLS, CELLS), p=[0.5, 0.3, 0.15, 0.05])
    plan = GridPlanner(
        CELLS, CELL, PRICES, spans=(1.5, 5.0), around=around, passage=(0.4, 0.25, 0.7)
    )
    here, drawn = rng.uniform(-6.0, 6.0, (2, 2))
    goal = drawn if goal is None else goal
    centre = np.floor(here / CELL).astype(np.int64)
    plan.make(evidence.astype(np.float32), centre, EVERYWHERE, here, goal)
    first, last = (np.floor((place - plan.corner) / CELL).astype(int) for place in (here, plan.end))
    return plan, tuple(first), tuple(last)


def dijkstra(costs, last):
    """Return the cost of the way to a cell from everywhere, shape (n, n).

    A cell beyond the square is reached from each cell of its edge, over ground that nobody has
    seen.
    """
    n = len(costs)
    found = np.full(costs.shape, np.inf)
    queue = [(0.0, last)]
    if not (0 <= last[0] < n and 0 <= last[1] < n):
        edge = [(i, j) for i in range(n) for j in range(n) if {i, j} & {0, n - 1}]
        queue = [
            (np.hypot(last[0] - i, last[1] - j) * (1 + PRICES.unseen), (i, j)) for i, j in edge
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
def test_the_way_costs_what_a_plain_search_says(seed):
    plan, first, last = a_plan(seed)
    true = dijkstra(plan.costs.astype(float), last)
    assert plan.onward[first] == pytest.approx(true[first], rel=1e-5)
    n = np.arange(CELLS)
    apart = np.hypot(n[:, None] - first[0], n[None, :] - first[1])
    known = true + apart <= true[first] + 4.0 / CELL - 1.0
    assert known.sum() > 100
    np.testing.assert_allclose(plan.onward[known], true[known], rtol=1e-5)
    assert (plan.onward >= true * (1 - 1e-5)).all()


@pytest.mark.parametrize("seed", range(4))
def test_a_goal_beyond_the_square_is_reached_from_every_cell_of_its_edge(seed):
    """Or the way leads to the place of the edge nearest to the goal, be it inside a bank."""
    goal = 30.0 * np.array([np.cos(seed + 0.5), np.sin(seed + 0.5)])
    plan, first, last = a_plan(seed, goal=goal)
    assert min(last) < 0 or max(last) >= CELLS
    true = dijkstra(plan.costs.astype(float), last)
    assert plan.onward[first] == pytest.approx(true[first], rel=1e-5)
    assert (plan.onward >= true * (1 - 1e-5)).all()


def test_a_known_way_round_is_taken_to_a_goal_beyond_the_square():
    """A slope before the goal ends the square, but for a trail far from the goal."""
    evidence = np.full((CELLS, CELLS), -1.0, dtype=np.float32)
    evidence[-16:-14, :] = 3.0  # The square wraps around: this is behind the robot.
    evidence[14:32, :] = 3.0
    evidence[14:32, -28:-16] = -1.0
    plan = GridPlanner(CELLS, CELL, PRICES, spans=(1.5, 5.0), around=4.0, passage=(0.4, 0.25, 0.7))
    here, goal = np.zeros(2), np.array([12.0, 2.0])
    place = plan.make(evidence, np.zeros(2, dtype=np.int64), EVERYWHERE, here, goal)
    assert place is not None
    assert place[1] < -2.0


def test_no_price_overtakes_the_ring_of_buckets():
    """Cells wait in a ring: one that waited a whole turn behind would be taken for the next."""
    dear = PRICES._replace(tight=200.0)
    plan = GridPlanner(CELLS, CELL, dear, spans=(1.5, 5.0), around=8.0, passage=(0.4, 0.25, 0.7))
    evidence = np.full((CELLS, CELLS), -1.0, dtype=np.float32)
    evidence[:, 20] = 2.0
    here, goal = np.array([0.0, 0.0]), np.array([0.0, 5.5])
    plan.make(evidence, np.zeros(2, dtype=np.int64), EVERYWHERE, here, goal)
    first, last = (
        tuple(np.floor((place - plan.corner) / CELL).astype(int)) for place in (here, plan.end)
    )
    true = dijkstra(plan.costs.astype(float), last)
    assert plan.onward[first] == pytest.approx(true[first], rel=1e-5)


def test_a_wall_that_was_seen_from_near_is_dearer_than_a_doubtful_one():
    """Or the robot goes to and fro between two thin walls that it has seen often enough."""
    here, goal = np.array([0.0, -2.0]), np.array([0.0, 2.0])
    spent = {}
    for believed in (0.9, 1.1, 3.0):
        evidence = np.full((CELLS, CELLS), -1.0, dtype=np.float32)
        evidence[:, :2] = believed  # Right across the square, two cells thick.
        plan = GridPlanner(
            CELLS, CELL, PRICES, spans=(1.5, 5.0), around=0.0, passage=(0.4, 0.25, 0.7)
        )
        plan.make(evidence, np.zeros(2, dtype=np.int64), EVERYWHERE, here, goal)
        spent[believed] = plan.onward[tuple(((here - plan.corner) / CELL).astype(int))]
    assert spent[1.1] > spent[0.9] + 60
    wall = PRICES.sure * (3.0 - 1.1) * 2
    assert spent[3.0] == pytest.approx(spent[1.1] + wall, rel=0.02)


def test_where_the_robot_has_driven_a_metre_costs_no_more_than_a_metre():
    """Or it explores rather than drive back through the gap that it came through."""
    evidence = np.full((CELLS, CELLS), -1.0, dtype=np.float32)
    evidence[2, :], evidence[-2, :] = 2.0, 2.0
    here, goal = np.array([0.1, -3.0]), np.array([0.1, 3.0])
    spent = {}
    for driven in (False, True):
        evidence[0, :] = -PRICES.certain if driven else -1.0
        plan = GridPlanner(
            CELLS, CELL, PRICES, spans=(1.5, 5.0), around=0.0, passage=(0.4, 0.25, 0.7)
        )
        plan.make(evidence, np.zeros(2, dtype=np.int64), EVERYWHERE, here, goal)
        spent[driven] = plan.onward[tuple(((here - plan.corner) / CELL).astype(int))] * CELL
    assert spent[False] > 60.0
    assert spent[True] == pytest.approx(6.0, abs=CELL)
