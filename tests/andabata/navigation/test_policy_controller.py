"""Policy controller: named observations of a situation in, a twist of named actions out."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.navigation.policy_controller import PolicyController, observation_of, twist_of
from rl.policies.point_set import PointSetPolicy
from rl.spaces import (
    ActionSpec,
    ObservationSpec,
    ObservationTerm,
    steering_actions,
    steering_observations,
    steering_points,
)
from tests.support.situations import GRID, scan_of, situation
from traversability.virtual_scan import VirtualScan

PAPER = steering_observations(32, 10.0, 0.5)
BOTH = ActionSpec(
    names=("linear", "angular"), low=(0.0, -0.5), high=(0.6, 0.5), units=("m/s", "rad/s")
)


class StubPolicy:
    """Policy that returns fixed actions and keeps its observations."""

    def __init__(self, observations=PAPER, actions=None, values=(0.25,)):
        self.observations = observations
        self.actions = actions or steering_actions(0.5)
        self.values, self.seen, self.resets = np.array(values), [], 0
        self.info = {}

    def reset(self):
        self.resets += 1

    def act(self, observation):
        self.seen.append(observation)
        return self.values


def seen():
    """Return a situation whose parts all differ; free and unknown ranges are the largest."""
    ranges = np.linspace(1.0, 4.1, 32)
    ranges[[3, 7]] = np.inf, np.nan
    return situation(scan_of(ranges), heading_error=-0.7, previous_steering=(0.2, -0.4))


def test_the_observation_is_the_papers_state():
    """Ranges with free ones at the largest, two previous actions newest first, heading error."""
    given = seen()
    ranges = given.scan.ranges.copy()
    ranges[[3, 7]] = 10.0
    expected = np.float32([*ranges, 0.2, -0.4, -0.7])
    np.testing.assert_array_equal(observation_of(PAPER, given), expected)
    assert observation_of(PAPER, given).dtype == np.float32


def test_the_observation_shows_the_planners_ranges():
    """The policy is given ``scan``, which ends at remembered obstacles, not ``perceived``."""
    given = situation(scan_of(2.0), perceived=scan_of(9.0))
    assert (observation_of(PAPER, given)[:32] == 2.0).all()


def test_parts_stand_in_the_policys_own_order():
    """A policy with the terms in another order gets them in that order."""
    turned = ObservationSpec(terms=PAPER.terms[::-1])
    values, given = observation_of(PAPER, seen()), observation_of(turned, seen())
    np.testing.assert_array_equal(given, np.concatenate([values[34:], values[32:34], values[:32]]))


@pytest.mark.parametrize(
    ("actions", "values", "expected"),
    [
        (steering_actions(0.5), [0.25], Twist(0.3, 0.25)),
        (BOTH, [0.55, -0.2], Twist(0.55, -0.2)),
        (
            ActionSpec(names=("linear",), low=(0.0,), high=(1.0,), units=("m/s",)),
            [0.1],
            Twist(0.1, 0.0),
        ),
    ],
)
def test_a_twist_takes_actions_by_name(actions, values, expected):
    """``angular`` is the yaw rate, ``linear`` the speed; without it the cruise speed is driven."""
    assert twist_of(actions, np.array(values), 0.3) == expected


def test_as_many_actions_as_names_are_needed():
    """Actions that do not fit their names are an error."""
    with pytest.raises(ValueError, match="zip"):
        twist_of(BOTH, np.array([0.1]), 0.3)


def test_the_controller_drives_what_its_policy_says():
    """The policy sees the observation of the situation; its speed and yaw rate are driven."""
    policy = StubPolicy(actions=BOTH, values=(0.5, -0.3))
    assert PolicyController(policy, 0.3).act(seen()) == Twist(0.5, -0.3)
    np.testing.assert_array_equal(policy.seen[0], observation_of(PAPER, seen()))
    assert PolicyController(StubPolicy(), 0.4).act(seen()) == Twist(0.4, 0.25)


def test_a_reset_reaches_the_policy():
    """A recurrent policy forgets the last drive."""
    policy = StubPolicy()
    PolicyController(policy, 0.3).reset()
    assert policy.resets == 1


def test_unknown_observations_are_refused():
    """A policy that needs what a robot does not have is refused by the names of its terms."""
    crop = ObservationTerm(name="map_crop", shape=(2,), low=0.0, high=1.0, unit="1")
    policy = StubPolicy(ObservationSpec(terms=(*PAPER.terms, crop)))
    with pytest.raises(ValueError, match=r"expected observations ranges.*got \['map_crop'\]"):
        PolicyController(policy, 0.3)


def test_another_largest_range_is_refused():
    """Ranges mean what they meant in training, or the drive does not begin."""
    policy = StubPolicy(steering_observations(GRID.n_sectors, 8.0, 0.5))
    with pytest.raises(ValueError, match=r"outer_radius: expected 8.0 m.*got 10.0 m"):
        PolicyController(policy, 0.3).act(seen())


def test_a_policy_without_ranges_takes_any_scan():
    """The largest range matters to those policies alone that see ranges."""
    policy = StubPolicy(ObservationSpec(terms=(PAPER.term("heading_error"),)))
    PolicyController(policy, 0.3).act(seen())
    assert policy.seen[0] == pytest.approx([-0.7])


def test_points_are_where_the_scan_ends():
    """Free sectors end at the largest range, and unknown ones are masked."""
    given = seen()
    spec = steering_points(32, 10.0, 0.5)
    observation = observation_of(spec, given)
    points = observation[spec.slice_of("points")].reshape(32, 2)
    mask = observation[spec.slice_of("mask")]
    assert mask[7] == 0
    assert mask.sum() == 31
    assert np.hypot(*points[3]) == pytest.approx(0.1)
    assert np.hypot(*points[0]) == pytest.approx(1.0)


def test_a_policy_of_points_takes_any_number_of_sectors():
    """Trained with 32 sectors it drives with 64, and a policy of a fixed vector does not."""
    wide = VirtualScan(np.linspace(1.0, 4.0, 64, dtype=np.float32), 10.0)
    rng = np.random.default_rng(0)
    shapes = {"point": (8, 2), "gate": (8, 3), "feature": (4, 8), "layer0": (2, 7)}
    weights = {f"{name}.weight": rng.normal(size=shape) for name, shape in shapes.items()}
    weights |= {f"{name}.bias": rng.normal(size=shape[0]) for name, shape in shapes.items()}
    weights = {name: value.astype(np.float32) for name, value in weights.items()}
    spaces = steering_points(32, 10.0, 0.5), steering_actions(0.5)
    policy = PointSetPolicy(weights, *spaces, terms=("previous_actions", "heading_error"))
    controller = PolicyController(policy, 0.3)
    few = controller.act(seen()).angular
    many = controller.act(situation(wide)).angular
    assert few != many
    assert controller.act(seen()).angular == few
    with pytest.raises(ValueError, match="ranges"):
        PolicyController(StubPolicy(), 0.3).act(situation(wide))
