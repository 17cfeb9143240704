"""Multilayer perceptrons as policies, compiled: they run without torch."""

from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rl.policies.gaussian import GaussianPolicy
from rl.policies.squashed import SquashedPolicy
from rl.policy import Tensors
from rl.spaces import ActionSpec, ObservationSpec
from terrain.kernel import kernel


class Layers(NamedTuple):
    """Weights of all layers for the compiled pass.

    Attributes:
        scale: Numbers a, b, c, d of the input, float32, shape (4, n); see ``ObservationSpec``.
        weights: Weights of each layer, float32, shape (inputs, outputs).
        biases: Biases of each layer, float32, shape (outputs,).
    """

    scale: NDArray[np.float32]
    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]


@dataclass(frozen=True)
class PerceptronPolicy(SquashedPolicy):
    """A multilayer perceptron from observations to actions.

    Hidden layers are followed by a ReLU. The last layer gives the actions before tanh, and whatever
    else ``outputs_per_action`` names.

    Attributes:
        weights: ``layer<k>.weight``, float32, shape (outputs, inputs), and ``layer<k>.bias``,
            shape (outputs,), by name.
        observations: Space of its observations.
        actions: Space of its actions.
        info: Origin of the policy: config, commit, stage; ready for JSON.
        terms: Names of the terms that are its inputs, None for all.
        outputs_per_action: Names of the outputs for each action, first all of the first name.
    """

    outputs_per_action: ClassVar[tuple[str, ...]]

    weights: Tensors
    observations: ObservationSpec
    actions: ActionSpec
    info: dict[str, Any] = field(default_factory=dict)
    terms: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        """Check that layers and spaces fit together."""
        count = len(self.weights) // 2
        names = {f"layer{k}.{part}" for k in range(count) for part in ("weight", "bias")}
        if not count or set(self.weights) != names:
            raise ValueError(f"layers: expected {sorted(names)}, got {sorted(self.weights)}")
        read = self.observations if self.terms is None else self.observations.only(self.terms)
        inputs = read.size
        for k in range(count):
            weight, bias = self.weights[f"layer{k}.weight"], self.weights[f"layer{k}.bias"]
            if weight.ndim != 2 or weight.shape[1] != inputs or bias.shape != weight.shape[:1]:
                raise ValueError(
                    f"layer{k}: expected {inputs} inputs and a bias for each output, got weights "
                    f"{weight.shape} and biases {bias.shape}"
                )
            inputs = weight.shape[0]
        outputs = len(self.outputs_per_action) * self.actions.size
        if inputs != outputs:
            raise ValueError(
                f"layers: expected {' and '.join(self.outputs_per_action)} of each action as "
                f"outputs ({outputs}), got {inputs}"
            )
        columns = None if self.terms is None else self.observations.columns(self.terms)
        object.__setattr__(self, "_columns", columns)
        object.__setattr__(self, "_layers", self._compiled_layers(read, count))

    def _compiled_layers(self, read: ObservationSpec, count: int) -> Layers:
        """Return the layers with a row for each input."""
        weights = [self.weights[f"layer{k}.weight"] for k in range(count)]
        biases = [self.weights[f"layer{k}.bias"] for k in range(count)]
        return Layers(
            read.scale(),
            tuple(np.ascontiguousarray(array.T) for array in weights),
            tuple(np.ascontiguousarray(array) for array in biases),
        )

    def _outputs(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the outputs of the last layer, a row an observation."""
        columns: NDArray[np.intp] | None = self._columns  # type: ignore[attr-defined]
        layers: Layers = self._layers  # type: ignore[attr-defined]
        read = observations if columns is None else observations.take(columns, axis=1)
        return forward(read, layers)


@dataclass(frozen=True)
class MlpPolicy(PerceptronPolicy, GaussianPolicy):
    """A multilayer perceptron that gives the means of the actions and the logs of their spread.

    Only exploration uses the spread. Attributes are those of ``PerceptronPolicy``.
    """

    architecture = "mlp"
    outputs_per_action = ("mean", "log sigma")


@kernel
def forward(observations: NDArray[np.float32], layers: Layers) -> NDArray[np.float32]:
    """Return the outputs of the last layer for each observation, float32, shape (n, outputs)."""
    scale = layers.scale
    outputs = np.empty((len(observations), len(layers.biases[-1])), dtype=np.float32)
    for row in range(len(observations)):
        observation = observations[row]
        x = (scale[0] + scale[1] * observation) / (scale[2] + scale[3] * observation)
        outputs[row] = dense(x, layers.weights, layers.biases)
    return outputs


@kernel
def dense(
    x: NDArray[np.float32],
    weights: tuple[NDArray[np.float32], ...],
    biases: tuple[NDArray[np.float32], ...],
) -> NDArray[np.float32]:
    """Return the outputs of the last of several layers for one input, float32, shape (outputs,).

    A sum is made in one order, whether one policy runs or many: BLAS would choose its own.

    Args:
        x: Input, float32, shape (inputs,).
        weights: Weights of each layer, float32, shape (inputs, outputs).
        biases: Biases of each layer, float32, shape (outputs,).
    """
    for layer in range(len(weights)):
        rows = weights[layer]
        y = biases[layer].copy()
        for i in range(len(x)):
            # Half of the hidden units are zero after a ReLU: their rows add nothing.
            if x[i] != 0.0:
                for j in range(len(y)):
                    y[j] += rows[i, j] * x[i]
        if layer < len(weights) - 1:
            for j in range(len(y)):
                y[j] = max(y[j], np.float32(0.0))
        x = y
    return x
