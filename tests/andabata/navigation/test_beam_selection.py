"""Beams that go into a cloud."""

import numpy as np
import pytest

from andabata.navigation.beam_selection import RangeLimits, is_hidden, useful_beams

LIMITS = RangeLimits(max_range=10.0, body_radius=0.5, dense_range=2.0, dense_stride=1)
LEVEL = np.array([[[1.0] * 4, [0.0] * 4]])
"""Sine and cosine of the elevation of four level beams."""


def test_beams_out_of_range_and_on_the_robot_are_left_out():
    """Ranges of 10 m, 0.5 m and none are not kept, those between are."""
    ranges = np.array([[0.5, 0.6, 9.9, 10.0], [np.inf, 3.0, 0.4, 5.0]], dtype=np.float32)
    assert useful_beams(ranges, LEVEL, LIMITS).tolist() == [1, 2, 5, 7]


def test_a_beam_along_the_axis_is_on_the_robot():
    """The distance from the axis counts, not the range."""
    tilts = np.array([[[0.1, 1.0], [0.99, 0.0]]])
    assert useful_beams(np.float32([[4.0, 4.0]]), tilts, LIMITS).tolist() == [1]


def test_near_beams_are_thinned():
    """Of those nearer than 2 m every second is kept."""
    ranges = np.float32([[1.0, 1.0, 1.0, 3.0]])
    assert useful_beams(ranges, LEVEL, LIMITS._replace(dense_stride=2)).tolist() == [0, 2, 3]


@pytest.mark.parametrize(
    ("sector", "hidden"), [((170, 190), [180, -175]), ((-10, 10), [0]), ((0, 360), [0, 90, -175])]
)
def test_bearings_in_a_blind_sector_are_hidden(sector, hidden):
    """Its bounds may pass 180 degrees, and be all around."""
    bearings = np.array([0.0, 90.0, 180.0, -175.0])
    found = is_hidden(np.deg2rad(bearings), (sector,))
    assert set(hidden) <= set(bearings[found])
    assert found.sum() == len(hidden) or sector == (0, 360)
