"""The cell classifier: a random forest as flat arrays, evaluated by a compiled loop."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
from numba import njit
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from traversability.arrays import ArrayFileError, pack, unpack
from traversability.features import FEATURES, CellFeatures
from traversability.grid import PolarGrid
from traversability.labels import CellState

_FORMAT = "andabata-forest"
_MAX_BYTES = 1 << 26


class ForestFileError(ValueError):
    """A file that is not a forest."""


class ForestConfig(BaseModel):
    """How a forest is grown.

    Attributes:
        trees: Number of trees.
        max_depth: Deepest split.
        min_leaf: Fewest cells of a leaf.
        threshold: A cell is red from this probability on; None to choose the one with the best
            balanced accuracy out of bag.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    trees: int = Field(default=100, ge=1, le=2000)
    max_depth: int = Field(default=12, ge=1, le=64)
    min_leaf: int = Field(default=3, ge=1)
    threshold: float | None = Field(default=None, gt=0, lt=1)


@dataclass(frozen=True)
class Forest:
    """Trees one after the other; the children of node ``k`` are ``left[k]`` and ``left[k] + 1``.

    Attributes:
        roots: First node of each tree, int32, shape (t,).
        feature: Feature that a node splits by, -1 at a leaf, int8, shape (n,).
        cut: Values up to this go left, float64, shape (n,).
        left: Left child, int32, shape (n,).
        red: Share of red training cells at the node, float32, shape (n,).
        threshold: A cell is red from this probability on.
        grid: The grid that the forest was trained for.
        summary: What the forest was trained on, ready for JSON.
    """

    roots: NDArray[np.int32]
    feature: NDArray[np.int8]
    cut: NDArray[np.float64]
    left: NDArray[np.int32]
    red: NDArray[np.float32]
    threshold: float
    grid: PolarGrid
    summary: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Lay the nodes out for the walk: eight bytes each, so that a forest fits into a cache.

        ``value`` is the cut, or the share of red at a leaf; ``link`` is eight times the left child
        plus the feature, or -1 at a leaf. A cut rounded down to float32 sends every float32 the
        same way.
        """
        cut = self.cut.astype(np.float32)
        too_high = cut.astype(np.float64) > self.cut
        cut[too_high] = np.nextafter(cut[too_high], np.float32(-np.inf))
        inner = self.feature >= 0
        link = np.where(inner, 8 * self.left.astype(np.int64) + self.feature, -1)
        object.__setattr__(self, "_value", np.where(inner, cut, self.red))
        object.__setattr__(self, "_link", link.astype(np.int32))

    def predict_proba(self, features: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the probability of red of cells.

        Args:
            features: In the order of ``FEATURES``, float32, shape (n, 5).

        Returns:
            Mean over the trees, float64, shape (n,).

        Raises:
            ValueError: If the features have another shape.
        """
        if features.ndim != 2 or features.shape[1] != len(FEATURES):
            expected = f"(n, {len(FEATURES)})"
            raise ValueError(f"features: expected shape {expected}, got {features.shape}")
        flat = np.ascontiguousarray(features, dtype=np.float32)
        return _vote(flat, self.roots, self._value, self._link)  # type: ignore[attr-defined]

    def classify(self, cells: CellFeatures, grid: PolarGrid) -> NDArray[np.uint8]:
        """Return the ``CellState`` of each cell, uint8, shape (n_sectors, n_rings).

        Raises:
            ValueError: If the grid's rings are not those of the training.
        """
        if not np.array_equal(grid.ring_edges, self.grid.ring_edges):
            raise ValueError(
                f"grid: expected the {self.grid.n_rings} rings to {self.grid.outer_radius} m that "
                f"the forest was trained for, got {grid.n_rings} to {grid.outer_radius} m; train a "
                "forest for this grid"
            )
        states = np.zeros(cells.counts.shape, dtype=np.uint8)
        judged = cells.counts >= grid.min_points
        red = self.predict_proba(cells.values[judged]) >= self.threshold
        states[judged] = np.where(red, CellState.NON_TRAVERSABLE, CellState.TRAVERSABLE)
        return states

    def to_bytes(self) -> bytes:
        """Return the forest as a file's bytes."""
        header = {
            "format": _FORMAT,
            "version": 1,
            "features": list(FEATURES),
            "threshold": self.threshold,
            "grid": self.grid.model_dump(),
            "summary": self.summary,
        }
        names = ("roots", "feature", "cut", "left", "red")
        return pack({name: getattr(self, name) for name in names}, header)

    @classmethod
    def from_bytes(cls, data: bytes, name: str = "forest") -> Self:
        """Return the forest of a file's bytes, every index checked.

        Args:
            data: The bytes.
            name: The file's name, for errors.

        Raises:
            ForestFileError: If the bytes are no forest that can be walked safely.
        """
        try:
            arrays, header = unpack(data, _MAX_BYTES)
            return cls(**_checked(arrays, header))
        except (ArrayFileError, ValidationError, KeyError, TypeError, ValueError) as error:
            reason = str(error).splitlines()[0]
            raise ForestFileError(
                f"{name}: expected a forest written by andabata, got {reason}; train one with "
                "`andabata classifier train`"
            ) from error

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the forest of a file.

        Raises:
            ForestFileError: If the file is no forest.
            OSError: If it cannot be read.
        """
        return cls.from_bytes(path.read_bytes(), str(path))


def _checked(arrays: dict[str, NDArray[Any]], header: dict[str, Any]) -> dict[str, Any]:
    """Return the parts of a forest whose walk stays inside its arrays and always ends."""
    if header.get("format") != _FORMAT or header.get("version") != 1:
        raise ValueError(f"format {header.get('format')!r} version {header.get('version')!r}")
    if header["features"] != list(FEATURES):
        raise ValueError(f"features {header['features']}")
    wanted = {
        "roots": np.int32,
        "feature": np.int8,
        "cut": np.float64,
        "left": np.int32,
        "red": np.float32,
    }
    columns = {name: arrays[name] for name in wanted}
    n = len(columns["feature"])
    for name, dtype in wanted.items():
        column = columns[name]
        right = column.ndim == 1 and column.dtype == dtype and (name == "roots" or len(column) == n)
        if not right:
            raise ValueError(f"{name} of {column.dtype} {column.shape}")
    node = np.arange(n)
    inner = columns["feature"] >= 0
    ordered = (columns["left"] > node) & (columns["left"] < n - 1)  # Downwards: no endless walk.
    if not (len(columns["roots"]) and n and ordered[inner].all()):
        raise ValueError("a child out of bounds")
    if columns["roots"].min() < 0 or columns["roots"].max() >= n:
        raise ValueError("a root out of bounds")
    if columns["feature"].max() >= len(FEATURES) or not np.isfinite(columns["cut"]).all():
        raise ValueError("a split on no feature or no number")
    if not ((columns["red"] >= 0) & (columns["red"] <= 1)).all():
        raise ValueError("a probability outside of 0 to 1")
    threshold = float(header["threshold"])
    if not 0 < threshold < 1:
        raise ValueError(f"threshold {threshold}")
    return {
        **columns,
        "threshold": threshold,
        "grid": PolarGrid.model_validate(header["grid"]),
        "summary": dict(header["summary"]),
    }


@njit(cache=True, nogil=True)
def _vote(features, roots, value, link):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the mean share of red over the leaves that each row falls into."""
    result = np.empty(len(features))
    for row in range(len(features)):
        total = 0.0
        for root in roots:
            node = root
            way = link[node]
            while way >= 0:
                go_right = features[row, way & 7] > value[node]
                node = (way >> 3) + np.int32(go_right)
                way = link[node]
            total += value[node]
        result[row] = total / len(roots)
    return result


