"""The paper's networks: two hidden layers of 200 rectified units (section 4.2), for any spaces."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from rl.policies.deterministic import DeterministicPolicy
from rl.policies.gaussian import LOG_SIGMA
from rl.policies.mlp import MlpPolicy
from rl.policy import Policy
from rl.spaces import ActionSpec, ObservationSpec

_LOG_ROOT_TWO_PI = 0.5 * float(np.log(2 * np.pi))


def use_one_thread() -> None:
    """Make torch reproducible and fast for small networks.

    Results change with the number of threads, and subnormal optimiser moments are slow.
    """
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)


class TermReader(nn.Module):
    """Picks the terms that a network reads, and scales them."""

    scale: Tensor
    columns: Tensor

    def __init__(self, observations: ObservationSpec, terms: Sequence[str] | None) -> None:
        """Prepare.

        Args:
            observations: Space of the observations.
            terms: Names of the terms that are read, None for all.
        """
        super().__init__()
        read = observations if terms is None else observations.only(terms)
        columns = observations.columns([term.name for term in read.terms])
        first, last = int(columns[0]), int(columns[-1])
        self.size = read.size
        # Terms side by side need no copy.
        self._range = (first, last + 1) if last - first == len(columns) - 1 else None
        self.register_buffer("scale", torch.from_numpy(read.scale()), persistent=False)
        self.register_buffer("columns", torch.from_numpy(columns), persistent=False)

    def forward(self, states: Tensor) -> Tensor:
        """Return scaled values, shape (n, size); see ``ObservationSpec.scale``.

        Args:
            states: Observations in SI units, shape (n, n_observations).
        """
        if self._range is None:
            states = states.index_select(1, self.columns)
        else:
            states = states[:, slice(*self._range)]
        a, b, c, d = self.scale
        return (a + b * states) / (c + d * states)


class SquashedGaussianActor(nn.Module):
    """What actors have in common: draws of actions and their log-probabilities.

    A subclass gives means before tanh and sigmas, ``forward``, and the policy, ``policy``.
    """

    def forward(self, states: Tensor) -> tuple[Tensor, Tensor]:
        """Return means before tanh and sigmas, shape (n, n_actions).

        Args:
            states: Observations in SI units, shape (n, n_observations).
        """
        raise NotImplementedError

    def policy(self, info: dict[str, Any]) -> Policy:
        """Return the actor as a policy that runs without torch.

        Args:
            info: Origin of the policy, ready for JSON.
        """
        raise NotImplementedError

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


class Actor(SquashedGaussianActor):
    """Maps observations to squashed normal distributions: 35-200-200 to means and log sigmas."""

    def __init__(
        self,
        observations: ObservationSpec,
        actions: ActionSpec,
        hidden: Sequence[int],
        terms: Sequence[str] | None = None,
    ) -> None:
        """Draw weights from torch's generator.

        Args:
            observations: Space of the observations.
            actions: Space of the actions.
            hidden: Width of each hidden layer.
            terms: Names of the terms that it reads, None for all.
        """
        super().__init__()
        self._observations, self._actions = observations, actions
        self._terms = None if terms is None else tuple(terms)
        self.read = TermReader(observations, terms)
        self.linear = linear_layers([self.read.size, *hidden, 2 * actions.size])

    def forward(self, states: Tensor) -> tuple[Tensor, Tensor]:
        """Return means before tanh and sigmas; see ``SquashedGaussianActor.forward``."""
        return mean_and_sigma(self.read(states), self.linear)

    def policy(self, info: dict[str, Any]) -> MlpPolicy:
        """Return the actor as a policy that runs without torch.

        Args:
            info: Origin of the policy, ready for JSON.
        """
        weights = layer_weights(self.linear)
        return MlpPolicy(weights, self._observations, self._actions, info, self._terms)


class DeterministicActor(nn.Module):
    """Maps observations to actions: 35-200-200-1, and tanh."""

    def __init__(
        self,
        observations: ObservationSpec,
        actions: ActionSpec,
        hidden: Sequence[int],
        terms: Sequence[str] | None = None,
    ) -> None:
        """Draw weights from torch's generator; arguments as for ``Actor``."""
        super().__init__()
        self._observations, self._actions = observations, actions
        self._terms = None if terms is None else tuple(terms)
        self.read = TermReader(observations, terms)
        self.linear = linear_layers([self.read.size, *hidden, actions.size])

    def forward(self, states: Tensor) -> Tensor:
        """Return actions from -1 to 1, shape (n, n_actions).

        Args:
            states: Observations in SI units, shape (n, n_observations).
        """
        return torch.tanh(outputs(self.read(states), self.linear))

    def policy(self, info: dict[str, Any]) -> DeterministicPolicy:
        """Return the actor as a policy that runs without torch.

        Args:
            info: Origin of the policy, ready for JSON, and how it explores.
        """
        weights = layer_weights(self.linear)
        return DeterministicPolicy(weights, self._observations, self._actions, info, self._terms)


def linear_layers(widths: Sequence[int]) -> nn.ModuleList:
    """Return fresh layers from each width to the next."""
    return nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(widths))


def outputs(x: Tensor, layers: nn.ModuleList) -> Tensor:
    """Return the outputs of the last of several layers with a ReLU between them."""
    for layer in layers[:-1]:
        x = torch.relu(layer(x))
    values: Tensor = layers[-1](x)
    return values


def mean_and_sigma(x: Tensor, layers: nn.ModuleList) -> tuple[Tensor, Tensor]:
    """Return means before tanh and sigmas of layers with a ReLU between them."""
    mean, log_sigma = outputs(x, layers).chunk(2, dim=1)
    return mean, log_sigma.clamp(*LOG_SIGMA).exp()


def layer_weights(layers: nn.ModuleList) -> dict[str, NDArray[np.float32]]:
    """Return copies of weights and biases as policies name them."""
    weights = {}
    for number, layer in enumerate(layers):
        weights[f"layer{number}.weight"] = as_array(layer.weight)
        weights[f"layer{number}.bias"] = as_array(layer.bias)
    return weights


@torch.no_grad()
def polyak_update(target: nn.Module, online: nn.Module, tau: float) -> None:
    """Move a share ``tau`` of one network's parameters into another's."""
    torch._foreach_lerp_(list(target.parameters()), list(online.parameters()), tau)


def _log_squash(before: Tensor) -> Tensor:
    """Return log(1 - tanh(x)^2), without cancellation."""
    return 2 * (float(np.log(2)) - before - nn.functional.softplus(-2 * before))


def as_array(tensor: Tensor) -> NDArray[np.float32]:
    """Return a copy of a tensor's numbers."""
    return tensor.detach().cpu().numpy().astype(np.float32).copy()
