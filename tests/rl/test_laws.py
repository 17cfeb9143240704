"""All laws: rows are single calls, files come back, and the null controllers are among them."""

import numpy as np
import pytest

from rl.laws import LAWS, NULL_LAWS
from rl.policy import policy_from_bytes
from tests.support.point_sets import ACTIONS, point_observations

SPACE = point_observations(4)
KNOWN = {
    "bearings": np.linspace(-3.0, 3.0, 36, dtype=np.float32),
    "radius": np.array([0.2], dtype=np.float32),
}


def made(law, info=None):
    """Return a law of a robot of 0.2 m."""
    constants = {name: KNOWN[name] for name in law.constants}
    return law(constants, SPACE, ACTIONS, info or {})


@pytest.mark.parametrize("law", LAWS.values())
def test_many_rows_are_single_calls(law):
    """Rows together are the rows alone, exploring too."""
    policy, rng = made(law), np.random.default_rng(0)
    rows = rng.uniform(0.2, 1.0, (20, SPACE.size)).astype(np.float32)
    expected = [policy.best(row) for row in rows]
    np.testing.assert_array_equal(policy.best_many(rows), expected)
    np.testing.assert_array_equal(policy.explore_many(rows, [None] * 20), expected)


@pytest.mark.parametrize("law", LAWS.values())
def test_the_file_comes_back(law):
    """A law survives its file, with what it knows of its robot."""
    policy = made(law, {"name": "baseline"})
    again = policy_from_bytes(policy.to_bytes())
    assert (type(again), again.info, again.terms) == (law, policy.info, policy.terms)
    assert again.to_bytes() == policy.to_bytes()


def test_null_controllers_are_laws_of_which_one_sees():
    """Noise, full speed ahead, the opposite, the goal's law, and the law that sees, each once."""
    assert set(NULL_LAWS) <= set(LAWS)
    assert len(set(NULL_LAWS)) == len(NULL_LAWS)
    assert {"random", "ahead", "heading", "sees"} <= set(NULL_LAWS)
