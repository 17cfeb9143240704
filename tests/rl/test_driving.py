"""Tests of what trained policies drive with."""

import numpy as np
import pytest

from rl.driving import (
    DRIVING_NOISE,
    DRIVING_REPEAT,
    driven,
    driven_many,
    driving_noise,
    driving_repeat,
)
from rl.goal_laws import ProportionalPolicy
from rl.policy import policy_from_bytes, with_info
from rl.spaces import ActionSpec, ObservationSpec, ObservationTerm

GOAL = ObservationTerm(name="goal", shape=(3,), low=-1.0, high=20.0, unit="5 m, 1, 1")
OBSERVATIONS = ObservationSpec(terms=(GOAL,))
ACTIONS = ActionSpec(
    names=("linear", "angular"), low=(0.0, -1.0), high=(1.0, 1.0), units=("m/s", "rad/s")
)
LAW = ProportionalPolicy({}, OBSERVATIONS, ACTIONS)
STATES = np.array([[0.4, 1.0, 0.0], [0.1, 0.0, 1.0], [0.2, -1.0, 0.0]], dtype=np.float32)


def generators(*seeds):
    """Return a generator for each seed."""
    return [np.random.default_rng(seed) for seed in seeds]


def test_a_policy_without_noise_drives_with_its_best_actions():
    """To the bit, and it draws nothing."""
    rngs = generators(1, 2, 3)
    np.testing.assert_array_equal(driven_many(LAW, STATES, rngs), LAW.best_many(STATES))
    np.testing.assert_array_equal(driven(LAW, STATES[0], rngs[0]), LAW.best(STATES[0]))
    assert rngs[0].random() == generators(1)[0].random()


def test_noise_has_the_spread_that_is_written_down():
    """Where no bound clips it, and with no mean; the file keeps it."""
    noisy = policy_from_bytes(with_info(LAW, {DRIVING_NOISE: 0.05}).to_bytes())
    assert driving_noise(noisy) == 0.05
    state = np.array([0.4, 0.95, 0.3], dtype=np.float32)
    turning = LAW.best(state)[1]
    assert abs(turning) < 0.8
    drawn = driven_many(noisy, np.tile(state, (4000, 1)), generators(*range(4000)))[:, 1]
    assert drawn.std() == pytest.approx(0.05, rel=0.05)
    assert drawn.mean() == pytest.approx(turning, abs=0.005)


def test_actions_stay_shares():
    """However large the noise, none leaves its bounds."""
    noisy = with_info(LAW, {DRIVING_NOISE: 1.0})
    drawn = driven_many(noisy, np.tile(STATES[0], (100, 1)), generators(*range(100)))
    assert np.abs(drawn).max() == 1.0


def test_a_robot_alone_drives_as_among_others():
    """Each draws from its own generator, in the order of its steps."""
    noisy = with_info(LAW, {DRIVING_NOISE: 0.3})
    together, alone = generators(5, 6, 7), generators(6)[0]
    for _ in range(3):
        many = driven_many(noisy, STATES, together)
        np.testing.assert_array_equal(driven(noisy, STATES[1], alone), many[1])


def test_a_policy_says_how_long_it_holds_an_action():
    """The file keeps it; without the entry it decides in every step."""
    held = policy_from_bytes(with_info(LAW, {DRIVING_REPEAT: 5}).to_bytes())
    assert (driving_repeat(held), driving_repeat(LAW)) == (5, 1)
