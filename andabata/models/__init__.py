"""The shipped classifiers and policies; ``README.md`` here gives the commands that made them."""

import hashlib
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Self

from rl.policy import Policy, load_policy, policy_from_bytes
from traversability.cartesian.classifier import GroundClassifier
from traversability.forest import Forest

_ROOM_POLICIES = ("spn", "td3")
"""Policies that are named after their task in rooms."""


@cache
def shipped_forest() -> Forest:
    """Return the cell classifier that comes with the package."""
    return Forest.from_bytes(_shipped("forest.npz"))


@cache
def shipped_ground_classifier() -> GroundClassifier:
    """Return the classifier of ground cells that comes with the package."""
    return GroundClassifier.from_bytes(_shipped("ground_classifier.npz"))


@cache
def shipped_policy(name: str = "policy") -> Policy:
    """Return an actor that comes with the package, by the name of its file.

    Args:
        name: ``policy``, ``imitation``, ``actor-critic``, ``spn``, ``td3`` or ``distilled``.

    Raises:
        ValueError: If there is none of that name.
    """
    try:
        return policy_from_bytes(_shipped(f"{name}.safetensors"))
    except FileNotFoundError:
        task = f" --task {name}" if name in _ROOM_POLICIES else ""
        raise ValueError(
            f"policy {name}: expected one that comes with the package, got none; train one with "
            f"`andabata train{task}` and give its file with --policy"
        ) from None


def _shipped(name: str) -> bytes:
    """Return the bytes of a file that comes with the package."""
    return files(__name__).joinpath(name).read_bytes()


@dataclass(frozen=True)
class Models:
    """Trained parts of a robot, the shipped ones by default.

    Attributes:
        forest: Classifier of the polar cells of scans.
        ground_classifier: Classifier of ground cells.
        policy: Actor of the controllers ``policy`` and ``policy+planner``.
    """

    forest: Forest = field(default_factory=shipped_forest)
    ground_classifier: GroundClassifier = field(default_factory=shipped_ground_classifier)
    policy: Policy = field(default_factory=shipped_policy)

    @classmethod
    def load(
        cls,
        forest: Path | None = None,
        ground_classifier: Path | None = None,
        policy: Path | None = None,
    ) -> Self:
        """Return the models of files; None for a shipped one.

        Raises:
            ValueError: If a file is no such model.
            OSError: If it cannot be read.
        """
        return cls(
            Forest.load(forest) if forest else shipped_forest(),
            GroundClassifier.load(ground_classifier)
            if ground_classifier
            else shipped_ground_classifier(),
            load_policy(policy) if policy else shipped_policy(),
        )

    @property
    def hashes(self) -> dict[str, str]:
        """SHA-256 of the three files, by name."""
        files = zip(("forest", "ground_classifier", "policy"), self.to_bytes(), strict=True)
        return {name: hashlib.sha256(data).hexdigest() for name, data in files}

    def to_bytes(self) -> tuple[bytes, bytes, bytes]:
        """Return the files, for another process."""
        return self.forest.to_bytes(), self.ground_classifier.to_bytes(), self.policy.to_bytes()

    @classmethod
    def from_bytes(cls, data: tuple[bytes, bytes, bytes]) -> Self:
        """Return the models of ``to_bytes``."""
        forest, ground_classifier, policy = data
        return cls(
            Forest.from_bytes(forest),
            GroundClassifier.from_bytes(ground_classifier),
            policy_from_bytes(policy),
        )
