"""The paper's networks: two hidden layers of 200 rectified units (section 4.2)."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from rl.policy import Policy
from rl.spaces import ObservationLayout

_LOG_SIGMA = (-4.0, 0.5)


def use_one_thread() -> None:
    """Make torch reproducible and fast for small networks.

    Results change with the number of threads, and subnormal optimiser moments are slow.
    """
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)


class Actor(nn.Module):
    """State to a squashed normal distribution over actions: 35-200-200 and mean, log sigma."""

    def __init__(
        self, layout: ObservationLayout, max_range: float, limit: float, hidden: Sequence[int]
    ) -> None:
        """Draw weights from torch's generator.

        Args:
            layout: The state.
            max_range: Largest range of the state [m].
            limit: Largest yaw rate [rad/s].
            hidden: Width of each hidden layer.
        """
        super().__init__()
        self.max_range, self.limit = max_range, limit
        widths = [layout.size, *hidden, 2]
        self.linear = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        self.register_buffer("scale", torch.from_numpy(layout.scale(limit)), persistent=False)

    def forward(self, states: Tensor) -> tuple[Tensor, Tensor]:
        """Return means before tanh and sigmas, shape (n,), for states in SI units, (n, 35)."""
        x = _scaled(states, self.scale)
        for layer in self.linear[:-1]:
            x = torch.relu(layer(x))
        mean, log_sigma = self.linear[-1](x).unbind(dim=1)
        return mean, log_sigma.clamp(*_LOG_SIGMA).exp()

    def sample(self, states: Tensor, noise: torch.Generator) -> tuple[Tensor, Tensor]:
        """Return actions, -1 to 1, and their log-probabilities, shape (n,) each."""
        mean, sigma = self(states)
        normal = torch.randn(mean.shape, generator=noise, device=mean.device)
        before = mean + sigma * normal
        log_p = -normal.square() / 2 - sigma.log() - 0.5 * float(np.log(2 * np.pi))
        return torch.tanh(before), log_p - _squash(before)

    def log_probability(self, states: Tensor, actions: Tensor) -> Tensor:
        """Return the log-probabilities of actions, -1 to 1, that were drawn before, shape (n,)."""
        mean, sigma = self(states)
        before = torch.atanh(actions.clamp(-0.999, 0.999))
        normal = (before - mean) / sigma
        log_p = -normal.square() / 2 - sigma.log() - 0.5 * float(np.log(2 * np.pi))
        return log_p - _squash(before)

    def policy(self, dead_zone: float, info: dict[str, Any]) -> Policy:
        """Return the actor as a policy that runs without torch.

        Args:
            dead_zone: Yaw rates below this are zero [rad/s].
            info: How it was trained, ready for JSON.
        """
        layers = tuple((_array(layer.weight), _array(layer.bias)) for layer in self.linear)
        return Policy(layers, self.max_range, self.limit, dead_zone, info)


class ValueCritic(nn.Module):
    """State to its value, 35-200-200-1, or with the reward beside it, 36-200-200-1 (as printed)."""

    def __init__(
        self, layout: ObservationLayout, limit: float, hidden: Sequence[int], takes_reward: bool
    ) -> None:
        """Draw weights from torch's generator.

        Args:
            layout: The state.
            limit: Largest yaw rate [rad/s].
            hidden: Width of each hidden layer.
            takes_reward: Whether the reward that came with the state is an input.
        """
        super().__init__()
        self._takes_reward = takes_reward
        widths = [layout.size + takes_reward, *hidden, 1]
        self.linear = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        self.register_buffer("scale", torch.from_numpy(layout.scale(limit)), persistent=False)

    def forward(self, states: Tensor, rewards: Tensor) -> Tensor:
        """Return the values of states in SI units, (n, 35), that came with rewards, shape (n,)."""
        x = _scaled(states, self.scale)
        if self._takes_reward:
            x = torch.cat([x, rewards[:, None]], dim=1)
        for layer in self.linear[:-1]:
            x = torch.relu(layer(x))
        value: Tensor = self.linear[-1](x)
        return value.squeeze(1)


class TwinCritic(nn.Module):
    """Two critics side by side, state and action to a value: 36-200-200-1 each.

    The paper prints the reward as the 36th input; a value of an action needs the action there
    (assumption). Hidden layers are normalised: without it the values of loops grow until the robot
    circles.
    """

    def __init__(self, layout: ObservationLayout, limit: float, hidden: Sequence[int]) -> None:
        """Draw weights from torch's generator; arguments as for ``Actor``."""
        super().__init__()
        widths = [layout.size + 1, *hidden, 1]
        self.weights = nn.ParameterList()
        self.biases = nn.ParameterList()
        for inputs, outputs in pairwise(widths):
            bound = inputs**-0.5
            self.weights.append(
                nn.Parameter(torch.empty(2, inputs, outputs).uniform_(-bound, bound))
            )
            self.biases.append(nn.Parameter(torch.empty(2, 1, outputs).uniform_(-bound, bound)))
        self.register_buffer("scale", torch.from_numpy(layout.scale(limit)), persistent=False)

    def forward(self, states: Tensor, actions: Tensor) -> Tensor:
        """Return both critics' values, shape (2, n).

        Args:
            states: States in SI units, shape (n, 35).
            actions: Shares of the steering limit, shape (n,).
        """
        x = torch.cat([_scaled(states, self.scale), actions[:, None]], dim=1)
        x = x.expand(2, *x.shape)
        last = len(self.weights) - 1
        for number, (weights, biases) in enumerate(zip(self.weights, self.biases, strict=True)):
            x = torch.baddbmm(biases, x, weights)
            if number < last:
                x = torch.relu(nn.functional.layer_norm(x, x.shape[-1:]))
        return x.squeeze(-1)


def _squash(before: Tensor) -> Tensor:
    """Return log(1 - tanh(x)^2), without cancellation."""
    return 2 * (float(np.log(2)) - before - nn.functional.softplus(-2 * before))


def _scaled(states: Tensor, scale: Tensor) -> Tensor:
    """Return states as the networks take them; see ``ObservationLayout.scale``."""
    a, b, c, d = scale
    return (a + b * states) / (c + d * states)


def _array(tensor: Tensor) -> NDArray[np.float32]:
    """Return a copy of a tensor's numbers."""
    return tensor.detach().cpu().numpy().astype(np.float32).copy()
