"""Ground classifier: two stages of boosted trees on ground cells, their training and their file."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.kernel import kernel
from traversability.arrays import pack, unpack
from traversability.cartesian.context import CONTEXT_FEATURES, add_context
from traversability.cartesian.elevation_grid import ElevationGrid
from traversability.cartesian.features import GROUND_FEATURES, GroundFeatures, label_ground_cells
from traversability.cloud import PointCloud
from traversability.forest import ForestFileError
from traversability.labels import MIN_SHARE, object_points
from traversability.trees.binned import BinnedTrees, bin_trees, sum_binned_leaves
from traversability.trees.fitting import fit_boosted
from traversability.trees.flat import Trees

_FORMAT = "andabata-squares"  # As files of before have it.
_VERSION = 2
_MAX_BYTES = 1 << 24

LOW_OBJECT_HEIGHT = 0.13
"""Height difference within a ground cell below which it shows a low object [m]."""

_FORBIDDEN_SHARE = 0.5
"""Share of an elevation cell's points over ground that the true map forbids, from which on the cell
is blocked."""

_HEIGHT = GROUND_FEATURES.index("height")


class GroundClassifierConfig(BaseModel):
    """Parameters of training; see ``train_ground_classifier``.

    Attributes:
        trees: Number of boosted trees of each stage.
        max_depth: Largest number of splits from the root of a tree to a leaf.
        min_leaf: Smallest number of ground cells in a leaf.
        learning_rate: Learning rate.
        l2_regularization: L2 penalty of leaves.
        sample_share: Share of each cloud's ground cells that are trained on: neighbours are much
            alike.
        low_object_weight: Weight of a blocked cell of a low object; there are few, and no wheel may
            touch them.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    trees: int = Field(default=150, ge=1, le=2000)
    max_depth: int = Field(default=6, ge=1, le=7)
    min_leaf: int = Field(default=200, ge=1)
    learning_rate: float = Field(default=0.15, gt=0, le=1)
    l2_regularization: float = Field(default=5.0, ge=0)
    sample_share: float = Field(default=0.4, gt=0, le=1)
    low_object_weight: float = Field(default=3.0, ge=1)


@dataclass(frozen=True)
class GroundSamples:
    """Labelled ground cells of several clouds.

    Attributes:
        features: Features in the order of ``GROUND_FEATURES``, or of ``CONTEXT_FEATURES`` for the
            second stage, float32, shape (n, f).
        blocked: True for non-traversable cells, bool, shape (n,).
        low: True for those blocked by an object lower than ``LOW_OBJECT_HEIGHT``, bool, shape (n,).
    """

    features: NDArray[np.float32]
    blocked: NDArray[np.bool_]
    low: NDArray[np.bool_]


