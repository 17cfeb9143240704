"""The actor on a set of points in torch, with an exact gradient through the selected points alone.

See ``rl.policies.point_set`` for the network. The maxima over all points are found by a compiled
kernel without a graph, and the gradient goes through the K selected points of each observation: the
same numbers as those of the dense graph for a fraction of its time.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from rl.networks import (
    SquashedGaussianActor,
    TermReader,
    as_array,
    layer_weights,
    linear_layers,
    mean_and_sigma,
)
from rl.policies.point_features import (
    SLOPE,
    PointLayers,
    PointLayout,
    feature_gradients,
    global_features,
    point_layout,
)
from rl.policies.point_set import PointSetPolicy, goal_terms
from rl.spaces import ActionSpec, ObservationSpec


class PointSetActor(SquashedGaussianActor):
    """Maps a set of points, the goal and the velocities to squashed normal distributions."""

    def __init__(
        self,
        observations: ObservationSpec,
        actions: ActionSpec,
        hidden: Sequence[int],
        terms: Sequence[str] | None = None,
        width: int = 64,
        n_features: int = 20,
    ) -> None:
        """Draw weights from torch's generator.

        Args:
            observations: Space of the observations, with ``points`` and perhaps ``mask``.
            actions: Space of the actions.
            hidden: Width of each layer between the features and the output (paper: two layers).
            terms: Names of the terms that make up g, None for ``rl.policies.point_set.GOAL_TERMS``.
            width: Number H of hidden units of a point, a multiple of 8 (assumption).
            n_features: Number K of features (paper: 2 to 50, 20 did best).
        """
        super().__init__()
        self._observations, self._actions = observations, actions
        self._terms = None if terms is None else goal_terms(tuple(terms))
        self._layout = point_layout(observations)
        self.read = TermReader(observations, goal_terms(self._terms))
        self.point = nn.Linear(2, width)
        self.gate = nn.Linear(self.read.size, width)
        self.feature = nn.Linear(width, n_features)
        self.linear = linear_layers([n_features + self.read.size, *hidden, 2 * actions.size])

    def forward(self, states: Tensor) -> tuple[Tensor, Tensor]:
        """Return means before tanh and sigmas, shape (n, n_actions).

        Args:
            states: Observations in SI units, shape (n, n_observations).
        """
        goals = self.read(states)
        gates = torch.sigmoid(self.gate(goals))
        return mean_and_sigma(torch.cat([self.features(states, gates), goals], 1), self.linear)

    def features(self, states: Tensor, gates: Tensor) -> Tensor:
        """Return the K features of each observation, shape (n, K).

        Args:
            states: Observations in SI units, shape (n, n_observations).
            gates: Gates of the hidden units, shape (n, H).
        """
        if states.device.type != "cpu":
            return self._dense_features(states, gates)
        layers = (
            self.point.weight,
            self.point.bias,
            self.feature.weight,
            self.feature.bias,
        )
        features: Tensor = _SelectedPoints.apply(states, self._layout, gates, *layers)
        return features

    def _dense_features(self, states: Tensor, gates: Tensor) -> Tensor:
        """Return the same with a graph over all points: for devices without the kernel."""
        at, n = self._layout.points, self._layout.size
        points = states[:, at : at + 2 * n].unflatten(1, (n, 2))
        counts = torch.ones_like(points[..., 0], dtype=torch.bool)
        if self._layout.mask >= 0:
            counts = states[:, self._layout.mask : self._layout.mask + n] > 0.5
        # Where no point counts there is one infinitely far away.
        is_empty = ~counts.any(dim=1, keepdim=True)
        points = points.masked_fill(is_empty[..., None], 0.0)
        hidden = nn.functional.leaky_relu(self.point(points), SLOPE) * gates[:, None]
        features = self.feature(hidden)
        return features.masked_fill(~(counts | is_empty)[..., None], -torch.inf).amax(dim=1)

    def policy(self, info: dict[str, Any]) -> PointSetPolicy:
        """Return the actor as a policy that runs without torch.

        Args:
            info: Origin of the policy, ready for JSON.
        """
        weights = layer_weights(self.linear)
        for name in ("point", "gate", "feature"):
            layer = getattr(self, name)
            weights[f"{name}.weight"] = as_array(layer.weight)
            weights[f"{name}.bias"] = as_array(layer.bias)
        return PointSetPolicy(weights, self._observations, self._actions, info, self._terms)


class _SelectedPoints(torch.autograd.Function):
    """Features of sets of points; the gradient goes through the selected points."""

    @staticmethod
    def forward(
        ctx: Any,  # noqa: ANN401 - as in torch.
        states: Tensor,
        layout: PointLayout,
        gates: Tensor,
        *layers: Tensor,
    ) -> Tensor:
        """Return the features, shape (n, K), and keep which points gave them."""
        observations, array = states.contiguous(), PointLayers(*(_array(one) for one in layers))
        features, selected = global_features(_array(observations), layout, array, _array(gates))
        ctx.save_for_backward(observations, gates, *layers)
        ctx.layout, ctx.selected = layout, selected
        return torch.from_numpy(features)

    @staticmethod
    def backward(
        ctx: Any,  # noqa: ANN401 - as in torch.
        *outer: Tensor,
    ) -> tuple[Tensor | None, ...]:
        """Return the gradients of gates and layers."""
        observations, gates, *layers = (_array(tensor) for tensor in ctx.saved_tensors)
        gradients = feature_gradients(
            observations, ctx.layout, PointLayers(*layers), gates, ctx.selected, _array(outer[0])
        )
        return (None, None, *(torch.from_numpy(gradient) for gradient in gradients))


def _array(tensor: Tensor) -> NDArray[np.float32]:
    """Return a tensor's own memory, or a copy where it is not contiguous."""
    array: NDArray[np.float32] = tensor.detach().contiguous().numpy()
    return array
