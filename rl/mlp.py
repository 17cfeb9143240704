"""A multilayer perceptron as a policy, compiled: it runs without torch."""

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rl.policy import Tensors, policy_to_bytes
from rl.spaces import ActionSpec, ObservationSpec
from terrain.kernel import kernel

LOG_SIGMA = (-4.0, 0.5)
"""Bounds of the logarithm of the spread of explored actions, before tanh."""


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
class MlpPolicy:
    """A multilayer perceptron from observations to actions.

    Hidden layers are followed by a ReLU. The last layer gives the means of the actions, before
    tanh, and then the logarithms of their spread, which only exploration uses.

    Attributes:
        weights: ``layer<k>.weight``, float32, shape (outputs, inputs), and ``layer<k>.bias``,
            shape (outputs,), by name.
        observations: Space of its observations.
        actions: Space of its actions.
        info: Origin of the policy: config, commit, stage; ready for JSON.
    """

    weights: Tensors
    observations: ObservationSpec
    actions: ActionSpec
    info: dict[str, Any] = field(default_factory=dict)

    architecture = "mlp"

    def __post_init__(self) -> None:
        """Check that layers and spaces fit together."""
        count = len(self.weights) // 2
        names = {f"layer{k}.{part}" for k in range(count) for part in ("weight", "bias")}
        if not count or set(self.weights) != names:
            raise ValueError(f"layers: expected {sorted(names)}, got {sorted(self.weights)}")
        inputs = self.observations.size
        for k in range(count):
            weight, bias = self.weights[f"layer{k}.weight"], self.weights[f"layer{k}.bias"]
            if weight.ndim != 2 or weight.shape[1] != inputs or bias.shape != weight.shape[:1]:
                raise ValueError(
                    f"layer{k}: expected {inputs} inputs and a bias for each output, got weights "
                    f"{weight.shape} and biases {bias.shape}"
                )
            inputs = weight.shape[0]
        if inputs != 2 * self.actions.size:
            raise ValueError(
                "layers: expected mean and log sigma of each action as outputs "
                f"({2 * self.actions.size}), got {inputs}"
            )
        object.__setattr__(self, "_layers", self._compiled_layers(count))

    def _compiled_layers(self, count: int) -> Layers:
        """Return the layers with a row for each input."""
        weights = [self.weights[f"layer{k}.weight"] for k in range(count)]
        biases = [self.weights[f"layer{k}.bias"] for k in range(count)]
        return Layers(
            self.observations.scale(),
            tuple(np.ascontiguousarray(array.T) for array in weights),
            tuple(np.ascontiguousarray(array) for array in biases),
        )

    def _outputs(self, observation: NDArray[np.float32]) -> list[float]:
        """Return the means before tanh and the log sigmas."""
        layers: Layers = self._layers  # type: ignore[attr-defined]
        outputs: list[float] = forward(np.ascontiguousarray(observation), layers).tolist()
        return outputs

    def reset(self) -> None:
        """Nothing is remembered between steps: the observation holds all memory there is."""

    def best(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the best actions as shares from -1 to 1, shape (n_actions,)."""
        means = self._outputs(observation)[: self.actions.size]
        return np.array([math.tanh(mean) for mean in means])

    def explore(
        self, observation: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.float64]:
        """Return random actions around the best as shares from -1 to 1, shape (n_actions,)."""
        outputs, count = self._outputs(observation), self.actions.size
        shares = np.empty(count)
        for k in range(count):
            sigma = math.exp(min(max(outputs[count + k], LOG_SIGMA[0]), LOG_SIGMA[1]))
            shares[k] = math.tanh(outputs[k] + sigma * rng.standard_normal())
        return shares

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the actions for an observation in SI units, shape (n_actions,).

        Raises:
            ValueError: If the observation has another length or is not finite.
        """
        if observation.shape != (self.observations.size,):
            raise ValueError(
                f"observation: expected shape ({self.observations.size},), got {observation.shape}"
            )
        if not np.isfinite(observation).all():
            raise ValueError("observation: expected finite numbers, got NaN or infinity")
        return self.actions.scaled(self.best(observation))

    def tensors(self) -> Tensors:
        """Return the weights by name, for a file."""
        return dict(self.weights)

    def to_bytes(self) -> bytes:
        """Return the policy as a file's bytes."""
        return policy_to_bytes(self)


@kernel
def forward(observation: NDArray[np.float32], layers: Layers) -> NDArray[np.float32]:
    """Return the outputs of the last layer for one observation, float32, shape (outputs,).

    A sum is made in one order, whether one policy runs or many: BLAS would choose its own.
    """
    scale = layers.scale
    x = (scale[0] + scale[1] * observation) / (scale[2] + scale[3] * observation)
    for layer in range(len(layers.weights)):
        rows = layers.weights[layer]
        y = layers.biases[layer].copy()
        for i in range(len(x)):
            # Half of the hidden units are zero after a ReLU: their rows add nothing.
            if x[i] != 0.0:
                for j in range(len(y)):
                    y[j] += rows[i, j] * x[i]
        if layer < len(layers.weights) - 1:
            for j in range(len(y)):
                y[j] = max(y[j], np.float32(0.0))
        x = y
    return x
