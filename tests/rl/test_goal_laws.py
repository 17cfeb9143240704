"""Laws that read the goal alone: the printed one, the slowed one and the null controllers."""

import numpy as np
import pytest

from rl.goal_laws import AheadPolicy, AwayPolicy, HeadingPolicy, ProportionalPolicy, RandomPolicy
from rl.spaces import ActionSpec, ObservationSpec, ObservationTerm
from tests.support.known_environments import TARGETS, TWO_ACTIONS
from tests.support.point_sets import ACTIONS, point_observations

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


@pytest.mark.parametrize(
    ("x", "y", "v", "w"),
    [
        (3.0, 0.0, 0.5, 0.0),
        (2.0, 0.4, 0.5 / 1.04**2, 2.5 * np.arctan(0.2)),
        (0.03, 0.0, 0.3, 0.0),
        (1.0, -1.0, 0.125, -np.pi / 3),
        (0.0, 1.0, 0.0, np.pi / 3),
        (-2.0, -0.1, 0.0, -np.pi / 3),
    ],
)
def test_the_heading_law_slows_where_it_turns(x, y, v, w):
    """w = 2.5 a within its limits, and the speed falls with the fourth power of cos a."""
    for space, one in zip((SPACE, POLAR), seen(x, y), strict=True):
        np.testing.assert_allclose(HeadingPolicy({}, space, ACTIONS).act(one), [v, w], atol=1e-6)


def test_the_heading_law_steers_where_speed_is_no_action():
    """A robot of constant speed gets the yaw rate alone."""
    steering = ActionSpec(names=("angular",), low=(-1.0,), high=(1.0,), units=("rad/s",))
    law = HeadingPolicy({}, POLAR, steering)
    np.testing.assert_allclose(law.act(np.float32([3.0, 0.2])), [0.5], atol=1e-6)


@pytest.mark.parametrize(("y", "w"), [(0.5, -np.pi / 3), (0.0, -np.pi / 3), (-0.5, np.pi / 3)])
def test_the_opposite_turns_away_at_full_speed(y, w):
    """Wherever the goal is, it turns to the other side."""
    for x in (-1.0, 2.0):
        law = AwayPolicy({}, SPACE, ACTIONS)
        np.testing.assert_allclose(law.act(seen(x, y)[0]), [0.5, w])


@pytest.mark.parametrize("goal", [(1.0, 0.0), (-1.0, 2.0)])
def test_full_speed_ahead_does_not_look_at_the_goal(goal):
    """Wherever the goal is, it drives straight on."""
    np.testing.assert_allclose(AheadPolicy({}, SPACE, ACTIONS).act(seen(*goal)[0]), [0.5, 0.0])


def test_noise_fills_the_actions_and_comes_again():
    """The actions of many places are uniform, unlike those of the place beside, and repeatable."""
    places = np.random.default_rng(0).uniform(-5, 5, (2000, 2))
    rows = np.array([seen(*place)[0] for place in places])
    law = RandomPolicy({}, SPACE, ACTIONS)
    shares = law.best_many(rows)
    np.testing.assert_allclose(
        np.percentile(shares, [0, 25, 50, 75, 100], axis=0)[:, 0], [-1, -0.5, 0, 0.5, 1], atol=0.06
    )
    assert abs(np.corrcoef(shares.T)[0, 1]) < 0.06
    assert abs(np.corrcoef(shares[:-1, 1], shares[1:, 1])[0, 1]) < 0.06
    np.testing.assert_array_equal(RandomPolicy({}, SPACE, ACTIONS).best_many(rows), shares)


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
