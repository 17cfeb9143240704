"""Policies that price a fixed set of actions from crops of a map, compiled: they run without torch.

Each crop passes its own convolutions of stride 2; what is left of them and the other terms passes
dense layers to a price for every action, and the cheapest is driven.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rl.policies.mlp import dense
from rl.policy import Policy, Tensors, policy_to_bytes
from rl.spaces import ActionSpec, ObservationSpec
from terrain.kernel import kernel

TEMPERATURE = 0.5
"""Price by which an action is explored e times less often [s]."""

ACTIONS = "actions"
"""Name of the table of actions among the weights."""


class Convolutions(NamedTuple):
    """Convolutions of one crop for the compiled pass.

    Attributes:
        weights: Weights of each, float32, shape (k, k, inputs, outputs).
        biases: Biases of each, float32, shape (outputs,).
    """

    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]


def crop_terms(observations: ObservationSpec) -> tuple[str, ...]:
    """Return the names of the terms that are crops: those of three dimensions."""
    return tuple(term.name for term in observations.terms if len(term.shape) == 3)


def number_terms(observations: ObservationSpec) -> tuple[str, ...]:
    """Return the names of the other terms."""
    return tuple(term.name for term in observations.terms if len(term.shape) != 3)


@dataclass(frozen=True)
class CropPricesPolicy:
    """A network from crops of a map and some numbers to prices of actions.

    Attributes:
        weights: ``actions``, shares of the actions from -1 to 1, float32, shape (a, n_actions);
            ``<crop>.<k>.weight``, shape (outputs, inputs, edge, edge), ``layer<k>.weight``, shape
            (outputs, inputs), and their ``.bias``, by name.
        observations: Space of its observations.
        actions: Space of its actions.
        info: Origin of the policy: config, commit, stage; ready for JSON.
        terms: Names of the terms that are read, None for all.
    """

    weights: Tensors
    observations: ObservationSpec
    actions: ActionSpec
    info: dict[str, Any] = field(default_factory=dict)
    terms: tuple[str, ...] | None = None

    architecture = "crop_prices"

    def __post_init__(self) -> None:
        """Check that layers and spaces fit together."""
        read = self.observations
        if self.terms is not None:
            read = read.only(self.terms)
        crops, numbers = crop_terms(read), number_terms(read)
        if not crops or not numbers:
            raise ValueError(
                f"observations: expected crops and other terms, got {crops} and {numbers}"
            )
        inputs = self.observations.only(numbers).size
        convolutions = []
        for name in crops:
            layers, outputs = self._convolutions(name)
            convolutions.append(layers)
            inputs += outputs
        count = sum(name.startswith("layer") for name in self.weights) // 2
        self._check_dense(count, inputs)
        names = [f"layer{k}" for k in range(count)]
        transposed = tuple(np.ascontiguousarray(self.weights[f"{name}.weight"].T) for name in names)
        biases = tuple(self.weights[f"{name}.bias"] for name in names)
        object.__setattr__(self, "_convolved", tuple(zip(crops, convolutions, strict=True)))
        object.__setattr__(self, "_dense", (transposed, biases))
        object.__setattr__(self, "_columns", self.observations.columns(numbers))
        object.__setattr__(self, "_scale", self.observations.only(numbers).scale())

    def _convolutions(self, crop: str) -> tuple[Convolutions, int]:
        """Return the convolutions of a crop, and the number of values that they leave.

        Raises:
            ValueError: If one is missing or of another shape.
        """
        channels, rows, columns = self.observations.term(crop).shape
        prefix = f"{crop}."
        count = sum(name.startswith(prefix) for name in self.weights) // 2
        weights, biases = [], []
        for k in range(count):
            weight = self.weights.get(f"{crop}.{k}.weight", np.empty(0, dtype=np.float32))
            bias = self.weights.get(f"{crop}.{k}.bias", np.empty(0, dtype=np.float32))
            edge = weight.shape[-1] if weight.ndim == 4 else 0
            if weight.shape != (len(bias), channels, edge, edge) or edge % 2 == 0:
                raise ValueError(
                    f"{crop}.{k}: expected weights (outputs, {channels}, odd, odd), a bias for "
                    f"each output, got {weight.shape} and {bias.shape}"
                )
            weights.append(np.ascontiguousarray(weight.transpose(2, 3, 1, 0)))
            biases.append(bias)
            channels, rows, columns = len(bias), (rows + 1) // 2, (columns + 1) // 2
        if not count:
            raise ValueError(f"{crop}: expected convolutions, got none")
        return Convolutions(tuple(weights), tuple(biases)), channels * rows * columns

    def _check_dense(self, count: int, inputs: int) -> None:
        """Refuse dense layers that do not fit.

        Raises:
            ValueError: If one is missing or of another shape, or actions are not prices' ones.
        """
        table = self.weights.get(ACTIONS, np.empty(0, dtype=np.float32))
        if table.ndim != 2 or table.shape[1] != self.actions.size or not len(table):
            raise ValueError(
                f"actions: expected shape (actions, {self.actions.size}), got {table.shape}"
            )
        for k in range(count):
            weight = self.weights.get(f"layer{k}.weight", np.empty(0, dtype=np.float32))
            bias = self.weights.get(f"layer{k}.bias", np.empty(0, dtype=np.float32))
            if weight.shape != (len(bias), inputs):
                raise ValueError(
                    f"layer{k}: expected {inputs} inputs and a bias for each output, got weights "
                    f"{weight.shape} and biases {bias.shape}"
                )
            inputs = len(bias)
        if not count or inputs != len(table):
            raise ValueError(f"layers: expected {len(table)} prices as outputs, got {inputs}")

    def prices(self, observation: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the price of each action [s], less than another's if it is better, shape (a,).

        Raises:
            ValueError: If the observation has another length or is not finite.
        """
        if observation.shape != (self.observations.size,):
            raise ValueError(
                f"observation: expected shape ({self.observations.size},), got {observation.shape}"
            )
        if not np.isfinite(observation).all():
            raise ValueError("observation: expected finite numbers, got NaN or infinity")
        parts = [
            convolved(self._crop(observation, name), layers)
            for name, layers in self._convolved  # type: ignore[attr-defined]
        ]
        a, b, c, d = self._scale  # type: ignore[attr-defined]
        numbers = observation[self._columns]  # type: ignore[attr-defined]
        parts.append((a + b * numbers) / (c + d * numbers))
        weights, biases = self._dense  # type: ignore[attr-defined]
        return dense(np.concatenate(parts), weights, biases)

    def _crop(self, observation: NDArray[np.float32], name: str) -> NDArray[np.float32]:
        """Return a crop of an observation, shape (channels, rows, columns)."""
        flat = observation[self.observations.slice_of(name)]
        return np.ascontiguousarray(flat).reshape(self.observations.term(name).shape)

    def reset(self) -> None:
        """Nothing is remembered between steps: the map holds all memory there is."""

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the cheapest action for an observation in SI units, shape (n_actions,)."""
        return self.actions.scaled(self.best(observation))

    def best(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the cheapest action as shares from -1 to 1, shape (n_actions,)."""
        cheapest = int(np.argmin(self.prices(observation)))
        return self.weights[ACTIONS][cheapest].astype(np.float64)

    def explore(
        self, observation: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.float64]:
        """Return a random action as shares from -1 to 1, the cheaper the likelier."""
        prices = self.prices(observation).astype(np.float64)
        odds = np.exp((prices.min() - prices) / TEMPERATURE)
        drawn = rng.choice(len(odds), p=odds / odds.sum())
        return self.weights[ACTIONS][drawn].astype(np.float64)

    def best_many(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return ``best`` of each row, shape (n, n_actions)."""
        return np.array([self.best(row) for row in observations])

    def explore_many(
        self, observations: NDArray[np.float32], rngs: Sequence[np.random.Generator]
    ) -> NDArray[np.float64]:
        """Return ``explore`` of each row and its generator, shape (n, n_actions)."""
        pairs = zip(observations, rngs, strict=True)
        return np.array([self.explore(row, rng) for row, rng in pairs])

    def tensors(self) -> Tensors:
        """Return the weights by name, for a file."""
        return dict(self.weights)

    def to_bytes(self) -> bytes:
        """Return the policy as a file's bytes."""
        policy: Policy = self
        return policy_to_bytes(policy)


@kernel
def convolved(crop: NDArray[np.float32], layers: Convolutions) -> NDArray[np.float32]:
    """Return what is left of a crop after its convolutions, each with a ReLU, flattened.

    Args:
        crop: Crop, float32, shape (channels, rows, columns).
        layers: Convolutions of stride 2 with half their edge of zeros around.
    """
    x = crop
    for k in range(len(layers.weights)):
        x = _convolve(x, layers.weights[k], layers.biases[k])
    return x.ravel()


@kernel
def _convolve(
    x: NDArray[np.float32], weights: NDArray[np.float32], biases: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return one convolution and its ReLU, shape (outputs, rows / 2, columns / 2).

    What each output sees is laid out as a row, so that one matrix product does the sums.
    """
    channels, rows, columns = x.shape
    edge, outputs = len(weights), len(biases)
    height, width, pad = (rows + 1) // 2, (columns + 1) // 2, edge // 2
    seen = np.zeros((edge * edge * channels, height * width), dtype=np.float32)
    for u in range(edge):
        for v in range(edge):
            for c in range(channels):
                row = seen[(u * edge + v) * channels + c]
                for i in range(height):
                    p = 2 * i + u - pad
                    if not 0 <= p < rows:
                        continue
                    for j in range(width):
                        q = 2 * j + v - pad
                        if 0 <= q < columns:
                            row[i * width + j] = x[c, p, q]
    y = np.dot(weights.reshape(-1, outputs).T, seen)
    for out in range(outputs):
        y[out] = np.maximum(y[out] + biases[out], np.float32(0.0))
    return y.reshape(outputs, height, width)
