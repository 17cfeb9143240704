"""The state vector and the dead zone."""

import numpy as np
import pytest

from andabata.machine.kinematics import apply_dead_zone
from rl.spaces import MIDDLE_RANGE, ObservationLayout, observation


def test_the_papers_order():
    state = observation(np.arange(32.0), (0.3, -0.2), 1.5)
    assert state.dtype == np.float32
    np.testing.assert_allclose(state[:32], np.arange(32))
    np.testing.assert_allclose(state[32:], [0.3, -0.2, 1.5])


def test_bounds_hold_every_state():
    low, high = ObservationLayout().bounds(10.0, 0.5)
    state = observation(np.full(32, 10.0), (0.5, -0.5), np.pi)
    assert len(low) == ObservationLayout().size == 35
    assert ((low <= state) & (state <= high)).all()


def scaled(state):
    a, b, c, d = ObservationLayout().scale(0.5)
    return (a + b * state) / (c + d * state)


def test_scaled_states_lie_between_minus_one_and_one():
    for state in ObservationLayout().bounds(10.0, 0.5):
        x = scaled(state)
        assert (np.abs(x) <= 1.0 + 1e-6).all()
        np.testing.assert_allclose(np.abs(x[32:]), 1.0, rtol=1e-6)


def test_near_ranges_are_told_apart_better_than_far_ones():
    ranges = np.array([0.0, MIDDLE_RANGE, 0.5, 1.0, 9.0, 9.5])
    x = scaled(observation(np.resize(ranges, 32), (0.0, 0.0), 0.0))
    assert x[0] == 1.0
    assert x[1] == 0.0
    assert x[2] - x[3] > 10 * (x[4] - x[5]) > 0


@pytest.mark.parametrize(
    ("action", "executed"), [(0.0, 0.0), (0.149, 0.0), (-0.149, 0.0), (0.15, 0.15), (-0.4, -0.4)]
)
def test_the_dead_zone(action, executed):
    assert apply_dead_zone(action, 0.15) == executed
