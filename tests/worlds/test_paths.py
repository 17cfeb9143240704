"""Shortest paths and cost-to-go on clearance maps with known answers."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from worlds.paths import shortest_path

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
