"""The paper's networks: sizes, densities, what they read."""

import numpy as np
import pytest
import torch

from rl.networks import (
    Actor,
    DeterministicActor,
    TermReader,
    linear_layers,
    polyak_update,
    use_one_thread,
)
from rl.policies.gaussian import LOG_SIGMA
from rl.spaces import steering_actions, steering_observations
from tests.support.known_environments import TARGETS, TWO_ACTIONS

OBSERVATIONS, ACTIONS = steering_observations(32, 10.0, 0.5), steering_actions(0.5)


def test_the_papers_sizes():
    """35-200-200 to mean and spread of one action; a deterministic actor has no spread."""
    weights = Actor(OBSERVATIONS, ACTIONS, (200, 200)).policy({}).weights
    shapes = [weights[f"layer{k}.weight"].shape for k in range(3)]
    assert shapes == [(200, 35), (200, 200), (2, 200)]  # Mean and spread: 35-200-200-1 drives.
    weights = DeterministicActor(OBSERVATIONS, ACTIONS, (200, 200)).policy({}).weights
    shapes = [weights[f"layer{k}.weight"].shape for k in range(3)]
    assert shapes == [(200, 35), (200, 200), (1, 200)]


def test_densities_integrate_to_one():
    """The probability density of an action between -1 and 1 has the integral 1."""
    actor = Actor(OBSERVATIONS, ACTIONS, (16,))
    actions = torch.linspace(-0.9989, 0.9989, 20_001)[:, None]
    state = torch.ones(1, 35).expand(len(actions), 35)
    with torch.no_grad():
        density = actor.log_probability(state, actions).exp()
    assert float(torch.trapezoid(density, actions[:, 0])) == pytest.approx(1.0, abs=0.01)


def test_samples_have_the_density_that_they_report():
    """The log-probability of a sample is that of its action; two actions add up."""
    actor = Actor(TARGETS, TWO_ACTIONS, (16,))
    states = torch.rand(200, 2) - 0.5
    actions, log_p = actor.sample(states, torch.Generator().manual_seed(1))
    assert actions.shape == (200, 2)
    assert log_p.shape == (200,)
    inside = (actions.abs() < 0.99).all(dim=1)
    assert inside.float().mean() > 0.5
    again = actor.log_probability(states, actions.detach())
    torch.testing.assert_close(again[inside], log_p[inside], atol=1e-3, rtol=1e-3)


def test_the_spread_is_bounded():
    """Sigmas stay within the bounds of ``LOG_SIGMA``."""
    actor = Actor(TARGETS, TWO_ACTIONS, (4,))
    for bias, bound in ((-50.0, LOG_SIGMA[0]), (50.0, LOG_SIGMA[1])):
        with torch.no_grad():
            actor.linear[-1].bias[2:] = bias
            _, sigma = actor(torch.zeros(1, 2))
        np.testing.assert_allclose(sigma, np.exp(bound), rtol=1e-6)


@pytest.mark.parametrize(
    ("terms", "columns"),
    [
        (None, [*range(35)]),
        (("heading_error",), [34]),
        (("previous_actions", "heading_error"), [32, 33, 34]),
        (("heading_error", "ranges"), [*range(32), 34]),
    ],
)
def test_terms_are_picked_and_scaled(terms, columns):
    """Terms side by side or apart come out in the order of the space, each with its scale."""
    read, states = TermReader(OBSERVATIONS, terms), torch.rand(5, 35)
    scale = torch.from_numpy(OBSERVATIONS.scale())
    scaled = (scale[0] + scale[1] * states) / (scale[2] + scale[3] * states)
    torch.testing.assert_close(read(states), scaled[:, columns], rtol=0, atol=0)
    assert read.size == len(columns)


def test_a_share_of_the_parameters_moves():
    """The update moves a share ``tau`` from the online network, which stays as it is."""
    slow, fast = (linear_layers((35, 4, 1)) for _ in range(2))
    before = [p.clone() for p in slow.parameters()]
    polyak_update(slow, fast, 0.1)
    for old, new, online in zip(before, slow.parameters(), fast.parameters(), strict=True):
        torch.testing.assert_close(new, 0.9 * old + 0.1 * online)


def test_a_run_uses_one_thread():
    """A training run sets torch to one thread."""
    torch.set_num_threads(2)
    use_one_thread()
    assert torch.get_num_threads() == 1
