"""The path of a plan leads over free cells from the robot to the goal."""

import numpy as np

from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.planning.map_layers import map_layers
from andabata.navigation.planning.plan_path import path_of
from tests.support.planned_drives import wall_ranges
from tests.support.situations import GRID, ORIGIN, odds_of

CELL = 0.2


def planned(ranges, goal):
    """Return a planner that has seen ranges around the origin and planned to a goal."""
    planner = LocalPlanner(GRID)
    for _ in range(12):
        planner.occupancy.update(odds_of(ranges), ORIGIN, 0.0)
    planner.subgoal(ORIGIN, np.array(goal))
    return planner


def test_a_path_leads_around_a_wall_to_the_goal():
    """It goes from cell to cell, past the wall's end, and never through an obstacle."""
    planner = planned(wall_ranges(), (8.0, 0.0))
    path = path_of(planner.plan, ORIGIN)
    np.testing.assert_array_equal(path[[0, -1]], [[0.0, 0.0], [8.0, 0.0]])
    steps = np.hypot(*np.diff(path, axis=0).T)
    assert steps.max() <= CELL * 2
    assert np.abs(path[:, 1]).max() > 4.0
    found = map_layers(planner)
    cells = np.floor((path - found.corner) / CELL).astype(int)
    occupancy = np.nan_to_num(found.layers["occupancy"][tuple(cells.T)])
    assert occupancy.max() < found.lethal_occupancy


def test_a_path_to_a_goal_beyond_the_square_ends_there():
    """The last piece leads straight from the square's edge."""
    path = path_of(planned(np.inf, (60.0, 0.0)).plan, ORIGIN)
    np.testing.assert_array_equal(path[-1], [60.0, 0.0])
    assert 20.0 < path[-2, 0] < 26.0
    assert np.abs(path[:, 1]).max() < 1.0


def test_without_a_plan_there_is_no_path():
    """Before the first plan, and far from the last one, there are no places."""
    assert path_of(LocalPlanner(GRID).plan, ORIGIN).shape == (0, 2)
    far = np.array([90.0, 0.0])
    assert path_of(planned(np.inf, (8.0, 0.0)).plan, far).shape == (0, 2)


def test_a_goal_in_the_robots_own_cell_is_two_places():
    """The robot and the goal."""
    path = path_of(planned(np.inf, (0.15, 0.1)).plan, np.array([0.05, 0.05]))
    np.testing.assert_array_equal(path, [[0.05, 0.05], [0.15, 0.1]])
