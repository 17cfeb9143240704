"""Shortest paths and cost-to-go on clearance maps with known answers."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from worlds.paths import cost_to_go, shortest_path

CELL = 0.1


def clearance_of(free):
    """Return the clearance of a map of free cells [m]."""
    return (distance_transform_edt(free) * CELL).astype(np.float32)


def length_of(path):
    """Return a path's length [cells]."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


OPEN = np.full((300, 300), 10.0, dtype=np.float32)


@pytest.mark.parametrize("goal", [(250.0, 50.0), (50.0, 250.0), (250.0, 250.0), (250.0, 120.0)])
def test_on_an_empty_map_the_path_is_the_straight_line(goal):
    """In any direction: start, goal and nothing between."""
    start = np.array([50.0, 50.0])
    path = shortest_path(OPEN, CELL, start, np.array(goal), 0.5)
    np.testing.assert_array_equal(path, [start, goal])


def wall_with_gaps(*gaps):
    """Return free cells with a wall across x = 150 and gaps (first, last) along y."""
    free = np.ones((300, 300), dtype=bool)
    free[148:152] = False
    for first, last in gaps:
        free[148:152, first:last] = True
    return free


def test_a_path_leads_through_the_gap_and_keeps_its_clearance():
    """The path is little longer than the two straight lines through the gap's middle."""
    clearance = clearance_of(wall_with_gaps((200, 230)))
    start, goal = np.array([50.0, 100.0]), np.array([250.0, 100.0])
    path = shortest_path(clearance, CELL, start, goal, 0.5)
    assert 2 * np.hypot(100, 105) < length_of(path) < 1.03 * 2 * np.hypot(100, 115)
    for a, b in pairwise(path):
        cells = (a + np.linspace(0, 1, 500)[:, None] * (b - a)).astype(int)
        assert clearance[tuple(cells.T)].min() > 0.5 - 0.15


def test_a_gap_narrower_than_twice_the_clearance_is_closed():
    """A detour is taken instead; without one there is no path."""
    start, goal = np.array([50.0, 100.0]), np.array([250.0, 100.0])
    narrow = clearance_of(wall_with_gaps((96, 104)))
    assert shortest_path(narrow, CELL, start, goal, 0.5) is None
    detour = clearance_of(wall_with_gaps((96, 104), (200, 230)))
    assert length_of(shortest_path(detour, CELL, start, goal, 0.5)) > 2 * np.hypot(100, 105)
    assert length_of(shortest_path(detour, CELL, start, goal, 0.15)) < 210


def test_corners_are_at_the_centres_of_nodes():
    """Through a gap of one node the path goes through its middle."""
    clearance = clearance_of(wall_with_gaps((198, 201)))
    path = shortest_path(clearance, CELL, np.array([50.0, 100.0]), np.array([250.0, 100.0]), 0.15)
    inside = path[np.abs(path[:, 0] - 150.0) < 3.0]
    assert len(inside)
    np.testing.assert_allclose(inside[:, 1], 199.5)


def test_a_little_detour_is_taken_for_more_clearance():
    """Of two corridors the wide one is taken, though it is somewhat further."""
    free = np.ones((300, 300), dtype=bool)
    free[60:240] = False
    free[60:240, 140:152] = True
    start, goal = np.array([30.0, 155.0]), np.array([270.0, 155.0])
    path = shortest_path(clearance_of(free), CELL, start, goal, 0.5)
    assert path[:, 1].min() < 152.0
    free[60:240, 170:200] = True
    path = shortest_path(clearance_of(free), CELL, start, goal, 0.5)
    assert path[:, 1].max() > 170.0


def test_a_start_inside_of_an_obstacle_has_no_path():
    """A start or goal more than a metre from enough clearance is refused."""
    free = np.ones((300, 300), dtype=bool)
    free[80:120, 80:120] = False
    inside, outside = np.array([100.0, 100.0]), np.array([250.0, 250.0])
    assert shortest_path(clearance_of(free), CELL, inside, outside, 0.5) is None
    assert shortest_path(clearance_of(free), CELL, outside, inside, 0.5) is None


def at(costs, factor, x, y):
    """Return the cost of the node at cell coordinates."""
    return costs[int(x / factor), int(y / factor)]


def test_the_cost_to_go_on_an_empty_map_is_the_distance_on_eight_neighbours():
    """Along an axis and along a diagonal it is the Euclidean distance, nowhere less."""
    costs, factor = cost_to_go(OPEN, CELL, np.array([151.0, 151.0]), 0.5, 1.0)
    assert at(costs, factor, 151, 151) == 0.0
    assert at(costs, factor, 271, 151) == pytest.approx(12.0)
    assert at(costs, factor, 151, 31) == pytest.approx(12.0)
    assert at(costs, factor, 31, 271) == pytest.approx(12.0 * np.sqrt(2))
    assert at(costs, factor, 271, 211) == pytest.approx(6 + 6 * np.sqrt(2))


def test_a_metre_with_little_clearance_costs_more():
    """The weight is per metre of missing clearance; a tight place costs 50 more."""
    goal = np.array([151.0, 151.0])
    for clearance, minimum, weight, expected in (
        (0.6, 0.5, 0.0, 1.0),
        (0.6, 0.5, 2.0, 1.8),
        (0.6, 0.7, 2.0, 51.8),
        (2.0, 0.5, 2.0, 1.0),
    ):
        field = np.full((300, 300), clearance, dtype=np.float32)
        costs, factor = cost_to_go(field, CELL, goal, minimum, weight)
        assert at(costs, factor, 181, 151) == pytest.approx(3.0 * expected)


def test_behind_a_closed_wall_the_cost_is_infinite():
    """There is no path through a wall without a gap, nor to a goal inside of an obstacle."""
    clearance = clearance_of(wall_with_gaps())
    costs, factor = cost_to_go(clearance, CELL, np.array([50.0, 50.0]), 0.5, 1.0)
    assert np.isfinite(at(costs, factor, 100, 250))
    assert np.isinf(at(costs, factor, 250, 50))
    blocked = np.zeros((300, 300), dtype=np.float32)
    assert np.isinf(cost_to_go(blocked, CELL, np.array([50.0, 50.0]), 0.5, 1.0)[0]).all()
