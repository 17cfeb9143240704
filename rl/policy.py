"""Policies: from an observation to actions in SI units, and the files that hold them.

A file is complete: architecture, weights, spaces and how it was trained; driving needs no torch.
"""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from rl.spaces import ActionSpec, ObservationSpec

_FORMAT = "andabata-policy"
_VERSION = 3
"""Version of the files: 1 had straight ranges, 2 neither spaces nor architecture."""

_MAX_BYTES = 64 << 20

_SUM = "sha256"
"""Entry of the description that holds the SHA-256 of the file's content."""

_ARCHITECTURES = {
    "crop_prices": "rl.policies.crop_prices:CropPricesPolicy",
    "deterministic": "rl.policies.deterministic:DeterministicPolicy",
    "mlp": "rl.policies.mlp:MlpPolicy",
    "point_set": "rl.policies.point_set:PointSetPolicy",
    "proportional": "rl.goal_laws:ProportionalPolicy",
    "heading": "rl.goal_laws:HeadingPolicy",
    "random": "rl.goal_laws:RandomPolicy",
    "ahead": "rl.goal_laws:AheadPolicy",
    "away": "rl.goal_laws:AwayPolicy",
    "sees": "rl.seeing_law:SeeingPolicy",
}
"""Class of each architecture by its name in the files; a new one is a module and a line here."""

Tensors = dict[str, NDArray[np.float32]]


class PolicyFileError(ValueError):
    """A file that is not a policy."""


