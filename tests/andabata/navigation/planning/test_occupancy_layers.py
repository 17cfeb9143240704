"""Updates of an occupancy grid by ground layer, driving and low obstacles, of known result."""

import numpy as np
import pytest

from andabata.navigation.planning.occupancy_layers import (
    LowObstacles,
    Stance,
    add_low_obstacles,
    drive_over,
    take_ground,
    vacate,
)

MOST = 3.0


def grid(values=()):
    """Return log odds by cells, 0 elsewhere."""
    found = np.zeros((64, 64), dtype=np.float32)
    for cell, value in values:
        found[cell] = value
    return found


def test_ground_is_written_over_all_but_driven_ground():
    """Scaled, and bounded; what the layer does not know stays."""
    log_odds = grid([((1, 1), 2.0), ((2, 2), -5.0), ((3, 3), -0.5), ((4, 4), 1.0)])
    ground = grid([((1, 1), -1.0), ((2, 2), 4.0), ((3, 3), 9.0), ((5, 5), -9.0)])
    take_ground(log_odds, ground, 0.5, MOST, 0.0)
    expected = grid([((1, 1), -0.5), ((2, 2), -5.0), ((3, 3), 3.0), ((4, 4), 1.0)])
    expected[5, 5] = -0.7 * MOST
    np.testing.assert_array_equal(log_odds, expected)


def test_driven_ground_fades_until_the_ground_layer_counts():
    """A step brings it nearer to other ground; what is none any more is overwritten at once."""
    log_odds = grid([((1, 1), -4.0), ((2, 2), -3.0), ((3, 3), -3.0), ((4, 4), -2.9)])
    take_ground(log_odds, grid([((1, 1), 2.0), ((2, 2), 2.0)]), 1.0, MOST, 0.5)
    expected = grid([((1, 1), -3.5), ((2, 2), 2.0), ((3, 3), -2.5), ((4, 4), -2.9)])
    np.testing.assert_array_equal(log_odds, expected)


def test_places_that_were_left_are_no_obstacles():
    """Free ones stay as free; beyond the window nothing changes, and memory wraps around."""
    log_odds = grid([((1, 63), 2.0), ((2, 63), -2.0), ((3, 63), 2.0)])
    places = np.array([(0.3, -0.1), (0.5, -0.1), (0.7 + 64 * 0.2, -0.1)])
    vacate(log_odds, np.zeros(2, dtype=np.int64), places, 0.2)
    np.testing.assert_array_equal(log_odds, grid([((2, 63), -2.0), ((3, 63), 2.0)]))
    vacate(log_odds, np.array([64, 0]), places, 0.2)
    np.testing.assert_array_equal(log_odds, grid([((2, 63), -2.0)]))


def test_ground_under_the_robot_is_driven():
    """The nearer the robot's middle, the lower; what is lower stays; memory wraps around."""
    log_odds, centre = grid([((63, 0), -7.0), ((0, 0), 2.0)]), np.array([64, -64])
    drive_over(log_odds, centre, Stance(64.5, -63.5, 1.2), MOST)
    assert log_odds[0, 0] == -2.0 * MOST
    for cell in ((1, 0), (0, 1), (0, 63)):
        assert log_odds[cell] == pytest.approx(-MOST * (2.0 - 1.0 / 1.2))
    assert log_odds[63, 0] == -7.0
    assert np.count_nonzero(log_odds) == 5


@pytest.mark.parametrize("centre", [(32, 0), (-32, -64)])
def test_low_obstacles_raise_the_cells_that_they_touch_wherever_the_window_lies(centre):
    """Half cell 63, 1 lies in cell 31, 0 and touches those behind; memory wraps around."""
    heights, log_odds, middle = grid([((63, 1), 0.04)]), grid(), np.array(centre)
    low = LowObstacles(heights, 2 * middle, grid(), 14, 25.0, 2.0)
    add_low_obstacles(log_odds, middle, low, MOST)
    raised = [((i, j), 1.0) for i in (31, 32) for j in (0, 1)]
    np.testing.assert_array_equal(log_odds, grid(raised))
