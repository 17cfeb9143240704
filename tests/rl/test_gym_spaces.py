"""Gymnasium's spaces: observations in SI units, actions as shares."""

import numpy as np

from rl.gym_spaces import action_box, observation_box
from rl.spaces import steering_observations
from tests.support.known_environments import TWO_ACTIONS


def test_the_observation_box_has_the_bounds_of_the_spec():
    """Low and high of the box are the spec's, float32."""
    spec = steering_observations(32, 10.0, 0.5)
    box = observation_box(spec)
    low, high = spec.bounds()
    np.testing.assert_array_equal(box.low, low)
    np.testing.assert_array_equal(box.high, high)
    assert box.dtype == np.float32


def test_the_action_box_is_of_shares():
    """Each action is a share from -1 to 1, whatever its SI bounds."""
    box = action_box(TWO_ACTIONS)
    assert box.shape == (2,)
    assert (box.low == -1).all()
    assert (box.high == 1).all()
    assert box.dtype == np.float32