class Policy(Protocol):
    """A trained actor of any architecture: multi-layer, convolutional, point set or recurrent.

    Attributes:
        architecture: Name of the class in the files.
        observations: Space of its observations.
        actions: Space of its actions.
        info: Origin of the policy: config, commit, stage; ready for JSON.
        terms: Names of the terms that it reads, None for all or the architecture's own.
    """

    architecture: str

    @property
    def observations(self) -> ObservationSpec:
        """Space of its observations."""

    @property
    def actions(self) -> ActionSpec:
        """Space of its actions."""

    @property
    def info(self) -> dict[str, Any]:
        """How it was trained, ready for JSON."""

    @property
    def terms(self) -> tuple[str, ...] | None:
        """Names of the terms that it reads, None for all or the architecture's own."""

    def reset(self) -> None:
        """Forget the last episode; only recurrent policies remember one."""

    def act(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the actions for an observation in SI units, shape (n_actions,)."""

    def best(self, observation: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the best actions as shares from -1 to 1, shape (n_actions,)."""

    def explore(
        self, observation: NDArray[np.float32], rng: np.random.Generator
    ) -> NDArray[np.float64]:
        """Return random actions around the best as shares from -1 to 1, shape (n_actions,)."""

    def best_many(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return ``best`` of each row, shape (n, n_actions), equal to the bit."""

    def explore_many(
        self, observations: NDArray[np.float32], rngs: Sequence[np.random.Generator]
    ) -> NDArray[np.float64]:
        """Return ``explore`` of each row and its generator, (n, n_actions), equal to the bit."""

    def tensors(self) -> Tensors:
        """Return the weights by name, for a file."""

    def to_bytes(self) -> bytes:
        """Return the policy as a file's bytes."""


def policy_to_bytes(policy: Policy) -> bytes:
    """Return a policy as safetensors with its description in the metadata."""
    from safetensors.numpy import save

    about = {
        "format": _FORMAT,
        "version": _VERSION,
        "architecture": policy.architecture,
        "observations": policy.observations.model_dump(mode="json"),
        "actions": policy.actions.model_dump(mode="json"),
        "info": policy.info,
    }
    if policy.terms is not None:
        about["terms"] = policy.terms
    tensors = {name: np.ascontiguousarray(array) for name, array in policy.tensors().items()}
    about[_SUM] = _sum(about, tensors)
    return save(tensors, metadata={"about": json.dumps(about, sort_keys=True)})


def policy_from_bytes(data: bytes, name: str = "policy") -> Policy:
    """Return the policy of a file's bytes.

    Args:
        data: Bytes of the file.
        name: Name of the file, for errors.

    Raises:
        PolicyFileError: If the bytes are no policy of this version.
    """
    from safetensors.numpy import load

    try:
        if len(data) > _MAX_BYTES:
            raise ValueError(f"{len(data)} bytes")
        about = _metadata(data)
        _check_version(about)
        tensors = {key: _finite(array) for key, array in load(data).items()}
        _check_sum(about, tensors)
        return _make(
            about["architecture"],
            tensors,
            ObservationSpec.model_validate(about["observations"]),
            ActionSpec.model_validate(about["actions"]),
            dict(about["info"]),
            about.get("terms"),
        )
    except Exception as error:  # A hostile description raises many kinds.
        reason = (str(error).splitlines() or [type(error).__name__])[0]
        raise PolicyFileError(
            f"{name}: expected a policy written by andabata, got {reason}; "
            "train one with `andabata train`"
        ) from error


def with_info(policy: Policy, info: dict[str, Any]) -> Policy:
    """Return the same policy with another description of how it was trained."""
    parts = (policy.architecture, policy.tensors(), policy.observations, policy.actions)
    return _make(*parts, info, policy.terms)


def with_observations(policy: Policy, observations: ObservationSpec) -> Policy:
    """Return the same policy for another space, such as one with more points.

    Raises:
        ValueError: If the weights do not fit the terms that the policy reads.
        KeyError: If one of them is missing.
    """
    parts = (policy.architecture, policy.tensors(), observations, policy.actions)
    return _make(*parts, policy.info, policy.terms)


def load_policy(path: Path) -> Policy:
    """Return the policy of a file.

    Raises:
        PolicyFileError: If the file is no policy.
        OSError: If it cannot be read.
    """
    return policy_from_bytes(path.read_bytes(), str(path))


def _make(
    architecture: str,
    tensors: Tensors,
    observations: ObservationSpec,
    actions: ActionSpec,
    info: dict[str, Any],
    terms: Sequence[str] | None,
) -> Policy:
    """Return a policy of an architecture.

    Raises:
        ValueError: If there is no such architecture, or the parts do not fit.
    """
    if architecture not in _ARCHITECTURES:
        raise ValueError(f"architecture {architecture!r}")
    module, _, attribute = _ARCHITECTURES[architecture].partition(":")
    make: Callable[..., Policy] = getattr(import_module(module), attribute)
    return make(tensors, observations, actions, info, None if terms is None else tuple(terms))


def _check_version(about: dict[str, Any]) -> None:
    """Refuse files of other formats and versions.

    Raises:
        ValueError: If the description is of another one.
    """
    if about.get("format") != _FORMAT:
        raise ValueError(f"format {about.get('format')!r}")
    if about.get("version") != _VERSION:
        raise ValueError(
            f"a file of version {about.get('version')}, written by an older andabata "
            f"(this one reads version {_VERSION}, which holds observation and action spaces)"
        )


def _sum(about: Mapping[str, Any], tensors: Tensors) -> str:
    """Return the SHA-256 of a description without its sum and of the weights, in hexadecimal."""
    described = {name: value for name, value in about.items() if name != _SUM}
    described = json.loads(json.dumps(described))  # As it is read again.
    digest = hashlib.sha256(json.dumps(described, sort_keys=True).encode())
    for name in sorted(tensors):
        digest.update(f"{name} {tensors[name].shape}".encode())
        digest.update(np.ascontiguousarray(tensors[name], dtype="<f4").tobytes())
    return digest.hexdigest()


def _check_sum(about: Mapping[str, Any], tensors: Tensors) -> None:
    """Refuse files that differ from what was written; those of older releases have no sum.

    Raises:
        ValueError: If one does.
    """
    if _SUM in about and about[_SUM] != _sum(about, tensors):
        raise ValueError("another SHA-256 than its own: it was changed or damaged")


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


def _finite(array: NDArray[Any]) -> NDArray[np.float32]:
    """Return an array of weights after a check."""
    if array.dtype != np.float32 or not np.isfinite(array).all():
        raise ValueError(f"weights of {array.dtype} {array.shape}, or not finite")
    return array
