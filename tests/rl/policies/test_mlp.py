"""The compiled perceptron equals the network in torch that it came from."""

import numpy as np
import pytest
import torch

from rl.networks import Actor
from rl.policies.gaussian import LOG_SIGMA
from rl.policies.mlp import MlpPolicy
from rl.policy import policy_from_bytes
from rl.spaces import steering_actions, steering_observations
from tests.support.known_environments import TARGETS, TWO_ACTIONS

OBSERVATIONS, ACTIONS = steering_observations(32, 10.0, 0.5), steering_actions(0.5)


@pytest.fixture(scope="module")
def actor():
    torch.manual_seed(0)
    return Actor(OBSERVATIONS, ACTIONS, (200, 200))


def states(n=50):
    low, high = OBSERVATIONS.bounds()
    return np.random.default_rng(0).uniform(low, high, (n, 35)).astype(np.float32)


def test_it_equals_torch(actor):
    """The action is half the range times tanh of the network's mean."""
    policy = actor.policy({})
    with torch.no_grad():
        mean, _ = actor(torch.from_numpy(states()))
    expected = 0.5 * torch.tanh(mean).numpy()
    np.testing.assert_allclose([policy.act(state) for state in states()], expected, atol=1e-6)


def test_hidden_layers_of_any_number():
    """A policy without and one with three hidden layers equal torch as well."""
    for hidden in ((), (8, 4, 6)):
        network = Actor(TARGETS, TWO_ACTIONS, hidden)
        policy = network.policy({})
        x = np.random.default_rng(1).uniform(-1, 1, (20, 2)).astype(np.float32)
        with torch.no_grad():
            mean, _ = network(torch.from_numpy(x))
        found = np.array([policy.best(one) for one in x])
        np.testing.assert_allclose(found, torch.tanh(mean).numpy(), atol=1e-6)


def test_exploration_spreads_as_the_network_predicts(actor):
    """Explored actions have the network's mean and sigma, before tanh."""
    policy = actor.policy({})
    state = states(1)
    with torch.no_grad():
        mean, sigma = actor(torch.from_numpy(state))
    rng = np.random.default_rng(0)
    drawn = np.arctanh([policy.explore(state[0], rng) for _ in range(4000)])
    assert drawn.mean() == pytest.approx(float(mean), abs=4 * float(sigma) / 4000**0.5)
    assert drawn.std() == pytest.approx(float(sigma), rel=0.05)


def constant(means, log_sigmas):
    """Return a policy of two actions whose outputs do not depend on the observation."""
    weights = {
        "layer0.weight": np.zeros((4, 2), np.float32),
        "layer0.bias": np.array([*means, *log_sigmas], np.float32),
    }
    return MlpPolicy(weights, TARGETS, TWO_ACTIONS)


def test_each_action_explores_with_its_own_spread():
    """The log sigmas follow the means in the order of the actions, within their bounds."""
    policy, rng = constant((0.3, -0.2), (-2.0, -9.0)), np.random.default_rng(0)
    drawn = np.arctanh([policy.explore(np.zeros(2, np.float32), rng) for _ in range(4000)])
    np.testing.assert_allclose(drawn.mean(axis=0), [0.3, -0.2], atol=0.01)
    np.testing.assert_allclose(drawn.std(axis=0), np.exp([-2.0, LOG_SIGMA[0]]), rtol=0.05)


def test_the_best_action_has_no_noise():
    """The best shares are tanh of the means, and actions are those shares in SI units."""
    policy, nothing = constant((0.5, -1.0), (0.0, 0.0)), np.zeros(2, np.float32)
    np.testing.assert_allclose(policy.best(nothing), np.tanh([0.5, -1.0]), rtol=1e-6)
    expected = [0.2 + 0.2 * np.tanh(0.5), 0.5 * np.tanh(-1.0)]
    np.testing.assert_allclose(policy.act(nothing), expected, rtol=1e-6)


@pytest.mark.parametrize("bad", [np.full(35, np.nan), np.zeros(34), np.full(35, np.inf)])
def test_impossible_observations_are_refused(actor, bad):
    """NaN, infinity and another length are errors."""
    with pytest.raises(ValueError, match="observation: expected"):
        actor.policy({}).act(bad.astype(np.float32))


@pytest.mark.parametrize(
    ("name", "shape", "message"),
    [
        ("layer0.weight", (4, 3), "layer0: expected 2 inputs"),
        ("layer0.bias", (3,), "layer0: expected 2 inputs"),
        ("layer1.bias", (4,), "layers: expected"),
    ],
)
def test_layers_that_do_not_fit_are_refused(name, shape, message):
    """Weights of another shape or without a partner are named."""
    weights = dict(constant((0, 0), (0, 0)).weights)
    weights[name] = np.zeros(shape, np.float32)
    with pytest.raises(ValueError, match=message):
        MlpPolicy(weights, TARGETS, TWO_ACTIONS)


def test_outputs_are_mean_and_spread_of_each_action():
    """A last layer of another width than two for each action is refused."""
    weights = {"layer0.weight": np.zeros((2, 2), np.float32), "layer0.bias": np.zeros(2, "f4")}
    with pytest.raises(ValueError, match=r"of each action as outputs \(4\), got 2"):
        MlpPolicy(weights, TARGETS, TWO_ACTIONS)


def test_some_terms_alone_are_read():
    """A policy of some terms has a layer for these, and its file names them."""
    terms = ("ranges", "heading_error")
    network = Actor(OBSERVATIONS, ACTIONS, (8,), terms)
    policy = policy_from_bytes(network.policy({}).to_bytes())
    assert policy.terms == terms
    assert policy.weights["layer0.weight"].shape == (8, 33)
    with torch.no_grad():
        mean, _ = network(torch.from_numpy(states()))
    np.testing.assert_allclose(policy.best_many(states()), torch.tanh(mean), atol=1e-6)
    other = states(1)[0]
    other[32:34] = 0.1
    np.testing.assert_array_equal(policy.act(other), policy.act(states(1)[0]))
    with pytest.raises(ValueError, match="layer0: expected 35 inputs"):
        MlpPolicy(policy.weights, OBSERVATIONS, ACTIONS)
    with pytest.raises(KeyError, match="'goal'"):
        MlpPolicy(policy.weights, OBSERVATIONS, ACTIONS, {}, ("goal",))


def test_many_rows_are_single_calls(actor):
    """Rows together give the bits of each alone, and each draws from its own generator."""
    policy, rows = actor.policy({}), states(17)
    best = policy.best_many(rows)
    drawn = policy.explore_many(rows, [np.random.default_rng(k) for k in range(17)])
    assert best.shape == drawn.shape == (17, 1)
    for k, row in enumerate(rows):
        np.testing.assert_array_equal(best[k], policy.best(row))
        np.testing.assert_array_equal(drawn[k], policy.explore(row, np.random.default_rng(k)))
    assert policy.best_many(rows[:0]).shape == (0, 1)
    with pytest.raises(ValueError, match="zip"):
        policy.explore_many(rows, [np.random.default_rng(0)])
