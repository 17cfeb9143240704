"""The paper's networks: two hidden layers of 200 rectified units (section 4.2), for any spaces."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from rl.mlp import LOG_SIGMA, MlpPolicy
from rl.spaces import ActionSpec, ObservationSpec

_LOG_ROOT_TWO_PI = 0.5 * float(np.log(2 * np.pi))


def use_one_thread() -> None:
    """Make torch reproducible and fast for small networks.

    Results change with the number of threads, and subnormal optimiser moments are slow.
    """
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)


class Actor(nn.Module):
    """Maps observations to squashed normal distributions: 35-200-200 to means and log sigmas."""

    def __init__(
        self, observations: ObservationSpec, actions: ActionSpec, hidden: Sequence[int]
    ) -> None:
        """Draw weights from torch's generator.

        Args:
            observations: Space of the observations.
            actions: Space of the actions.
            hidden: Width of each hidden layer.
        """
        super().__init__()
        self._observations, self._actions = observations, actions
        widths = [observations.size, *hidden, 2 * actions.size]
        self.linear = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        self.register_buffer("scale", torch.from_numpy(observations.scale()), persistent=False)

    def forward(self, states: Tensor) -> tuple[Tensor, Tensor]:
        """Return means before tanh and sigmas, shape (n, n_actions).

        Args:
            states: Observations in SI units, shape (n, n_observations).
        """
        x = _scaled(states, self.scale)
        for layer in self.linear[:-1]:
            x = torch.relu(layer(x))
        mean, log_sigma = self.linear[-1](x).chunk(2, dim=1)
        return mean, log_sigma.clamp(*LOG_SIGMA).exp()

    def sample(self, states: Tensor, noise: torch.Generator) -> tuple[Tensor, Tensor]:
        """Return actions from -1 to 1, shape (n, n_actions), and log-probabilities, shape (n,)."""
        mean, sigma = self(states)
        normal = torch.randn(mean.shape, generator=noise, device=mean.device)
        before = mean + sigma * normal
        log_p = -normal.square() / 2 - sigma.log() - _LOG_ROOT_TWO_PI
        return torch.tanh(before), (log_p - _log_squash(before)).sum(dim=1)

    def log_probability(self, states: Tensor, actions: Tensor) -> Tensor:
        """Return the log-probabilities of actions from -1 to 1 that were drawn before, (n,)."""
        mean, sigma = self(states)
        before = torch.atanh(actions.clamp(-0.999, 0.999))
        normal = (before - mean) / sigma
        log_p = -normal.square() / 2 - sigma.log() - _LOG_ROOT_TWO_PI
        return (log_p - _log_squash(before)).sum(dim=1)

    def policy(self, info: dict[str, Any]) -> MlpPolicy:
        """Return the actor as a policy that runs without torch.

        Args:
            info: Origin of the policy, ready for JSON.
        """
        weights = {}
        for number, layer in enumerate(self.linear):
            weights[f"layer{number}.weight"] = _array(layer.weight)
            weights[f"layer{number}.bias"] = _array(layer.bias)
        return MlpPolicy(weights, self._observations, self._actions, info)


class ValueCritic(nn.Module):
    """Maps a state to its value, 35-200-200-1, or with the reward beside it, 36 (as printed)."""

    def __init__(
        self, observations: ObservationSpec, hidden: Sequence[int], takes_reward: bool
    ) -> None:
        """Draw weights from torch's generator.

        Args:
            observations: Space of the observations.
            hidden: Width of each hidden layer.
            takes_reward: True if the reward that came with the state is an input.
        """
        super().__init__()
        self._takes_reward = takes_reward
        widths = [observations.size + takes_reward, *hidden, 1]
        self.linear = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))
        self.register_buffer("scale", torch.from_numpy(observations.scale()), persistent=False)

    def forward(self, states: Tensor, rewards: Tensor) -> Tensor:
        """Return the values of states, shape (n,).

        Args:
            states: Observations in SI units, shape (n, n_observations).
            rewards: Rewards that came with them, shape (n,).
        """
        x = _scaled(states, self.scale)
        if self._takes_reward:
            x = torch.cat([x, rewards[:, None]], dim=1)
        for layer in self.linear[:-1]:
            x = torch.relu(layer(x))
        value: Tensor = self.linear[-1](x)
        return value.squeeze(1)


class TwinCritic(nn.Module):
    """Two critics side by side, state and actions to a value: 36-200-200-1 each.

    The paper prints the reward as the 36th input; a value of an action needs the action there
    (assumption). Hidden layers are normalised: without it the values of loops grow until the robot
    circles.
    """

    def __init__(
        self, observations: ObservationSpec, actions: ActionSpec, hidden: Sequence[int]
    ) -> None:
        """Draw weights from torch's generator; arguments as for ``Actor``."""
        super().__init__()
        widths = [observations.size + actions.size, *hidden, 1]
        self.weights = nn.ParameterList()
        self.biases = nn.ParameterList()
        for inputs, outputs in pairwise(widths):
            bound = inputs**-0.5
            self.weights.append(
                nn.Parameter(torch.empty(2, inputs, outputs).uniform_(-bound, bound))
            )
            self.biases.append(nn.Parameter(torch.empty(2, 1, outputs).uniform_(-bound, bound)))
        self.register_buffer("scale", torch.from_numpy(observations.scale()), persistent=False)

    def forward(self, states: Tensor, actions: Tensor) -> Tensor:
        """Return both critics' values, shape (2, n).

        Args:
            states: Observations in SI units, shape (n, n_observations).
            actions: Actions from -1 to 1, shape (n, n_actions).
        """
        x = torch.cat([_scaled(states, self.scale), actions], dim=1)
        x = x.expand(2, *x.shape)
        last = len(self.weights) - 1
        for number, (weights, biases) in enumerate(zip(self.weights, self.biases, strict=True)):
            # One batched product drives both critics through a layer.
            x = torch.baddbmm(biases, x, weights)
            if number < last:
                x = torch.relu(nn.functional.layer_norm(x, x.shape[-1:]))
        return x.squeeze(-1)


@torch.no_grad()
def polyak_update(target: nn.Module, online: nn.Module, tau: float) -> None:
    """Move a share ``tau`` of one network's parameters into another's."""
    for slow, fast in zip(target.parameters(), online.parameters(), strict=True):
        slow.lerp_(fast, tau)


def _log_squash(before: Tensor) -> Tensor:
    """Return log(1 - tanh(x)^2), without cancellation."""
    return 2 * (float(np.log(2)) - before - nn.functional.softplus(-2 * before))


def _scaled(states: Tensor, scale: Tensor) -> Tensor:
    """Return observations as the networks take them; see ``ObservationSpec.scale``."""
    a, b, c, d = scale
    return (a + b * states) / (c + d * states)


def _array(tensor: Tensor) -> NDArray[np.float32]:
    """Return a copy of a tensor's numbers."""
    return tensor.detach().cpu().numpy().astype(np.float32).copy()
