"""Search of the cost to go: known costs, in any unit, and only as far as they are asked for.

Random grids against a plain search are among the tests of the grid planner.
"""

import numpy as np
import pytest

from andabata.navigation.planning.cost_to_go import search, search_for, settle

CELLS = 32


def searched(costs, first, last, unknown=1.0, margin=1e6):
    """Return the cost to go over some costs."""
    around = search_from(first, costs, unknown)
    search(around, np.array(last), margin)
    return around.cost_to_go


def search_from(first, costs, unknown=1.0):
    """Return a search for a robot in a cell."""
    around = search_for(costs, np.empty_like(costs), float(costs.max()), unknown)
    around.first[:] = first
    return around


def octile(last):
    """Return the length of the way to a cell in steps to eight neighbours."""
    i, j = np.abs(np.mgrid[:CELLS, :CELLS] - np.array(last)[:, None, None])
    return np.maximum(i, j) + (np.sqrt(2.0) - 1.0) * np.minimum(i, j)


@pytest.mark.parametrize("cost", [1.0, 7.5])
def test_even_ground_costs_its_length(cost):
    """Steps are straight or diagonal, and each costs its cells' cost."""
    costs = np.full((CELLS, CELLS), cost, dtype=np.float32)
    found = searched(costs, (3, 4), (20, 11))
    np.testing.assert_allclose(found, cost * octile((20, 11)), rtol=1e-5)


@pytest.mark.parametrize("side", [np.s_[0], np.s_[-1], np.s_[:, 0], np.s_[:, -1]])
def test_a_way_along_an_edge_of_the_square_is_found(side):
    """Cheap ground on one edge alone: from end to end it costs its length."""
    costs = np.full((CELLS, CELLS), 50.0, dtype=np.float32)
    costs[side] = 1.0
    first, last = np.argwhere(costs == 1.0)[[0, -1]]
    assert searched(costs, first, last)[tuple(first)] == pytest.approx(CELLS - 1)
    assert searched(costs, last, first)[tuple(last)] == pytest.approx(CELLS - 1)


def test_a_goal_beyond_the_square_costs_the_straight_way_to_it():
    """From the nearest cell of the edge it is as far as the goal, over ground of a known cost."""
    costs = np.ones((CELLS, CELLS), dtype=np.float32)
    found = searched(costs, (16, 16), (16, CELLS + 9), unknown=1.5)
    assert found[16, CELLS - 1] == pytest.approx(15.0)
    assert found[16, 16] == pytest.approx(15.0 + 15.0)


def test_the_search_ends_a_margin_behind_the_robot():
    """What certainly costs more than the robot's way and the margin is not visited."""
    costs = np.ones((CELLS, CELLS), dtype=np.float32)
    found = searched(costs, (4, 16), (1, 16), margin=4.0)
    assert found[4, 16] == pytest.approx(3.0)
    assert np.isinf(found[28, 16])


def test_a_queue_whose_entries_are_used_up_goes_on():
    """With hardly more entries than cells those that are passed over make space."""
    costs = np.random.default_rng(2).uniform(1.0, 30.0, (CELLS, CELLS)).astype(np.float32)
    last = np.array([60, 12])  # Beyond: all cells of the edge wait first.
    found, used = [], []
    for count in (CELLS**2 + 8, 8 * CELLS**2):
        entries = {name: np.zeros(count, dtype=np.int32) for name in ("cells", "after")}
        around = search_from((3, 4), costs)
        around = around._replace(queue=around.queue._replace(**entries))
        search(around, last, 1e6)
        found.append(around.cost_to_go)
        used.append(around.queue.numbers[1])
    assert used[1] > CELLS**2 + 8
    np.testing.assert_array_equal(*found)


@pytest.mark.parametrize("seed", range(3))
def test_a_search_goes_on_for_single_cells_up_to_a_limit(seed):
    """A cell's cost is then exact if it is below the limit, and above it if not."""
    rng = np.random.default_rng(seed)
    costs = rng.uniform(1.0, 5.0, (CELLS, CELLS)).astype(np.float32)
    first, last = np.array([16, 16]), np.array([2, 20])
    exact = searched(costs, first, last)
    around = search_from(first, costs)
    search(around, last, 0.0)
    limit = 1.3 * exact[16, 16]
    for i, j in rng.integers(0, CELLS, (200, 2)):
        settle(around, (i, j), limit, 1e6)
        found = around.cost_to_go[i, j]
        assert found == exact[i, j] if exact[i, j] <= limit else found > limit
    assert np.isinf(around.cost_to_go).any()


def test_no_search_goes_on_beyond_the_margin():
    """What costs more than the robot's way and the margin stays unknown."""
    costs = np.ones((CELLS, CELLS), dtype=np.float32)
    around = search_from((4, 16), costs)
    search(around, np.array([1, 16]), 0.0)
    assert np.isinf(around.cost_to_go[8, 16])
    settle(around, (8, 16), np.inf, 10.0)
    assert around.cost_to_go[8, 16] == pytest.approx(7.0)
    settle(around, (28, 16), np.inf, 10.0)
    assert np.isinf(around.cost_to_go[28, 16])
