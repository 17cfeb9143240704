"""Critics: sizes, twins that are each as alone, and how state and action come together."""

import numpy as np
import pytest
import torch

from rl.critics import Fusion, StateCritic, TwinCritic, ValueCritic
from rl.spaces import steering_actions, steering_observations
from tests.support.known_environments import TARGETS, TWO_ACTIONS

OBSERVATIONS, ACTIONS = steering_observations(32, 10.0, 0.5), steering_actions(0.5)


def test_the_papers_sizes():
    """35-200-200-1, and for an action beside the state 36-200-200-1 twice."""
    assert [one.shape for one in TwinCritic(OBSERVATIONS, ACTIONS, (200, 200)).weights] == [
        (2, 36, 200),
        (2, 200, 200),
        (2, 200, 1),
    ]
    assert [one.shape for one in StateCritic(OBSERVATIONS, (200, 200)).weights] == [
        (1, 35, 200),
        (1, 200, 200),
        (1, 200, 1),
    ]


def test_the_value_of_a_state_takes_the_reward_as_printed():
    """The printed critic has the reward as its 36th input; the plain one does not see it."""
    printed, plain = (ValueCritic(OBSERVATIONS, (200, 200), beside) for beside in (1, 0))
    assert printed.linear[0].weight.shape == (200, 36)
    assert plain.linear[0].weight.shape == (200, 35)
    states, rewards = torch.ones(2, 35), torch.tensor([[0.0], [100.0]])
    read = (rewards, rewards[:, :0])
    pairs = zip((printed, plain), read, strict=True)
    apart = [torch.diff(critic(states, beside)).abs().item() for critic, beside in pairs]
    assert apart[0] > 1e-2
    assert apart[1] < 1e-5


def test_the_critics_are_two():
    """Each critic is the same function as alone, of state and action, and they differ."""
    critic = TwinCritic(OBSERVATIONS, ACTIONS, (16, 16))
    states, actions = torch.rand(5, 35), torch.rand(5, 1)
    with torch.no_grad():
        both = critic(states, actions)
        assert both.shape == (2, 5)
        assert (both[0] - both[1]).abs().max() > 1e-3
        scale = critic.read.scale
        x = torch.cat([(scale[0] + scale[1] * states) / (scale[2] + scale[3] * states), actions], 1)
        for n in range(2):
            y = x
            for layer, (weights, biases) in enumerate(
                zip(critic.weights, critic.biases, strict=True)
            ):
                y = y @ weights[n] + biases[n]
                if layer < 2:
                    y = torch.relu(torch.nn.functional.layer_norm(y, (16,)))
            torch.testing.assert_close(both[n], y[:, 0], atol=1e-5, rtol=1e-5)


def test_the_value_of_a_state_has_the_critics_layers():
    """The critic of a state is one of the twins without the action."""
    value, twins = StateCritic(OBSERVATIONS, (16, 8)), TwinCritic(OBSERVATIONS, ACTIONS, (16, 8))
    states = torch.rand(5, 35)
    with torch.no_grad():
        twins.weights[0][:, -1] = 0.0
        for mine, theirs in zip(value.parameters(), twins.parameters(), strict=True):
            mine.copy_(theirs[1:, : mine.shape[1]])
        assert value(states).shape == (5,)
        torch.testing.assert_close(value(states), twins(states, torch.rand(5, 1))[1])


def test_the_first_critic_is_the_first_of_both():
    """The values of the first critic alone are those that it has beside the second."""
    critic = TwinCritic(OBSERVATIONS, ACTIONS, (16, 8))
    states, actions = torch.rand(5, 35), torch.rand(5, 1)
    torch.testing.assert_close(critic.first(states, actions), critic(states, actions)[0])


def fused(layer, kind="sum", normalised=False, hidden=(6, 5)):
    fusion = Fusion(kind=kind, layer=layer)
    return TwinCritic(TARGETS, TWO_ACTIONS, hidden, None, fusion, normalised)


def test_equation_1_adds_two_branches():
    """The first hidden layer is the ReLU of W_s s + W_a a + b_a, without normalisation."""
    critic = fused(0)
    states, actions = torch.rand(7, 2) - 0.5, torch.rand(7, 2) - 0.5
    with torch.no_grad():
        found = critic(states, actions)
        for n in range(2):
            of_state, of_action = critic.weights[0][n, :2], critic.weights[0][n, 2:]
            h = torch.relu(states @ of_state + actions @ of_action + critic.biases[0][n])
            h = torch.relu(h @ critic.weights[1][n] + critic.biases[1][n])
            value = h @ critic.weights[2][n] + critic.biases[2][n]
            torch.testing.assert_close(found[n], value[:, 0])


def test_gdae_adds_the_action_to_the_first_hidden_layer():
    """With ``layer`` 1 the state passes one layer alone, and the action enters the second."""
    critic = fused(1)
    assert [one.shape for one in critic.weights] == [(2, 2, 6), (2, 6 + 2, 5), (2, 5, 1)]
    states, actions = torch.rand(7, 2) - 0.5, torch.rand(7, 2) - 0.5
    with torch.no_grad():
        found = critic(states, actions)
        for n in range(2):
            h = torch.relu(states @ critic.weights[0][n] + critic.biases[0][n])
            of_state, of_action = critic.weights[1][n, :6], critic.weights[1][n, 6:]
            h = torch.relu(h @ of_state + actions @ of_action + critic.biases[1][n])
            value = h @ critic.weights[2][n] + critic.biases[2][n]
            torch.testing.assert_close(found[n], value[:, 0])


def test_the_branches_of_a_sum_begin_within_bounds_of_their_own():
    """A branch begins within one over the root of its own inputs, a layer over both of all."""
    hidden = (400,)
    for kind, of_state, of_action in (("concatenation", 36, 36), ("sum", 35, 1)):
        critic = TwinCritic(OBSERVATIONS, ACTIONS, hidden, None, Fusion(kind=kind))
        weights, biases = critic.weights[0].detach(), critic.biases[0].detach()
        largest = [float(part.abs().max()) for part in (weights[:, :35], weights[:, 35:], biases)]
        expected = [of_state**-0.5, of_action**-0.5, of_action**-0.5]
        np.testing.assert_allclose(largest, expected, rtol=0.02)
        assert max(np.array(largest) / expected) <= 1.0


def test_a_frozen_layer_gets_no_gradient_and_passes_it_on():
    """Weights of a frozen fusion get no gradient; the layer below and the action still do."""
    critic = TwinCritic(
        TARGETS, TWO_ACTIONS, (6, 5), None, Fusion(kind="sum", layer=1, frozen=True)
    )
    actions = torch.rand(7, 2, requires_grad=True)
    critic(torch.rand(7, 2), actions).sum().backward()
    has_gradient = [one.grad is not None for one in (*critic.weights, *critic.biases)]
    assert has_gradient == [True, False, True, True, False, True]
    assert critic.weights[0].grad.abs().max() > 0
    assert actions.grad.abs().max() > 0


def test_an_action_needs_a_layer_to_enter():
    """A fusion behind the last layer is refused."""
    with pytest.raises(ValueError, match="expected 0 to 2 with 2 hidden layers, got 3"):
        fused(3)