def train_forest(
    features: NDArray[np.float32],
    red: NDArray[np.bool_],
    grid: PolarGrid,
    config: ForestConfig,
    seed: int,
    summary: dict[str, Any] | None = None,
) -> Forest:
    """Grow a forest.

    Args:
        features: In the order of ``FEATURES``, shape (n, 5).
        red: Whether each cell is non-traversable, shape (n,).
        grid: The cells' grid, kept with the forest.
        config: How.
        seed: Of bootstrap and splits.
        summary: Kept with the forest, ready for JSON.

    Raises:
        ValueError: If the cells are not of both kinds.
    """
    from sklearn.ensemble import RandomForestClassifier

    if red.all() or not red.any():
        raise ValueError(
            f"red: expected cells of both kinds, got {int(red.sum())} red of {len(red)}; add clouds"
        )
    model = RandomForestClassifier(
        n_estimators=config.trees,
        max_depth=config.max_depth,
        min_samples_leaf=config.min_leaf,
        oob_score=config.threshold is None and config.trees >= 20,
        random_state=seed,
        n_jobs=1,
    )
    model.fit(features, red)
    threshold = config.threshold or 0.5
    if model.oob_score:
        threshold = best_threshold(red, model.oob_decision_function_[:, 1])
    return flatten(model, threshold, grid, summary or {})


def best_threshold(red: NDArray[np.bool_], probability: NDArray[np.float64]) -> float:
    """Return the threshold with the best balanced accuracy, in steps of 0.01 from 0.2 to 0.5."""
    thresholds = np.round(np.arange(0.2, 0.505, 0.01), 2)
    called = probability[:, None] >= thresholds
    balanced = called[red].mean(axis=0) + (~called[~red]).mean(axis=0)
    return float(thresholds[balanced.argmax()])


def flatten(model: Any, threshold: float, grid: PolarGrid, summary: dict[str, Any]) -> Forest:  # noqa: ANN401 - scikit-learn has no types.
    """Return a fitted scikit-learn forest as flat arrays, siblings side by side."""
    trees = [_siblings_together(estimator.tree_) for estimator in model.estimators_]
    sizes = [len(tree[0]) for tree in trees]
    roots = np.concatenate([[0], np.cumsum(sizes[:-1])]).astype(np.int32)
    moved = [left + root for (_, _, left, _), root in zip(trees, roots, strict=True)]
    return Forest(
        roots=roots,
        feature=np.concatenate([tree[0] for tree in trees]).astype(np.int8),
        cut=np.concatenate([tree[1] for tree in trees]),
        left=np.concatenate(moved).astype(np.int32),
        red=np.concatenate([tree[3] for tree in trees]).astype(np.float32),
        threshold=threshold,
        grid=grid,
        summary=summary,
    )


def _siblings_together(tree: Any) -> tuple[NDArray[Any], ...]:  # noqa: ANN401 - scikit-learn has no types.
    """Return feature, cut, left child and share of red of a tree, its nodes renumbered."""
    order = [0]
    left = np.zeros(tree.node_count, dtype=np.int64)
    for place in range(tree.node_count):
        node = order[place]
        if tree.children_left[node] >= 0:
            left[place] = len(order)
            order += [tree.children_left[node], tree.children_right[node]]
    feature = np.where(tree.children_left >= 0, tree.feature, -1)[order]
    cut = np.where(tree.children_left >= 0, tree.threshold, 0.0)[order]
    share = tree.value[order, 0, :]
    return feature, cut, left, share[:, 1] / share.sum(axis=1)
