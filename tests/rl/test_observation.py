"""The state vector and the dead zone."""

import numpy as np
import pytest

from rl.observation import ObservationLayout, apply_dead_zone, observation


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


def test_scaled_states_lie_between_minus_one_and_one():
    layout = ObservationLayout()
    offset, scale = layout.scale(10.0, 0.5)
    for state in layout.bounds(10.0, 0.5):
        np.testing.assert_allclose(np.abs((state - offset) * scale), 1.0, rtol=1e-6)


@pytest.mark.parametrize(
    ("action", "executed"), [(0.0, 0.0), (0.149, 0.0), (-0.149, 0.0), (0.15, 0.15), (-0.4, -0.4)]
)
def test_the_dead_zone(action, executed):
    assert apply_dead_zone(action, 0.15) == executed
