"""The paper's networks: two hidden layers of 200 rectified units (section 4.2)."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from rl.observation import ObservationLayout
from rl.policy import Policy


class Actor(nn.Module):
    """State to the mean of a normal distribution over actions, 35-200-200-1 in the paper."""

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
        self.body = mlp([layout.size, *hidden, 1])
        offset, scale = layout.scale(max_range, limit)
        self.register_buffer("offset", torch.from_numpy(offset), persistent=False)
        self.register_buffer("scale", torch.from_numpy(scale), persistent=False)

    def forward(self, states: Tensor) -> Tensor:
        """Return means, -1 to 1, shape (n,), for states in SI units, shape (n, 35)."""
        return torch.tanh(self.body((states - self.offset) * self.scale)).squeeze(-1)

    def policy(self, dead_zone: float, info: dict[str, Any]) -> Policy:
        """Return the actor as a policy that runs without torch.

        Args:
            dead_zone: Yaw rates below this are zero [rad/s].
            info: How it was trained, ready for JSON.
        """
        linear = [layer for layer in self.body if isinstance(layer, nn.Linear)]
        layers = tuple((_array(layer.weight), _array(layer.bias)) for layer in linear)
        return Policy(layers, self.max_range, self.limit, dead_zone, info)


class Critic(nn.Module):
    """State and the reward that came with it to a value, 36-200-200-1 in the paper."""

    def __init__(
        self, layout: ObservationLayout, max_range: float, limit: float, hidden: Sequence[int]
    ) -> None:
        """Draw weights from torch's generator; arguments as for ``Actor``."""
        super().__init__()
        self.body = mlp([layout.size + 1, *hidden, 1])
        offset, scale = layout.scale(max_range, limit)
        self.register_buffer("offset", torch.from_numpy(offset), persistent=False)
        self.register_buffer("scale", torch.from_numpy(scale), persistent=False)

    def forward(self, states: Tensor, rewards: Tensor) -> Tensor:
        """Return values, shape (n,).

        Args:
            states: States in SI units, shape (n, 35).
            rewards: Scaled reward of the step that led to each state, shape (n,).
        """
        inputs = (states - self.offset) * self.scale
        return self.body(torch.cat([inputs, rewards[:, None]], dim=1)).squeeze(-1)


def mlp(widths: Sequence[int]) -> nn.Sequential:
    """Return linear layers with a ReLU between them; the last one begins near zero."""
    layers: list[nn.Module] = []
    for inputs, outputs in pairwise(widths):
        linear = nn.Linear(inputs, outputs)
        last = outputs == widths[-1] and len(layers) == 2 * (len(widths) - 2)
        nn.init.orthogonal_(linear.weight, gain=0.01 if last else 2**0.5)
        nn.init.zeros_(linear.bias)
        layers += [linear, nn.ReLU()]
    return nn.Sequential(*layers[:-1])


def _array(tensor: Tensor) -> np.ndarray[Any, np.dtype[np.float32]]:
    """Return a copy of a tensor's numbers."""
    return tensor.detach().numpy().astype(np.float32).copy()
