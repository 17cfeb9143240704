"""The actor on points in torch: the compiled maxima have the values and gradients of the graph."""

import numpy as np
import pytest
import torch

from rl.point_set_actor import PointSetActor
from rl.policies.gaussian import LOG_SIGMA
from tests.support.point_sets import ACTIONS, observation, point_observations, with_points


def made(n=30, **settings):
    torch.manual_seed(0)
    return PointSetActor(point_observations(n), ACTIONS, (16, 16), **settings)


def states(n, rows=32, seed=0):
    rng = np.random.default_rng(seed)
    return torch.from_numpy(np.array([observation(n, rng) for _ in range(rows)]))


def dense(actor, batch, n):
    """Return means and sigmas through a graph over all points, as torch's own layers give them."""
    space = point_observations(n)
    points = batch[:, space.slice_of("points")].reshape(-1, n, 2)
    mask = batch[:, space.slice_of("mask")]
    goals = torch.cat([batch[:, space.slice_of(name)] for name in ("goal", "velocity")], 1)
    goals = goals / torch.tensor([1, 1, 1, torch.pi / 3, torch.pi / 3])
    gates = torch.sigmoid(actor.gate(goals))
    hidden = torch.nn.functional.leaky_relu(actor.point(points), 0.01) * gates[:, None]
    features = actor.feature(hidden) - 1e9 * (1 - mask[..., None])
    x = torch.cat([features.max(dim=1).values, goals], 1)
    for layer in actor.linear[:-1]:
        x = torch.relu(layer(x))
    mean, log_sigma = actor.linear[-1](x).chunk(2, dim=1)
    return mean, log_sigma.clamp(*LOG_SIGMA).exp()


@pytest.mark.parametrize(("n", "width", "n_features"), [(1, 8, 2), (70, 64, 20), (130, 24, 5)])
def test_values_and_gradients_are_those_of_the_dense_graph(n, width, n_features):
    """Means, sigmas and the gradient of each weight equal torch's over all points."""
    actor, batch = made(n, width=width, n_features=n_features), states(n)
    weights = torch.randn(2, 32, 2)
    gradients = []
    for outputs in (actor(batch), dense(actor, batch, n)):
        actor.zero_grad()
        (weights * torch.stack(outputs)).sum().backward()
        gradients.append({name: p.grad.clone() for name, p in actor.named_parameters()})
        means = outputs
    torch.testing.assert_close(actor(batch), means, rtol=0, atol=1e-6)
    assert all(gradient.abs().max() > 0 for gradient in gradients[1].values())
    torch.testing.assert_close(*gradients, rtol=1e-4, atol=1e-5)


def test_other_devices_have_the_same_features():
    """The graph for devices without the kernel gives the same, also where no point counts."""
    actor, batch = made(), states(30)
    batch[3, point_observations(30).slice_of("mask")] = 0
    gates = torch.rand(32, 64)
    torch.testing.assert_close(
        actor.features(batch, gates), actor._dense_features(batch, gates), rtol=0, atol=1e-6
    )


def test_without_points_the_gradient_is_that_of_open_space():
    """Rows without points learn the biases, not the points' weights."""
    actor, batch = made(), states(30)
    batch[:, point_observations(30).slice_of("mask")] = 0
    actor(batch)[0].sum().backward()
    assert actor.point.weight.grad.abs().max() == 0
    assert actor.point.bias.grad.abs().max() > 0


def test_the_policy_is_the_actor():
    """The compiled policy gives the actor's best actions and its draws' spread."""
    actor, batch = made(120), states(120)
    policy = actor.policy({"stage": "room"})
    assert policy.info == {"stage": "room"}
    with torch.no_grad():
        mean, sigma = actor(batch)
    np.testing.assert_allclose(policy.best_many(batch.numpy()), torch.tanh(mean), atol=1e-5)
    outputs = policy._outputs(batch.numpy())
    np.testing.assert_allclose(np.exp(outputs[:, 2:].clip(*LOG_SIGMA)), sigma, atol=1e-5)


def test_a_policy_of_a_trained_number_of_points_runs_on_any_other():
    """The policy for 120 points is the actor for 50 with the same weights."""
    actor, other = made(120), made(50)
    other.load_state_dict(actor.state_dict())
    batch = states(50)
    with torch.no_grad():
        mean, _ = other(batch)
    best = with_points(actor.policy({}), 50).best_many(batch.numpy())
    np.testing.assert_allclose(best, torch.tanh(mean), atol=1e-5)


def test_draws_have_their_log_probabilities():
    """``sample`` and ``log_probability`` agree on the actions that were drawn."""
    actor, batch = made(), states(30)
    actions, log_p = actor.sample(batch, torch.Generator().manual_seed(1))
    assert actions.shape == (32, 2)
    inner = actions.abs().amax(dim=1) < 0.99
    assert inner.any()
    torch.testing.assert_close(
        actor.log_probability(batch, actions)[inner], log_p[inner], rtol=1e-3, atol=1e-3
    )
