"""A policy that reads a set of points of any number, compiled: it runs without torch.

It follows the actor of Zhang et al., "Support-point based navigation" (arXiv 2010.10209), Eq. 1:
``h_i = lrelu(W1 p_i + b1) * sigmoid(W2 g + b2)`` for each point p_i, a layer to K features, the
maximum of each over all points, and two layers on the features and g. The order of the points,
copies of points and masked points never change an action.
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rl.policies.gaussian import GaussianPolicy
from rl.policies.mlp import dense
from rl.policies.point_features import (
    MASK,
    POINTS,
    UNROLLED,
    PointLayers,
    PointLayout,
    global_features,
    point_layout,
)
from rl.policy import Tensors
from rl.spaces import ActionSpec, ObservationSpec
from terrain.kernel import kernel

GOAL_TERMS = ("goal", "velocity")
"""Names of the terms that make up g, the goal and the velocities, by default."""

_POINT_WEIGHTS = tuple(
    f"{layer}.{part}" for layer in ("point", "gate", "feature") for part in ("weight", "bias")
)


class Head(NamedTuple):
    """Layers that take g, and the layers on top of the features.

    Attributes:
        columns: Columns of g in the observation, shape (G,).
        scale: Numbers a, b, c, d of g, float32, shape (4, G); see ``ObservationSpec.scale``.
        gate_weights: W2 as the only one of its tuple, float32, shape (G, H).
        gate_biases: b2 as the only one of its tuple, float32, shape (H,).
        weights: Weights of each layer on top, float32, shape (inputs, outputs).
        biases: Biases of each layer on top, float32, shape (outputs,).
    """

    columns: NDArray[np.intp]
    scale: NDArray[np.float32]
    gate_weights: tuple[NDArray[np.float32], ...]
    gate_biases: tuple[NDArray[np.float32], ...]
    weights: tuple[NDArray[np.float32], ...]
    biases: tuple[NDArray[np.float32], ...]


def goal_terms(terms: tuple[str, ...] | None) -> tuple[str, ...]:
    """Return the names of the terms that make up g: those that are read besides the points."""
    names = GOAL_TERMS if terms is None else terms
    return tuple(name for name in names if name not in (POINTS, MASK))


@dataclass(frozen=True)
class PointSetPolicy(GaussianPolicy):
    """A network from a set of points, the goal and the velocities to actions.

    The terms ``points``, shape (n, 2), and ``mask``, shape (n,), are read by their names; without
    a mask all points count. Where none counts the action is that for a single point infinitely far
    away: open space. Points are taken as they are, g is scaled as ``ObservationSpec.scale`` says.

    Attributes:
        weights: ``point``, ``gate``, ``feature`` and ``layer<k>``, each with ``.weight``, float32,
            shape (outputs, inputs), and ``.bias``, shape (outputs,), by name. The last layer gives
            the means of the actions, before tanh, and the logarithms of their spread.
        observations: Space of its observations, for one number of points.
        actions: Space of its actions.
        info: Origin of the policy: config, commit, stage; ready for JSON.
        terms: Names of the terms that make up g, None for ``GOAL_TERMS``.
    """

    weights: Tensors
    observations: ObservationSpec
    actions: ActionSpec
    info: dict[str, Any] = field(default_factory=dict)
    terms: tuple[str, ...] | None = None

    architecture = "point_set"

    def __post_init__(self) -> None:
        """Check that layers and spaces fit together."""
        read = self.observations.only(goal_terms(self.terms))
        count = (len(self.weights) - len(_POINT_WEIGHTS)) // 2
        self._check_weights(read.size, count)
        names = [f"layer{k}" for k in range(count)]
        head = Head(
            self.observations.columns(goal_terms(self.terms)),
            read.scale(),
            (self._transposed("gate"),),
            (self.weights["gate.bias"],),
            tuple(self._transposed(name) for name in names),
            tuple(self.weights[f"{name}.bias"] for name in names),
        )
        layers = PointLayers(
            *(self.weights[f"{layer}.{part}"] for layer, part in _pairs("point", "feature"))
        )
        object.__setattr__(self, "_layout", point_layout(self.observations))
        object.__setattr__(self, "_layers", layers)
        object.__setattr__(self, "_head", head)

    def _transposed(self, layer: str) -> NDArray[np.float32]:
        """Return a layer's weights with a row for each input."""
        return np.ascontiguousarray(self.weights[f"{layer}.weight"].T)

    def _check_weights(self, goal_size: int, count: int) -> None:
        """Refuse layers that do not fit the spaces.

        Raises:
            ValueError: If a layer is missing, unknown or of another shape.
        """
        names = {*_POINT_WEIGHTS, *(f"layer{k}.{part}" for k, part in _pairs(*range(count)))}
        if count < 1 or set(self.weights) != names:
            raise ValueError(f"layers: expected {sorted(names)}, got {sorted(self.weights)}")
        width, n_features = (len(self.weights[f"{name}.weight"]) for name in ("point", "feature"))
        if width % UNROLLED:
            raise ValueError(f"point.weight: expected a multiple of {UNROLLED} rows, got {width}")
        expected = {"point": (width, 2), "gate": (width, goal_size), "feature": (n_features, width)}
        inputs = n_features + goal_size
        for k in range(count):
            outputs = len(self.weights[f"layer{k}.weight"])
            expected[f"layer{k}"] = (
                2 * self.actions.size if k == count - 1 else outputs,
                inputs,
            )
            inputs = outputs
        for layer, shape in expected.items():
            weight, bias = self.weights[f"{layer}.weight"], self.weights[f"{layer}.bias"]
            if weight.shape != shape or bias.shape != shape[:1]:
                raise ValueError(
                    f"{layer}: expected weights {shape} and biases {shape[:1]}, got "
                    f"{weight.shape} and {bias.shape}"
                )

    def _outputs(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return means before tanh and log sigmas, shape (n, 2 n_actions)."""
        return self._forward(observations)[0]

    def _forward(
        self, observations: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Return the outputs of the last layer and the selected points, a row an observation."""
        layout: PointLayout = self._layout  # type: ignore[attr-defined]
        layers: PointLayers = self._layers  # type: ignore[attr-defined]
        head: Head = self._head  # type: ignore[attr-defined]
        return forward(observations, layout, layers, head)

    def support_points(self, observation: NDArray[np.float32]) -> NDArray[np.int32]:
        """Return the index of the point that gives each of the K features, shape (K,).

        One point may give several features; of equal points it is the first, and -1 where no point
        counts.

        Raises:
            ValueError: If the observation has another length or is not finite.
        """
        self._check(observation)
        return self._forward(np.ascontiguousarray(observation[None]))[1][0]


def _pairs(*layers: str | int) -> list[tuple[str | int, str]]:
    """Return each layer with ``weight`` and ``bias``."""
    return [(layer, part) for layer in layers for part in ("weight", "bias")]


@kernel
def forward(
    observations: NDArray[np.float32], layout: PointLayout, layers: PointLayers, head: Head
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Return the outputs of the last layer, (n, outputs), and the selected points, (n, K)."""
    rows, scale = len(observations), head.scale
    n_features, width = layers.feature_weight.shape
    goals = np.empty((rows, len(head.columns)), dtype=np.float32)
    gates = np.empty((rows, width), dtype=np.float32)
    for row in range(rows):
        for k in range(len(head.columns)):
            value = observations[row, head.columns[k]]
            goals[row, k] = (scale[0, k] + scale[1, k] * value) / (
                scale[2, k] + scale[3, k] * value
            )
        before = dense(goals[row], head.gate_weights, head.gate_biases)
        for h in range(width):
            gates[row, h] = np.float32(1.0) / (np.float32(1.0) + np.exp(-before[h]))
    features, selected = global_features(observations, layout, layers, gates)
    outputs = np.empty((rows, len(head.biases[-1])), dtype=np.float32)
    x = np.empty(n_features + goals.shape[1], dtype=np.float32)
    for row in range(rows):
        x[:n_features], x[n_features:] = features[row], goals[row]
        outputs[row] = dense(x, head.weights, head.biases)
    return outputs, selected
