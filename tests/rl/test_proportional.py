"""The proportional controller: the printed law, in both forms of the goal."""

import numpy as np
import pytest

from rl.policy import policy_from_bytes
from rl.proportional import ProportionalPolicy
from rl.spaces import ObservationSpec, ObservationTerm
from tests.known_environments import TARGETS, TWO_ACTIONS
from tests.point_sets import ACTIONS, point_observations

SPACE = point_observations(4)
POLAR = ObservationSpec(
    terms=(ObservationTerm(name="goal", shape=(2,), low=-9.0, high=9.0, unit=""),)
)


def seen(x, y):
    """Return the observation of a goal at (x, y) in the robot frame, x ahead."""
    distance, bearing = np.hypot(x, y), np.arctan2(y, x)
    one = np.zeros(SPACE.size, np.float32)
    one[SPACE.slice_of("goal")] = distance / 5, np.cos(bearing), np.sin(bearing)
    return one, np.array([distance, bearing], np.float32)


@pytest.mark.parametrize(
    ("x", "y", "v", "w"),
    [
        (3.0, 0.0, 0.5, 0.0),
        (0.02, 0.4, 0.2, 0.4),
        (0.02, -0.4, 0.2, -0.4),
        (-2.0, 0.5, 0.0, 0.5),
        (1.0, 4.0, 0.5, np.pi / 3),
        (1.0, -4.0, 0.5, -np.pi / 3),
    ],
)
def test_it_is_the_printed_law(x, y, v, w):
    """v = clip(10 x, 0, 0.5) and w = clip(y, -pi/3, pi/3), x ahead and y to the left."""
    for space, one in zip((SPACE, POLAR), seen(x, y), strict=True):
        policy = ProportionalPolicy({}, space, ACTIONS)
        np.testing.assert_allclose(policy.act(one), [v, w], atol=1e-6)
        shares = policy.best(one)
        np.testing.assert_allclose(ACTIONS.scaled(shares), [v, w], atol=1e-6)
        assert np.abs(shares).max() <= 1
        rng = np.random.default_rng(0)
        np.testing.assert_array_equal(policy.explore(one, rng), shares)
        assert rng.random() == np.random.default_rng(0).random()


def test_many_rows_are_single_calls():
    """Rows together are the rows alone."""
    policy = ProportionalPolicy({}, SPACE, ACTIONS)
    rows = np.array([seen(*xy)[0] for xy in np.random.default_rng(0).uniform(-5, 5, (20, 2))])
    expected = [policy.best(row) for row in rows]
    np.testing.assert_array_equal(policy.best_many(rows), expected)
    np.testing.assert_array_equal(policy.explore_many(rows, [None] * 20), expected)


def test_the_file_comes_back():
    """The law survives its file."""
    policy = ProportionalPolicy({}, SPACE, ACTIONS, {"name": "baseline"})
    assert policy_from_bytes(policy.to_bytes()) == policy


def test_what_it_cannot_read_is_refused():
    """A space without a goal, weights, NaN and another length are errors."""
    with pytest.raises(ValueError, match="expected a term 'goal' of 2 or 3 values"):
        ProportionalPolicy({}, TARGETS, TWO_ACTIONS)
    with pytest.raises(ValueError, match="weights: expected none"):
        ProportionalPolicy({"a": np.zeros(1, np.float32)}, SPACE, ACTIONS)
    policy = ProportionalPolicy({}, POLAR, ACTIONS)
    for bad in (np.zeros(3), np.array([np.nan, 0.0])):
        with pytest.raises(ValueError, match="observation: expected finite numbers"):
            policy.act(bad.astype(np.float32))
