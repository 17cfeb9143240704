"""Networks that price actions from crops: the compiled pass, files, and what does not fit."""

import numpy as np
import pytest
import torch

from rl.crop_actor import CropActor
from rl.policies.crop_prices import CropPricesPolicy
from rl.policy import policy_from_bytes
from rl.spaces import ActionSpec, ObservationSpec, ObservationTerm

OBSERVATIONS = ObservationSpec(
    terms=(
        ObservationTerm(name="near", shape=(3, 16, 16), low=-1, high=1, unit="1", scaling="none"),
        ObservationTerm(name="goal", shape=(2,), low=-2, high=2, unit="1"),
        ObservationTerm(name="far", shape=(2, 8, 8), low=-1, high=1, unit="1", scaling="none"),
    )
)
ACTIONS = ActionSpec(
    names=("linear", "angular"), low=(-0.3, -0.5), high=(0.6, 0.5), units=("m/s", "rad/s")
)
TABLE = np.array([[1, 0], [0, -1], [0, 1], [-1, 0]], dtype=np.float32)


@pytest.fixture(scope="module")
def actor():
    """A network with fresh weights."""
    torch.manual_seed(3)
    return CropActor(OBSERVATIONS, ACTIONS, TABLE, hidden=(24,))


def drawn(count, seed=0):
    """Return random observations, half of whose numbers are zero as in a map."""
    rng = np.random.default_rng(seed)
    seen = rng.uniform(-1, 1, (count, OBSERVATIONS.size)) * (rng.random((count, 1)) < 0.5)
    return seen.astype(np.float32)


def test_the_policy_prices_as_the_network_does(actor):
    """Compiled and in torch, to rounding."""
    policy, seen = actor.policy({}), drawn(20)
    with torch.no_grad():
        expected = actor(torch.from_numpy(seen)).numpy()
    found = np.array([policy.prices(row) for row in seen])
    np.testing.assert_allclose(found, expected, atol=1e-5)


def test_the_cheapest_action_is_driven_in_si_units(actor):
    """A bias that makes one action cheap makes it the action."""
    weights = actor.policy({}).tensors()
    for cheap, expected in ((0, [0.6, 0.0]), (3, [-0.3, 0.0]), (1, [0.15, -0.5])):
        bias = np.full(4, 100.0, dtype=np.float32)
        bias[cheap] = -100.0
        policy = CropPricesPolicy(weights | {"layer1.bias": bias}, OBSERVATIONS, ACTIONS)
        np.testing.assert_allclose(policy.act(drawn(1)[0]), expected, atol=1e-6)
        assert np.array_equal(policy.best_many(drawn(3)), np.tile(policy.best(drawn(1)[0]), (3, 1)))


def test_exploration_draws_cheap_actions_more_often(actor):
    """Odds fall by e for half a second of price."""
    weights = actor.policy({}).tensors()
    weights["layer1.weight"] = np.zeros_like(weights["layer1.weight"])
    weights["layer1.bias"] = np.array([0.0, 0.5, 50.0, 50.0], dtype=np.float32)
    policy = CropPricesPolicy(weights, OBSERVATIONS, ACTIONS)
    rng, seen = np.random.default_rng(0), drawn(1)[0]
    draws = np.array([policy.explore(seen, rng) for _ in range(2000)])
    shares = [(draws == row).all(axis=1).mean() for row in TABLE]
    assert shares[0] == pytest.approx(np.e / (1 + np.e), abs=0.04)
    assert shares[2] == shares[3] == 0.0


def test_a_file_holds_the_whole_policy(actor):
    """Written and read again it prices to the bit."""
    policy = actor.policy({"seed": 1})
    again = policy_from_bytes(policy.to_bytes())
    assert again.info == {"seed": 1}
    for row in drawn(5):
        assert np.array_equal(again.prices(row), policy.prices(row))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"near.1.weight": np.zeros((24, 15, 3, 3), np.float32)}, "near.1"),
        ({"near.0.weight": np.zeros((16, 3, 4, 4), np.float32)}, "near.0"),
        ({"layer0.weight": np.zeros((24, 5), np.float32)}, "layer0"),
        ({"actions": np.zeros((5, 2), np.float32)}, "5 prices"),
        ({"actions": np.zeros((4, 3), np.float32)}, "actions"),
    ],
)
def test_layers_that_do_not_fit_are_refused(actor, change, message):
    """By name."""
    with pytest.raises(ValueError, match=message):
        CropPricesPolicy(actor.policy({}).tensors() | change, OBSERVATIONS, ACTIONS)


def test_bad_observations_are_refused(actor):
    """Of another length, or not finite."""
    policy = actor.policy({})
    with pytest.raises(ValueError, match="expected shape"):
        policy.prices(np.zeros(3, dtype=np.float32))
    with pytest.raises(ValueError, match="finite"):
        policy.prices(np.full(OBSERVATIONS.size, np.nan, dtype=np.float32))


def test_the_pass_does_not_depend_on_rows_that_are_zero(actor):
    """A channel of zeros adds what its weights times zero are: nothing."""
    weights = actor.policy({}).tensors()
    other = weights | {"near.0.weight": weights["near.0.weight"].copy()}
    other["near.0.weight"][:, 0] = 7.0
    seen = drawn(1, seed=5)[0]
    seen[: 16 * 16] = 0.0
    first, second = (CropPricesPolicy(each, OBSERVATIONS, ACTIONS) for each in (weights, other))
    assert np.array_equal(first.prices(seen), second.prices(seen))


def test_terms_that_are_not_read_change_nothing():
    """In torch and compiled; a policy that reads no crop, or crops alone, is refused."""
    torch.manual_seed(5)
    policy = CropActor(OBSERVATIONS, ACTIONS, TABLE, (8,), ("near", "goal")).policy({})
    seen = drawn(1)[0]
    other = seen.copy()
    other[OBSERVATIONS.slice_of("far")] += 1.0
    np.testing.assert_array_equal(policy.prices(seen), policy.prices(other))
    with pytest.raises(ValueError, match="expected crops and other terms"):
        CropPricesPolicy(policy.tensors(), OBSERVATIONS, ACTIONS, {}, ("goal",))
