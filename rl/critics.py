"""Critics: values of states, or of actions in states; two side by side in one batched product."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal

import torch
from pydantic import BaseModel, ConfigDict, Field
from torch import Tensor, nn

from rl.networks import TermReader, linear_layers, outputs
from rl.spaces import ActionSpec, ObservationSpec


class ValueCritic(nn.Module):
    """Maps a state to a value, 35-200-200-1, or with another number beside it 36-200-200-1."""

    def __init__(self, observations: ObservationSpec, hidden: Sequence[int], beside: int) -> None:
        """Draw weights from torch's generator.

        Args:
            observations: Space of the observations.
            hidden: Width of each hidden layer.
            beside: Number of inputs beside the state: the reward that came with it (as printed), or
                the actions.
        """
        super().__init__()
        self.read = TermReader(observations, None)
        self.linear = linear_layers([observations.size + beside, *hidden, 1])

    def forward(self, states: Tensor, beside: Tensor) -> Tensor:
        """Return the values, shape (n,).

        Args:
            states: Observations in SI units, shape (n, n_observations).
            beside: Inputs beside them, as they are, shape (n, beside).
        """
        x = torch.cat([self.read(states), beside], dim=1)
        return outputs(x, self.linear).squeeze(1)


class Fusion(BaseModel):
    """How critics of actions bring state and action together.

    Equation 1 of Guo et al. adds a branch of the state without a bias and a branch of the action
    with one, ``W_s s + W_a a + b_a``. That is one layer over both side by side, whatever the
    weights: the two kinds differ in where the weights begin, not in what they can say.

    Attributes:
        kind: ``concatenation`` draws a layer over both within the bound of its inputs, n**-0.5;
            ``sum`` draws each branch within its own, so that two actions beside 44 values of a
            state begin almost five times as heavy (Eq. 1; the bounds are torch's own).
        layer: Index of the layer that the action enters: 0 beside the state itself (Eq. 1), 1
            beside the first hidden layer (GDAE).
        frozen: True if that layer stays as it was drawn (GDAE's public code, in which its weights
            get no gradient).
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["concatenation", "sum"] = "concatenation"
    layer: int = Field(default=0, ge=0)
    frozen: bool = False


class StackedCritic(nn.Module):
    """Several critics of one shape side by side: one batched product drives all through a layer.

    Hidden layers are normalised: without it the values of loops grow until the robot circles.
    """

    def __init__(
        self, count: int, layers: Sequence[tuple[int, int]], normalised: bool = True
    ) -> None:
        """Draw weights from torch's generator.

        Args:
            count: Number of critics.
            layers: Number of inputs and of outputs of each layer.
            normalised: False to leave hidden layers as they are (Fujimoto et al. 2018, GDAE).
        """
        super().__init__()
        self._normalised, self._fusion_layer = normalised, 0
        self.weights = nn.ParameterList()
        self.biases = nn.ParameterList()
        for inputs, width in layers:
            bound = inputs**-0.5
            self.weights.append(
                nn.Parameter(torch.empty(count, inputs, width).uniform_(-bound, bound))
            )
            self.biases.append(nn.Parameter(torch.empty(count, 1, width).uniform_(-bound, bound)))

    def _values(self, x: Tensor, actions: Tensor | None, count: int) -> Tensor:
        """Return the values of the first ``count`` critics, shape (count, n).

        Args:
            x: Inputs of the first layer, shape (n, inputs).
            actions: Actions from -1 to 1, which enter their layer, shape (n, n_actions).
            count: Number of critics.
        """
        last, is_all = len(self.weights) - 1, count == len(self.weights[0])
        for number, (weights, biases) in enumerate(zip(self.weights, self.biases, strict=True)):
            if actions is not None and number == self._fusion_layer:
                x = torch.cat([x, actions.expand(*x.shape[:-1], -1)], dim=-1)
            # A part of the critics costs a copy in the gradient; all of them none.
            own = (biases, weights) if is_all else (biases[:count], weights[:count])
            # The inputs of the first layer are the same for all critics.
            x = torch.baddbmm(own[0], x.expand(count, *x.shape[-2:]), own[1])
            if number < last:
                x = nn.functional.layer_norm(x, x.shape[-1:]) if self._normalised else x
                x = torch.relu(x)
        return x.squeeze(-1)


class TwinCritic(StackedCritic):
    """Two critics side by side, state and actions to a value: 36-200-200-1 each.

    The paper prints the reward as the 36th input; a value of an action needs the action there
    (assumption).
    """

    def __init__(
        self,
        observations: ObservationSpec,
        actions: ActionSpec,
        hidden: Sequence[int],
        terms: Sequence[str] | None = None,
        fusion: Fusion | None = None,
        normalised: bool = True,
    ) -> None:
        """Draw weights from torch's generator.

        Args:
            observations: Space of the observations.
            actions: Space of the actions.
            hidden: Width of each hidden layer.
            terms: Names of the terms that are read, None for all.
            fusion: Way in which state and action come together, None for the default.
            normalised: False to leave hidden layers as they are.

        Raises:
            ValueError: If there is no layer that the action could enter.
        """
        fusion = fusion or Fusion()
        read = TermReader(observations, terms)
        layers = list(pairwise([read.size, *hidden, 1]))
        if fusion.layer >= len(layers):
            raise ValueError(
                f"fusion.layer: expected 0 to {len(layers) - 1} with {len(hidden)} hidden layers, "
                f"got {fusion.layer}"
            )
        n_inputs, width = layers[fusion.layer]
        layers[fusion.layer] = n_inputs + actions.size, width
        super().__init__(2, layers, normalised)
        self.read = read
        self._fusion_layer = fusion.layer
        weights, biases = self.weights[fusion.layer], self.biases[fusion.layer]
        if fusion.kind == "sum":
            _draw_branches(weights, biases, n_inputs)
        weights.requires_grad_(not fusion.frozen)
        biases.requires_grad_(not fusion.frozen)

    def forward(self, states: Tensor, actions: Tensor) -> Tensor:
        """Return both critics' values, shape (2, n).

        Args:
            states: Observations in SI units, shape (n, n_observations).
            actions: Actions from -1 to 1, shape (n, n_actions).
        """
        return self._values(self.read(states), actions, 2)

    def first(self, states: Tensor, actions: Tensor) -> Tensor:
        """Return the first critic's values, shape (n,); arguments as for ``forward``."""
        return self._values(self.read(states), actions, 1).squeeze(0)


@torch.no_grad()
def _draw_branches(weights: Tensor, biases: Tensor, n_inputs: int) -> None:
    """Draw the two branches of a sum anew (Eq. 1), each within the bound of its own inputs.

    Args:
        weights: Weights of the layer, shape (count, n_inputs + n_actions, width).
        biases: Biases of the branch of the action, shape (count, 1, width).
        n_inputs: Number of inputs of the branch of the state.
    """
    state, action = n_inputs**-0.5, (weights.shape[1] - n_inputs) ** -0.5
    weights[:, :n_inputs].uniform_(-state, state)
    weights[:, n_inputs:].uniform_(-action, action)
    biases.uniform_(-action, action)


class StateCritic(StackedCritic):
    """Maps a state to its value, with the layers of ``TwinCritic``."""

    def __init__(
        self,
        observations: ObservationSpec,
        hidden: Sequence[int],
        terms: Sequence[str] | None = None,
        normalised: bool = True,
    ) -> None:
        """Draw weights from torch's generator; arguments as for ``TwinCritic``."""
        read = TermReader(observations, terms)
        super().__init__(1, list(pairwise([read.size, *hidden, 1])), normalised)
        self.read = read

    def forward(self, states: Tensor) -> Tensor:
        """Return the values of states, shape (n,).

        Args:
            states: Observations in SI units, shape (n, n_observations).
        """
        return self._values(self.read(states), None, 1).squeeze(0)
