"""Policies with a tanh at their end: shares, units, and observations of another space."""

import math

import numpy as np
import pytest

from rl.policies.squashed import SquashedPolicy
from rl.spaces import steering_actions, steering_observations

OBSERVATIONS, ACTIONS = steering_observations(4, 10.0, 0.5), steering_actions(0.5)


class Doubled(SquashedPolicy):
    """Policy whose outputs are twice its first numbers, and one more column."""

    architecture = "doubled"
    observations, actions = OBSERVATIONS, ACTIONS

    def __init__(self):
        self.weights = {"factor": np.float32([2.0])}

    def _outputs(self, observations):
        assert observations.flags.c_contiguous
        return 2 * observations[:, : ACTIONS.size + 1]

    def explore_many(self, observations, rngs):
        best = self.best_many(observations)
        return best + [[rng.normal()] * ACTIONS.size for rng in rngs]


def rows(n=3):
    return np.random.default_rng(0).uniform(-1, 1, (n, OBSERVATIONS.size)).astype(np.float32)


def test_best_actions_are_the_tanh_of_the_first_columns():
    """To the last bit that of ``math.tanh``, for one robot as for many, whatever the layout."""
    policy, many = Doubled(), rows()
    expected = [[math.tanh(2 * float(x)) for x in row[: ACTIONS.size]] for row in many]
    np.testing.assert_array_equal(policy.best_many(many), expected)
    np.testing.assert_array_equal(policy.best_many(np.asfortranarray(many)), expected)
    for row, best in zip(many, expected, strict=True):
        np.testing.assert_array_equal(policy.best(row), best)


def test_an_action_is_the_best_share_in_si_units():
    """The share of the actions' space."""
    policy, row = Doubled(), rows()[0]
    np.testing.assert_array_equal(policy.act(row), ACTIONS.scaled(policy.best(row)))
    assert policy.act(row)[0] == pytest.approx(0.5 * math.tanh(2 * row[0]))


def test_exploring_takes_the_generator_that_is_given():
    """One robot explores as it does among several."""
    policy, row = Doubled(), rows()[0]
    alone = policy.explore(row, np.random.default_rng(3))
    expected = policy.best(row) + np.random.default_rng(3).normal()
    np.testing.assert_array_equal(alone, expected)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_observations_of_another_space_are_refused(wrong):
    """Another length, and numbers that are not finite."""
    policy, row = Doubled(), rows()[0]
    with pytest.raises(ValueError, match=rf"expected shape \({OBSERVATIONS.size},\), got \(3,\)"):
        policy.act(row[:3])
    row[1] = wrong
    with pytest.raises(ValueError, match="expected finite numbers, got NaN or infinity"):
        policy.act(row)


def test_tensors_are_a_dictionary_of_its_own():
    """A file's writer may add to it."""
    policy = Doubled()
    policy.tensors()["more"] = np.zeros(1)
    assert list(policy.weights) == ["factor"]
