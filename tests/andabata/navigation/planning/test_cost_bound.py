"""Bound of a way's cost: never above it, and as much as it on the ways that are easy to see."""

import numpy as np
import pytest

from andabata.navigation.planning.cost_bound import SIDES, bound_of, least_cost, surround
from andabata.navigation.planning.cost_to_go import search, search_for

CELLS = 32


def bounds(costs, first, unknown):
    """Return the bound of each cell, shape (n, n)."""
    octagon, robot = np.zeros(SIDES, dtype=np.int64), np.array(first)
    surround(costs, unknown, robot, octagon)
    bound = bound_of(robot, octagon, unknown)
    n = len(costs)
    return np.array([[least_cost(bound, i, j) for j in range(n)] for i in range(n)])


def patchy(seed, unknown):
    """Return costs with a patch of cheap and dear cells in unknown ground."""
    rng = np.random.default_rng(seed)
    costs = np.full((CELLS, CELLS), unknown, dtype=np.float32)
    (a, b), (c, d) = np.sort(rng.integers(0, CELLS, (2, 2)), axis=1)
    costs[a : b + 1, c : d + 1] = rng.uniform(1.0, 2.0 * unknown, (b - a + 1, d - c + 1))
    return costs, rng.integers(0, CELLS, 2)


@pytest.mark.parametrize("seed", range(6))
def test_no_bound_exceeds_the_cost_of_the_way(seed):
    """Neither where the robot stands in the patch nor where it stands beside it."""
    costs, first = patchy(seed, 1.5)
    around = search_for(costs, np.empty_like(costs), float(costs.max()), 1.5)
    search(around, first, 1e6)
    found = bounds(costs, first, 1.5)
    assert (found <= around.cost_to_go).all()
    assert found[tuple(first)] == 0.0


@pytest.mark.parametrize("seed", range(6))
def test_bounds_of_neighbours_differ_by_no_more_than_a_step_costs(seed):
    """So that a cell is seldom taken before the cost of its way is exact."""
    costs, first = patchy(seed, 1.5)
    found = bounds(costs, first, 1.5)
    for (p, q), length in {(0, 1): 1.0, (1, 0): 1.0, (1, 1): 2**0.5, (1, -1): 2**0.5}.items():
        low, high = max(-q, 0), CELLS - max(q, 0)
        here, there = (
            (slice(0, CELLS - p), slice(low, high)),
            (slice(p, None), slice(low + q, high + q)),
        )
        step = length * (costs[here] + costs[there]) / 2
        assert (np.abs(found[here] - found[there]) <= step + 1e-5).all()


def test_unknown_ground_counts_with_its_cost():
    """Straight ahead, beyond what is known and one cell more, the bound is the cost of the way."""
    costs = np.full((CELLS, CELLS), 3.0, dtype=np.float32)
    costs[4:9, 6:11] = 1.0
    found = bounds(costs, (6, 8), 3.0)
    assert found[6, 8 + 3] == pytest.approx(3.0)
    assert found[6, 8 + 13] == pytest.approx(13.0 + 2.0 * 10.0)
    assert found[6 + 3 + 10, 8 + 3 + 10] > np.hypot(13, 13) + 2.0 * 13.0
