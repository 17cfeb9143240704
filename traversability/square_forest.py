"""The classifier of squares: what it learns from, how it grows, and its file."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from traversability.arrays import ArrayFileError, pack, unpack
from traversability.cloud import PointCloud
from traversability.forest import ForestFileError
from traversability.labels import MIN_SHARE, things
from traversability.planting import grow_boosted
from traversability.squares import SQUARE_FEATURES, SquareFeatures, label_squares
from traversability.tiles import Tiles
from traversability.trees import Nodes, Trees, add_leaves

_FORMAT = "andabata-squares"
_VERSION = 1
_MAX_BYTES = 1 << 24

LOW = 0.13
"""Squares of things whose points are no further apart in height show a low one [m]."""


_HALF = 0.5
"""Share of a tile's points over ground that the true map forbids, from which the tile is red."""


class SquareConfig(BaseModel):
    """How the trees are grown.

    Attributes:
        trees: Number of boosted trees.
        max_depth: Deepest split.
        min_leaf: Fewest squares of a leaf.
        rate: Learning rate.
        shrink: L2 penalty of leaves.
        share: Share of each cloud's squares to learn from: neighbours have much in common.
        low: A red square of a low thing counts so many times: there are few, and no wheel may
            touch them.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    trees: int = Field(default=200, ge=1, le=2000)
    max_depth: int = Field(default=6, ge=1, le=7)
    min_leaf: int = Field(default=200, ge=1)
    rate: float = Field(default=0.15, gt=0, le=1)
    shrink: float = Field(default=5.0, ge=0)
    share: float = Field(default=0.2, gt=0, le=1)
    low: float = Field(default=3.0, ge=1)


@dataclass(frozen=True)
class SquareSamples:
    """Labelled squares of several clouds.

    Attributes:
        features: In the order of ``SQUARE_FEATURES``, float32, shape (n, f).
        red: Whether each is non-traversable, bool, shape (n,).
        low: Whether that is for a thing lower than ``LOW``, bool, shape (n,).
    """

    features: NDArray[np.float32]
    red: NDArray[np.bool_]
    low: NDArray[np.bool_]


@dataclass(frozen=True)
class SquareForest:
    """What tells red squares from green ones.

    Attributes:
        trees: Boosted trees on ``SQUARE_FEATURES``, whose sums are log odds.
        cell: Edge of the tiles that they know [m].
        summary: What they were trained on, ready for JSON.
    """

    trees: Trees
    cell: float
    summary: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that sums are log odds.

        Raises:
            ValueError: If they are not, or the tiles have no size.
        """
        if self.trees.vote != "logistic" or not self.cell > 0:
            raise ValueError(f"vote {self.trees.vote!r} on tiles of {self.cell} m")

    def odds(self, features: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the log odds of squares for being non-traversable, shape (n,).

        Args:
            features: In the order of ``SQUARE_FEATURES``, float32, shape (n, f).

        Raises:
            ValueError: If the features have another shape: trees look them up unchecked.
        """
        if features.ndim != 2 or features.shape[1] != len(SQUARE_FEATURES):
            expected = f"(n, {len(SQUARE_FEATURES)})"
            raise ValueError(f"features: expected shape {expected}, got {features.shape}")
        found = np.full(len(features), self.trees.base)
        rows, flat = np.arange(len(features)), np.ascontiguousarray(features)
        add_leaves(flat, rows, len(rows), self._nodes, 0, len(self.trees.roots), found)
        return found

    @cached_property
    def _nodes(self) -> Nodes:
        """The trees as they are walked."""
        return self.trees.laid_out(SQUARE_FEATURES)

    def to_bytes(self) -> bytes:
        """Return the classifier as a file's bytes."""
        arrays, about = self.trees.packed("")
        header = {"format": _FORMAT, "version": _VERSION, "trees": about, "cell": self.cell}
        return pack(arrays, {**header, "summary": self.summary})

    @classmethod
    def from_bytes(cls, data: bytes, name: str = "squares") -> Self:
        """Return the classifier of a file's bytes, every index checked.

        Args:
            data: The bytes.
            name: The file's name, for errors.

        Raises:
            ForestFileError: If the bytes are no classifier that can be walked safely.
        """
        try:
            arrays, header = unpack(data, _MAX_BYTES)
            if header.get("format") != _FORMAT or header.get("version") != _VERSION:
                raise ValueError(f"format {header.get('format')!r} {header.get('version')!r}")
            trees = Trees.unpacked(arrays, header["trees"], "", set(SQUARE_FEATURES))
            return cls(trees, float(header["cell"]), dict(header["summary"]))
        except (ArrayFileError, KeyError, TypeError, ValueError) as error:
            reason = str(error).splitlines()[0]
            raise ForestFileError(
                f"{name}: expected a classifier of squares written by andabata, got {reason}; "
                "train one with `andabata classifier squares`"
            ) from error

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the classifier of a file.

        Raises:
            ForestFileError: If the file is none.
            OSError: If it cannot be read.
        """
        return cls.from_bytes(path.read_bytes(), str(path))


def square_samples(
    clouds: Iterable[PointCloud], share: float, rng: np.random.Generator
) -> SquareSamples:
    """Return labelled squares of labelled clouds.

    A square is red when half of the points of one of its tiles were measured where the true map
    forbids to drive: a robot that plans by squares needs to know where it must not be, not which
    points belong to what. A map's squares lie as ``odom`` does, wherever the robot looks: clouds
    are turned by chance.

    Args:
        clouds: Labelled, in ``base_footprint``, with ``forbidden``.
        share: Share of each cloud's squares.
        rng: Turns, and which squares.

    Raises:
        ValueError: If there are no squares, or one cloud has no labels.
    """
    tiles, describer, here = Tiles(), SquareFeatures(), np.zeros(2)
    height = SQUARE_FEATURES.index("height")
    features, labels = [np.empty((0, len(SQUARE_FEATURES)), np.float32)], [np.empty((2, 0), bool)]
    for cloud in clouds:
        turned = _turned(cloud, rng.uniform(-np.pi, np.pi))
        tiles.describe(turned.points, here)
        describer.describe(tiles, here)
        count = len(describer.places)
        taken = np.sort(rng.permutation(count)[: round(share * count)])
        values, places = describer.values[taken], describer.places[taken]
        if turned.forbidden is None:
            raise ValueError(
                "forbidden: expected clouds that know which places the true map forbids, got one "
                "without; make them with `andabata clouds generate`"
            )
        red = label_squares(turned, turned.forbidden, _HALF, tiles, places)
        thing = label_squares(turned, things(turned), MIN_SHARE, tiles, places)
        features.append(values)
        labels.append(np.stack([red, red & thing & (values[:, height] < LOW)]))
    red, low = np.concatenate(labels, axis=1)
    if not len(red):
        raise ValueError("clouds: expected some with squares to judge, got none")
    return SquareSamples(np.concatenate(features), red, low)


def _turned(cloud: PointCloud, yaw: float) -> PointCloud:
    """Return a cloud turned about the vertical axis."""
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], dtype=np.float32)
    return replace(cloud, points=cloud.points @ turn.T)


def grow_squares(
    samples: SquareSamples, config: SquareConfig, seed: int, summary: dict[str, Any] | None = None
) -> SquareForest:
    """Grow the classifier.

    Args:
        samples: To learn from.
        config: How.
        seed: Of the splits.
        summary: Kept with it, ready for JSON.

    Raises:
        ValueError: If the squares are not of both kinds.
    """
    if not samples.red.any() or samples.red.all():
        found = f"{int(samples.red.sum())} red of {len(samples.red)}"
        raise ValueError(f"red: expected squares of both kinds, got {found}; add clouds")
    weights = np.where(samples.low, config.low, 1.0)
    trees = grow_boosted(
        samples.features, samples.red, SQUARE_FEATURES, config.trees, config, seed, weights
    )
    return SquareForest(trees, Tiles().cell, summary or {})