@dataclass(frozen=True)
class BoostedStage:
    """Boosted trees that classify ground cells by some of their features.

    Attributes:
        trees: Boosted trees, whose sums are log odds.
        names: Names of the columns that they are given.
    """

    trees: Trees
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        """Check that the sums of leaves are log odds, and that the trees fit into bins.

        Raises:
            ValueError: If they are not, or do not; see ``bin_trees``.
        """
        if self.trees.vote != "logistic":
            raise ValueError(f"vote: expected 'logistic', got {self.trees.vote!r}")
        _ = self.binned

    def log_odds(self, rows: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the log odds of ground cells for being non-traversable, shape (n,).

        Args:
            rows: Features in the order of ``names``, float32, shape (n, c).

        Raises:
            ValueError: If the rows have another shape, which the kernels do not check.
        """
        self.check(rows)
        return sum_binned_leaves(np.ascontiguousarray(rows), self.binned, self.trees.base)

    def check(self, rows: NDArray[np.float32]) -> None:
        """Check the shape of rows, which the kernels do not.

        Args:
            rows: Features in the order of ``names``, float32, shape (n, c).

        Raises:
            ValueError: If the rows have another shape.
        """
        if rows.ndim != 2 or rows.shape[1] != len(self.names):
            raise ValueError(f"features: expected shape (n, {len(self.names)}), got {rows.shape}")

    @cached_property
    def binned(self) -> BinnedTrees:
        """Trees laid out for the kernel, kept: they are used with every cloud."""
        return bin_trees(self.trees.laid_out(self.names), len(self.names))


@dataclass(frozen=True)
class GroundClassifier:
    """Two-stage classifier of ground cells as blocked or free (auto-context).

    Attributes:
        first: First stage, on ``GROUND_FEATURES``.
        second: Second stage, on ``CONTEXT_FEATURES``, which hold the first stage's log odds of a
            cell and of its neighbours.
        cell: Edge of the elevation grid cells that both were trained on [m].
        summary: Account of the training, ready for JSON.
    """

    first: BoostedStage
    second: BoostedStage
    cell: float
    summary: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that the stages fit together.

        Raises:
            ValueError: If they do not, or the elevation grid cells have no size.
        """
        if self.first.names != GROUND_FEATURES or self.second.names != CONTEXT_FEATURES:
            expected = f"{len(GROUND_FEATURES)} and {len(CONTEXT_FEATURES)}"
            counts = f"{len(self.first.names)} and {len(self.second.names)}"
            raise ValueError(f"stages: expected those of {expected} features, got {counts}")
        if not 0 < self.cell < np.inf:
            raise ValueError(f"cell: expected an edge above 0 m, got {self.cell}")

    def log_odds(
        self,
        features: NDArray[np.float32],
        cells: NDArray[np.int64],
        due: NDArray[np.bool_] | None = None,
    ) -> NDArray[np.float64]:
        """Return the log odds of a cloud's ground cells for being non-traversable, shape (k,).

        Args:
            features: Features of all ground cells of the cloud, in the order of
                ``GROUND_FEATURES``, float32, shape (n, f).
            cells: The ground cells, int64, shape (n, 2).
            due: True for the k cells that are asked for, bool, shape (n,); None for all.

        Raises:
            ValueError: If the features have another shape.
        """
        first, second = self.first, self.second
        first.check(features)
        return _log_odds_of_both(
            np.ascontiguousarray(features),
            cells,
            due,
            first.binned,
            first.trees.base,
            second.binned,
            second.trees.base,
        )

    def to_bytes(self) -> bytes:
        """Return the classifier as a file's bytes."""
        first, about_first = self.first.trees.packed("first_")
        second, about_second = self.second.trees.packed("second_")
        header = {"format": _FORMAT, "version": _VERSION, "cell": self.cell}
        stages = {"first": about_first, "second": about_second}
        return pack(first | second, {**header, **stages, "summary": self.summary})

    @classmethod
    def from_bytes(cls, data: bytes, name: str = "ground classifier") -> Self:
        """Return the classifier of a file's bytes, every index checked.

        Args:
            data: Bytes of the file.
            name: Name of the file, for errors.

        Raises:
            ForestFileError: If the bytes are no classifier whose trees can be walked safely.
        """
        try:
            arrays, header = unpack(data, _MAX_BYTES)
            if header.get("format") != _FORMAT or header.get("version") != _VERSION:
                version = f"{header.get('format')!r} {header.get('version')!r}"
                raise ValueError(f"a file of format {version}")
            first, second = (
                BoostedStage(Trees.unpacked(arrays, header[stage], f"{stage}_", set(names)), names)
                for stage, names in (("first", GROUND_FEATURES), ("second", CONTEXT_FEATURES))
            )
            return cls(first, second, float(header["cell"]), dict(header["summary"]))
        except Exception as error:  # A hostile header raises many kinds.
            reason = (str(error).splitlines() or [type(error).__name__])[0]
            raise ForestFileError(
                f"{name}: expected a ground classifier written by andabata, got {reason}; "
                "train one with `andabata classifier ground`"
            ) from error

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the classifier of a file.

        Args:
            path: Path of the file.

        Raises:
            ForestFileError: If the file holds none.
            OSError: If it cannot be read.
        """
        return cls.from_bytes(path.read_bytes(), str(path))


@kernel
def _log_odds_of_both(
    features: NDArray[np.float32],
    cells: NDArray[np.int64],
    due: NDArray[np.bool_] | None,
    first: BinnedTrees,
    first_base: float,
    second: BinnedTrees,
    second_base: float,
) -> NDArray[np.float64]:
    """Return the second stage's log odds, with the first's as context.

    Args:
        features: Features of all ground cells of a cloud, shape (n, f).
        cells: The ground cells, shape (n, 2).
        due: True for those that are asked for, shape (n,), or None.
        first: Trees of the first stage.
        first_base: Begin of their sums.
        second: Trees of the second stage.
        second_base: Begin of their sums.
    """
    odds = sum_binned_leaves(features, first, first_base)
    rows = add_context(features, odds, cells, due)
    return sum_binned_leaves(rows, second, second_base)


def ground_samples(
    clouds: Iterable[PointCloud],
    share: float,
    rng: np.random.Generator,
    first: BoostedStage | None = None,
) -> GroundSamples:
    """Return labelled ground cells of labelled clouds.

    A ground cell is blocked if at least half of the points of one of its elevation grid cells were
    measured where the true map forbids to drive: a planner needs to know where the robot must not
    be, not which points belong to which object. The ground cells of a map are aligned with
    ``odom``, whatever the robot's heading: clouds are turned by random angles.

    Args:
        clouds: Labelled clouds in ``base_footprint``, with ``forbidden``.
        share: Share of each cloud's ground cells to take.
        rng: Random generator of the angles and of the choice of cells.
        first: First stage, for samples of the second; None for samples of the first.

    Raises:
        ValueError: If there are no ground cells, or a cloud has no labels.
    """
    elevation, describer, here = ElevationGrid(), GroundFeatures(), np.zeros(2)
    features: list[NDArray[np.float32]] = []
    labels: list[NDArray[np.bool_]] = []
    for cloud in clouds:
        turned = _turned(cloud, rng.uniform(-np.pi, np.pi))
        elevation.describe(turned.points, here)
        describer.describe(elevation, here)
        count = len(describer.cells)
        taken = np.sort(rng.permutation(count)[: round(share * count)])
        cells, values = describer.cells, describer.values
        if first is not None:
            # Context needs all neighbours, so it is added before cells are taken.
            values = add_context(values, first.log_odds(values), cells)
        cells, values = cells[taken], values[taken]
        features.append(values)
        labels.append(_label(turned, elevation, cells, values))
    if not sum(map(len, features)):
        raise ValueError(
            "clouds: expected some with ground cells, got none; each stage needs worlds of its "
            "own, so make clouds of two worlds or more"
        )
    blocked, low = np.concatenate(labels, axis=1)
    return GroundSamples(np.concatenate(features), blocked, low)


def _label(
    cloud: PointCloud,
    elevation: ElevationGrid,
    cells: NDArray[np.int64],
    values: NDArray[np.float32],
) -> NDArray[np.bool_]:
    """Return which ground cells are blocked, and which of them by a low object, shape (2, n).

    Args:
        cloud: Labelled cloud.
        elevation: Elevation grid of the cloud.
        cells: Ground cells, shape (n, 2).
        values: Features of the cells, shape (n, f).
    """
    if cloud.forbidden is None:
        raise ValueError(
            "forbidden: expected clouds with the places that the true map forbids, got one without"
            "; make them with `andabata clouds generate`"
        )
    blocked = label_ground_cells(cloud, cloud.forbidden, _FORBIDDEN_SHARE, elevation, cells)
    objects = label_ground_cells(cloud, object_points(cloud), MIN_SHARE, elevation, cells)
    return np.stack([blocked, blocked & objects & (values[:, _HEIGHT] < LOW_OBJECT_HEIGHT)])


def _turned(cloud: PointCloud, yaw: float) -> PointCloud:
    """Return a cloud turned counter-clockwise about the vertical axis.

    Args:
        cloud: Cloud to turn.
        yaw: Angle [rad].
    """
    c, s = np.cos(yaw), np.sin(yaw)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]], dtype=np.float32)
    return replace(cloud, points=cloud.points @ turn.T)


def train_ground_classifier(
    clouds: tuple[Iterable[PointCloud], Iterable[PointCloud]],
    config: GroundClassifierConfig,
    seed: int,
    summary: dict[str, Any] | None = None,
) -> GroundClassifier:
    """Train both stages and return the classifier.

    Args:
        clouds: Clouds for the first stage and, of other worlds, for the second, which would rely
            too much on the first where that has memorised the answer. See ``ground_samples``.
        config: Parameters of training.
        seed: Seed of angles, choice of cells and splits.
        summary: Account of the training, kept with the classifier, ready for JSON; the numbers of
            ground cells (``squares``) are added.

    Raises:
        ValueError: If the ground cells are not of both kinds, or as ``ground_samples`` says.
    """
    samples = ground_samples(clouds[0], config.sample_share, np.random.default_rng([seed, 0]))
    first = train_stage(samples, GROUND_FEATURES, config, seed)
    counts = [len(samples.blocked)]
    samples = ground_samples(
        clouds[1], config.sample_share, np.random.default_rng([seed, 1]), first
    )
    second = train_stage(samples, CONTEXT_FEATURES, config, seed)
    counts.append(len(samples.blocked))
    whole = {**(summary or {}), "squares": counts}
    return GroundClassifier(first, second, ElevationGrid().cell, whole)


def train_stage(
    samples: GroundSamples, names: tuple[str, ...], config: GroundClassifierConfig, seed: int
) -> BoostedStage:
    """Fit the trees of one stage.

    Args:
        samples: Labelled ground cells.
        names: Names of their columns.
        config: Parameters of training.
        seed: Seed of the splits.

    Raises:
        ValueError: If the ground cells are not of both kinds.
    """
    if not samples.blocked.any() or samples.blocked.all():
        counts = f"{int(samples.blocked.sum())} blocked of {len(samples.blocked)}"
        raise ValueError(f"blocked: expected ground cells of both kinds, got {counts}; add clouds")
    weights = np.where(samples.low, config.low_object_weight, 1.0)
    blocked = samples.blocked
    trees = fit_boosted(samples.features, blocked, names, config.trees, config, seed, weights)
    return BoostedStage(trees, names)
