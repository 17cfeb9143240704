"""Network that prices actions from crops of a map, to be fitted to a teacher's prices."""

from itertools import pairwise
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from rl.networks import TermReader
from rl.policies.crop_prices import ACTIONS, CropPricesPolicy, crop_terms, number_terms
from rl.policy import Policy
from rl.spaces import ActionSpec, ObservationSpec

_CHANNELS = (16, 24, 32)
"""Outputs of each convolution."""

_EDGES = (3, 3, 3)
"""Edges of each convolution."""


class CropActor(nn.Module):
    """Prices of a fixed set of actions from crops and numbers."""

    def __init__(
        self,
        observations: ObservationSpec,
        actions: ActionSpec,
        table: NDArray[np.float32],
        hidden: tuple[int, ...] = (128, 128),
        terms: tuple[str, ...] | None = None,
    ) -> None:
        """Draw fresh weights.

        Args:
            observations: Space of the observations; terms of three dimensions are crops.
            actions: Space of the actions.
            table: Actions as shares from -1 to 1, shape (a, n_actions).
            hidden: Widths of the dense layers.
            terms: Names of the terms that are read, None for all.
        """
        super().__init__()
        self._observations, self._actions, self._table = observations, actions, table
        self._terms = terms
        read = observations if terms is None else observations.only(terms)
        self._crops = crop_terms(read)
        self.numbers = TermReader(observations, number_terms(read))
        self.convolutions = nn.ModuleDict()
        inputs = self.numbers.size
        for name in self._crops:
            channels, rows, columns = observations.term(name).shape
            layers = nn.ModuleList()
            for outputs, edge in zip(_CHANNELS, _EDGES, strict=True):
                layers.append(nn.Conv2d(channels, outputs, edge, stride=2, padding=edge // 2))
                channels, rows, columns = outputs, (rows + 1) // 2, (columns + 1) // 2
            self.convolutions[name] = layers
            inputs += channels * rows * columns
        widths = (inputs, *hidden, len(table))
        self.layers = nn.ModuleList(nn.Linear(before, after) for before, after in pairwise(widths))

    def forward(self, states: Tensor) -> Tensor:
        """Return the price of each action, shape (n, a).

        Args:
            states: Observations in SI units, shape (n, n_observations).
        """
        parts = []
        for name in self._crops:
            shape = self._observations.term(name).shape
            x = states[:, self._observations.slice_of(name)].reshape(len(states), *shape)
            for layer in self._convolutions_of(name):
                x = torch.relu(layer(x))
            parts.append(x.flatten(1))
        parts.append(self.numbers(states))
        x = torch.cat(parts, dim=1)
        for layer in self.layers[:-1]:
            x = torch.relu(layer(x))
        prices: Tensor = self.layers[-1](x)
        return prices

    def load(self, policy: Policy) -> None:
        """Take the weights of a policy of the same layers."""
        weights = policy.tensors()
        own: dict[str, nn.Module] = {}
        for name in self._crops:
            own |= {f"{name}.{k}": layer for k, layer in enumerate(self._convolutions_of(name))}
        own |= {f"layer{k}": layer for k, layer in enumerate(self.layers)}
        with torch.no_grad():
            for name, layer in own.items():
                for part, tensor in layer.named_parameters():
                    tensor.copy_(torch.from_numpy(weights[f"{name}.{part}"]))

    def _convolutions_of(self, name: str) -> nn.ModuleList:
        """Return the convolutions of a crop."""
        layers = self.convolutions[name]
        assert isinstance(layers, nn.ModuleList)
        return layers

    def policy(self, info: dict[str, Any]) -> Policy:
        """Return the network as a policy that runs without torch."""
        weights = {ACTIONS: np.array(self._table, dtype=np.float32)}
        for name in self._crops:
            for k, layer in enumerate(self._convolutions_of(name)):
                weights |= _arrays(f"{name}.{k}", layer)
        for k, layer in enumerate(self.layers):
            weights |= _arrays(f"layer{k}", layer)
        return CropPricesPolicy(weights, self._observations, self._actions, info, self._terms)


def _arrays(name: str, layer: nn.Module) -> dict[str, NDArray[np.float32]]:
    """Return weight and bias of a layer by their names in a file."""
    return {
        f"{name}.{part}": tensor.detach().cpu().numpy().copy()
        for part, tensor in layer.named_parameters()
    }
