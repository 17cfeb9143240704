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
from traversability.cartesian.context import CONTEXT_FEATURES, add_context
from traversability.cartesian.elevation_grid import ElevationGrid
from traversability.cartesian.features import GROUND_FEATURES, GroundFeatures, label_ground_cells
from traversability.cloud import PointCloud
from traversability.forest import ForestFileError
from traversability.labels import MIN_SHARE, object_points
from traversability.tree_fitting import fit_boosted
from traversability.trees import TreeNodes, Trees, add_leaves

_FORMAT = "andabata-squares"
_VERSION = 2
_MAX_BYTES = 1 << 24

LOW = 0.13
"""Squares of things whose points are no further apart in height show a low one [m]."""


_HALF = 0.5
"""Share of a tile's points over ground that the true map forbids, from which the tile is red."""


class GroundClassifierConfig(BaseModel):
    """How the trees are grown.

    Attributes:
        trees: Number of boosted trees of each look.
        max_depth: Deepest split.
        min_leaf: Fewest squares of a leaf.
        rate: Learning rate.
        shrink: L2 penalty of leaves.
        share: Share of each cloud's squares to learn from: neighbours have much in common.
        low: A red square of a low thing counts so many times: there are few, and no wheel may
            touch them.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    trees: int = Field(default=150, ge=1, le=2000)
    max_depth: int = Field(default=6, ge=1, le=7)
    min_leaf: int = Field(default=200, ge=1)
    rate: float = Field(default=0.15, gt=0, le=1)
    shrink: float = Field(default=5.0, ge=0)
    share: float = Field(default=0.4, gt=0, le=1)
    low: float = Field(default=3.0, ge=1)


@dataclass(frozen=True)
class GroundSamples:
    """Labelled squares of several clouds.

    Attributes:
        features: In the order of ``GROUND_FEATURES``, or of ``CONTEXT_FEATURES`` for the second
            look, float32, shape (n, f).
        blocked: Whether each is non-traversable, bool, shape (n,).
        low: Whether that is for a thing lower than ``LOW``, bool, shape (n,).
    """

    features: NDArray[np.float32]
    blocked: NDArray[np.bool_]
    low: NDArray[np.bool_]


@dataclass(frozen=True)
class Stage:
    """Boosted trees that judge squares by some of what is known of them.

    Attributes:
        trees: Their sums are log odds.
        names: Of the columns that they are given.
    """

    trees: Trees
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        """Check that sums are log odds.

        Raises:
            ValueError: If they are not.
        """
        if self.trees.vote != "logistic":
            raise ValueError(f"vote {self.trees.vote!r}")

    def log_odds(self, rows: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the log odds of squares for being non-traversable, shape (n,).

        Args:
            rows: What is known of them, in the order of ``names``, float32, shape (n, c).

        Raises:
            ValueError: If the rows have another shape: trees look them up unchecked.
        """
        if rows.ndim != 2 or rows.shape[1] != len(self.names):
            raise ValueError(f"features: expected shape (n, {len(self.names)}), got {rows.shape}")
        found = np.full(len(rows), self.trees.base)
        every, flat = np.arange(len(rows)), np.ascontiguousarray(rows)
        add_leaves(flat, every, len(every), self._nodes, 0, len(self.trees.roots), found)
        return found

    @cached_property
    def _nodes(self) -> TreeNodes:
        """The trees as they are walked."""
        return self.trees.laid_out(self.names)


