"""Law of the moves: a mirrored map and goal give the mirrored move, whatever was seen."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.properties import law
from tests.support.rollout_plans import planner_of, selected
from tests.support.situations import GRID

MIRROR = np.array([1.0, -1.0])


@st.composite
def situations(draw):
    """Return free distances of the sectors [m], a goal [m] and a command [rad/s]."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    ranges = np.where(rng.random(GRID.n_sectors) < 0.3, rng.uniform(1.0, 9.0), np.inf)
    angle = rng.uniform(-np.pi, np.pi)
    goal = rng.uniform(4.0, 9.0) * np.array([np.cos(angle), np.sin(angle)])
    return ranges, goal, float(rng.uniform(-0.5, 0.5))


@law
@given(situations())
def test_a_mirrored_map_gives_the_mirrored_move(situation):
    """The same speed, and the yaw rate with the other sign: no side is preferred.

    But for half a turn on the spot, which ends in the same heading on either side.
    """
    ranges, goal, rate = situation
    move = selected(planner_of(ranges, goal), rate)
    mirrored = selected(planner_of(ranges[::-1], goal * MIRROR), -rate)
    assert mirrored.linear == pytest.approx(move.linear, abs=1e-6)
    if move.linear == 0.0:
        assert abs(mirrored.angular) == pytest.approx(abs(move.angular), abs=1e-6)
    else:
        assert mirrored.angular == pytest.approx(-move.angular, abs=1e-6)
