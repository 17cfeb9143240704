"""A trained actor, complete: layout, scaling, limits, weights. Runs without torch."""

import json
import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from andabata.machine.kinematics import apply_dead_zone
from rl.spaces import ObservationLayout
from terrain.kernel import kernel

_FORMAT = "andabata-policy"
_VERSION = 2  # 1 had straight ranges.
_MAX_BYTES = 64 << 20

Layer = tuple[NDArray[np.float32], NDArray[np.float32]]


class PolicyFileError(ValueError):
    """A file that is not a policy."""


@dataclass(frozen=True)
class Policy:
    """A multilayer perceptron from states to steering.

    Attributes:
        layers: Weights, float32, shape (outputs, inputs), and biases, shape (outputs,), of each
            layer; hidden layers are followed by a ReLU. The last gives the mean of the actions,
            before tanh, and the logarithm of their spread, which only exploration uses.
        max_range: Largest range of the state [m].
        limit: Yaw rate at an output of 1 [rad/s].
        dead_zone: Yaw rates below this are zero [rad/s].
        info: How it was trained: config, commit, stage; ready for JSON.
    """

    layers: tuple[Layer, ...]
    max_range: float
    limit: float
    dead_zone: float
    info: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the layers fit together."""
        for (before, _), (after, _) in zip(self.layers, self.layers[1:], strict=False):
            if after.shape[1] != before.shape[0]:
                raise ValueError(
                    f"layers: expected {before.shape[0]} inputs after {before.shape[0]} outputs, "
                    f"got {after.shape[1]}"
                )
        if self.layers[-1][0].shape[0] != 2:
            outputs = self.layers[-1][0].shape[0]
            raise ValueError(f"layers: expected mean and log sigma as outputs, got {outputs}")
        object.__setattr__(self, "_scale", self.layout.scale(self.limit))
        columns = tuple(np.ascontiguousarray(weights.T) for weights, _ in self.layers)
        biases = tuple(np.ascontiguousarray(biases) for _, biases in self.layers)
        object.__setattr__(self, "_columns", (columns, biases))

    @property
    def layout(self) -> ObservationLayout:
        """The state that the policy takes."""
        return ObservationLayout(self.layers[0][0].shape[1] - 3)

    def _outputs(self, state: NDArray[np.float32]) -> tuple[float, float]:
        """Return the mean before tanh and the log sigma."""
        weights, biases = self._columns  # type: ignore[attr-defined]
        mean, log_sigma = _forward(np.ascontiguousarray(state), self._scale, weights, biases)  # type: ignore[attr-defined]
        return mean, log_sigma

    def explore(self, state: NDArray[np.float32], rng: np.random.Generator) -> float:
        """Return a random action for a state, -1 to 1, before the dead zone."""
        mean, log_sigma = self._outputs(state)
        sigma = math.exp(min(max(log_sigma, -4.0), 0.5))
        return math.tanh(mean + sigma * rng.standard_normal())

    def act(self, state: NDArray[np.float32]) -> float:
        """Return the steering for a state [rad/s].

        Args:
            state: As ``rl.spaces.observation`` makes it, float32, shape (n + 3,).

        Raises:
            ValueError: If the state has another length or is not finite.
        """
        if state.shape != (self.layout.size,):
            raise ValueError(f"state: expected shape ({self.layout.size},), got {state.shape}")
        if not np.isfinite(state).all():
            raise ValueError("state: expected finite numbers, got NaN or infinity")
        mean, _ = self._outputs(state)
        return apply_dead_zone(self.limit * math.tanh(mean), self.dead_zone)

    def to_bytes(self) -> bytes:
        """Return the policy as safetensors with its description in the metadata."""
        from safetensors.numpy import save

        tensors = {}
        for number, (weights, biases) in enumerate(self.layers):
            tensors[f"layer{number}.weight"] = np.ascontiguousarray(weights)
            tensors[f"layer{number}.bias"] = np.ascontiguousarray(biases)
        about = {
            "format": _FORMAT,
            "version": _VERSION,
            "max_range": self.max_range,
            "limit": self.limit,
            "dead_zone": self.dead_zone,
            "info": self.info,
        }
        return save(tensors, metadata={"about": json.dumps(about, sort_keys=True)})

    @classmethod
    def from_bytes(cls, data: bytes, name: str = "policy") -> Self:
        """Return the policy of a file's bytes.

        Args:
            data: The bytes.
            name: The file's name, for errors.

        Raises:
            PolicyFileError: If the bytes are no policy.
        """
        from safetensors import SafetensorError
        from safetensors.numpy import load

        try:
            if len(data) > _MAX_BYTES:
                raise ValueError(f"{len(data)} bytes")
            about = _metadata(data)
            if about.get("format") != _FORMAT or about.get("version") != _VERSION:
                raise ValueError(f"format {about.get('format')!r}, version {about.get('version')}")
            tensors = load(data)
            count = len(tensors) // 2
            layers = tuple(
                (_finite(tensors[f"layer{k}.weight"], 2), _finite(tensors[f"layer{k}.bias"], 1))
                for k in range(count)
            )
            return cls(
                layers,
                max_range=float(about["max_range"]),
                limit=float(about["limit"]),
                dead_zone=float(about["dead_zone"]),
                info=dict(about["info"]),
            )
        except (SafetensorError, ValueError, KeyError, IndexError, TypeError) as error:
            raise PolicyFileError(
                f"{name}: expected a policy written by andabata, got {str(error).splitlines()[0]}; "
                "train one with `andabata train`"
            ) from error

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the policy of a file.

        Raises:
            PolicyFileError: If the file is no policy.
            OSError: If it cannot be read.
        """
        return cls.from_bytes(path.read_bytes(), str(path))


@kernel
def _forward(state, scale, weights, biases):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the two outputs for a state; weights have a row for each input.

    A sum is made in one order, whoever asks: a policy does the same alone and among others.
    """
    x = (scale[0] + scale[1] * state) / (scale[2] + scale[3] * state)
    for layer in range(len(weights)):
        y, rows = biases[layer].copy(), weights[layer]
        for i in range(len(x)):
            if x[i] != 0.0:
                for j in range(len(y)):
                    y[j] += rows[i, j] * x[i]
        if layer < len(weights) - 1:
            for j in range(len(y)):
                y[j] = max(y[j], np.float32(0.0))
        x = y
    return x[0], x[1]


def _metadata(data: bytes) -> dict[str, Any]:
    """Return the description in a safetensors file's header."""
    size = int.from_bytes(data[:8], "little")
    if len(data) < 8 or size > min(len(data) - 8, 1 << 20):
        raise ValueError(f"{len(data)} bytes without a header")
    header = json.loads(data[8 : 8 + size])
    about = json.loads(header["__metadata__"]["about"])
    if not isinstance(about, dict):
        raise ValueError("no description")
    return about


def _finite(array: NDArray[Any], dimensions: int) -> NDArray[np.float32]:
    """Return an array of weights after a look at it."""
    if array.dtype != np.float32 or array.ndim != dimensions or not np.isfinite(array).all():
        raise ValueError(f"weights of {array.dtype} {array.shape}, or not finite")
    return array