@dataclass(frozen=True)
class GroundClassifier:
    """What tells red squares from green ones.

    Attributes:
        first: Knows ``GROUND_FEATURES``.
        second: Knows ``CONTEXT_FEATURES``, so what a square and its neighbours were taken for.
        cell: Edge of the tiles that they know [m].
        summary: What they were trained on, ready for JSON.
    """

    first: Stage
    second: Stage
    cell: float
    summary: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the looks fit together.

        Raises:
            ValueError: If they do not, or the tiles have no size.
        """
        if self.first.names != GROUND_FEATURES or self.second.names != CONTEXT_FEATURES:
            raise ValueError(f"looks at {len(self.first.names)}, {len(self.second.names)} columns")
        if not self.cell > 0:
            raise ValueError(f"tiles of {self.cell} m")

    def log_odds(
        self,
        features: NDArray[np.float32],
        places: NDArray[np.int64],
        due: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.float64]:
        """Return the log odds of a cloud's squares for being non-traversable, shape (k,).

        Args:
            features: Of all squares of the cloud, as ``GROUND_FEATURES``, float32, shape (n, f).
            places: The squares, int64, shape (n, 2).
            due: The k squares that are asked for, bool, shape (n,); None for all.

        Raises:
            ValueError: If the features have another shape.
        """
        rows = add_context(features, self.first.log_odds(features), places)
        return self.second.log_odds(rows if due is None else rows[due])

    def to_bytes(self) -> bytes:
        """Return the classifier as a file's bytes."""
        first, about_first = self.first.trees.packed("first_")
        second, about_second = self.second.trees.packed("second_")
        header = {"format": _FORMAT, "version": _VERSION, "cell": self.cell}
        looks = {"first": about_first, "second": about_second}
        return pack(first | second, {**header, **looks, "summary": self.summary})

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
            first, second = (
                Stage(Trees.unpacked(arrays, header[look], f"{look}_", set(names)), names)
                for look, names in (("first", GROUND_FEATURES), ("second", CONTEXT_FEATURES))
            )
            return cls(first, second, float(header["cell"]), dict(header["summary"]))
        except (ArrayFileError, KeyError, TypeError, ValueError) as error:
            reason = str(error).splitlines()[0]
            raise ForestFileError(
                f"{name}: expected a classifier of squares written by andabata, got {reason}; "
                "train one with `andabata classifier ground`"
            ) from error

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the classifier of a file.

        Raises:
            ForestFileError: If the file is none.
            OSError: If it cannot be read.
        """
        return cls.from_bytes(path.read_bytes(), str(path))


def ground_samples(
    clouds: Iterable[PointCloud],
    share: float,
    rng: np.random.Generator,
    first: Stage | None = None,
) -> GroundSamples:
    """Return labelled squares of labelled clouds.

    A square is red when half of the points of one of its tiles were measured where the true map
    forbids to drive: a robot that plans by squares needs to know where it must not be, not which
    points belong to what. A map's squares lie as ``odom`` does, wherever the robot looks: clouds
    are turned by chance.

    Args:
        clouds: Labelled, in ``base_footprint``, with ``forbidden``.
        share: Share of each cloud's squares.
        rng: Turns, and which squares.
        first: What the second look goes by; None for samples of the first.

    Raises:
        ValueError: If there are no squares, or one cloud has no labels.
    """
    tiles, describer, here = ElevationGrid(), GroundFeatures(), np.zeros(2)
    height = GROUND_FEATURES.index("height")
    features: list[NDArray[np.float32]] = []
    labels: list[NDArray[np.bool_]] = []
    for cloud in clouds:
        turned = _turned(cloud, rng.uniform(-np.pi, np.pi))
        tiles.describe(turned.points, here)
        describer.describe(tiles, here)
        count = len(describer.cells)
        taken = np.sort(rng.permutation(count)[: round(share * count)])
        places, values = describer.cells, describer.values
        if first is not None:
            values = add_context(values, first.log_odds(values), places)
        places, values = places[taken], values[taken]
        if turned.forbidden is None:
            raise ValueError(
                "forbidden: expected clouds that know which places the true map forbids, got one "
                "without; make them with `andabata clouds generate`"
            )
        red = label_ground_cells(turned, turned.forbidden, _HALF, tiles, places)
        thing = label_ground_cells(turned, object_points(turned), MIN_SHARE, tiles, places)
        features.append(values)
        labels.append(np.stack([red, red & thing & (values[:, height] < LOW)]))
    if not sum(map(len, features)):
        raise ValueError(
            "clouds: expected some with squares to judge, got none; each look needs worlds of its "
            "own, so make clouds of two worlds or more"
        )
    red, low = np.concatenate(labels, axis=1)
    return GroundSamples(np.concatenate(features), red, low)


def _turned(cloud: PointCloud, yaw: float) -> PointCloud:
    """Return a cloud turned about the vertical axis."""
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], dtype=np.float32)
    return replace(cloud, points=cloud.points @ turn.T)


def train_ground_classifier(
    clouds: tuple[Iterable[PointCloud], Iterable[PointCloud]],
    config: GroundClassifierConfig,
    seed: int,
    summary: dict[str, Any] | None = None,
) -> GroundClassifier:
    """Grow the classifier.

    Args:
        clouds: To learn the first look from and, of other worlds, the second, which would believe
            the first too much where that has learnt by heart. Both as ``ground_samples`` says.
        config: How.
        seed: Of turns, squares and splits.
        summary: Kept with it, ready for JSON; the numbers of squares are added.

    Raises:
        ValueError: If the squares are not of both kinds, or as ``ground_samples`` says.
    """
    samples = ground_samples(clouds[0], config.share, np.random.default_rng([seed, 0]))
    first = train_stage(samples, GROUND_FEATURES, config, seed)
    count = len(samples.blocked)
    samples = ground_samples(clouds[1], config.share, np.random.default_rng([seed, 1]), first)
    second = train_stage(samples, CONTEXT_FEATURES, config, seed)
    squares = {"squares": [count, len(samples.blocked)]}
    return GroundClassifier(first, second, ElevationGrid().cell, {**(summary or {}), **squares})


def train_stage(
    samples: GroundSamples, names: tuple[str, ...], config: GroundClassifierConfig, seed: int
) -> Stage:
    """Grow the trees of one look.

    Args:
        samples: To learn from.
        names: Of their columns.
        config: How.
        seed: Of the splits.

    Raises:
        ValueError: If the squares are not of both kinds.
    """
    if not samples.blocked.any() or samples.blocked.all():
        found = f"{int(samples.blocked.sum())} red of {len(samples.blocked)}"
        raise ValueError(f"red: expected squares of both kinds, got {found}; add clouds")
    weights = np.where(samples.low, config.low, 1.0)
    trees = fit_boosted(
        samples.features, samples.blocked, names, config.trees, config, seed, weights
    )
    return Stage(trees, names)
