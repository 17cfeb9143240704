"""Decision trees as flat arrays, walked by compiled loops."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

Vote = Literal["mean", "logistic"]
Nodes = tuple[int, NDArray[np.uint8], NDArray[np.float32], NDArray[np.float32], NDArray[np.int32]]

_DEEPEST = 7
_FEATURE_BITS = 10

COLUMNS: dict[str, type[np.generic]] = {
    "roots": np.int32,
    "feature": np.int16,
    "cut": np.float64,
    "left": np.int32,
    "leaf": np.float32,
}
"""Arrays of ``Trees`` with their types."""


@dataclass(frozen=True)
class Trees:
    """Trees one after the other; the children of node ``k`` are ``left[k]`` and ``left[k] + 1``.

    Attributes:
        features: Names of the features that nodes split by.
        vote: Whether the probability is the ``mean`` of the leaves (a random forest) or the
            ``logistic`` function of their sum (boosted trees).
        base: What the sum begins with.
        roots: First node of each tree, int32, shape (t,).
        feature: Place in ``features`` that a node splits by, -1 at a leaf, int16, shape (n,).
        cut: Values up to this go left, float64, shape (n,).
        left: Left child, int32, shape (n,).
        leaf: What a leaf adds: the share of red training cells, or log odds, float32, shape (n,).
    """

    features: tuple[str, ...]
    vote: Vote
    base: float
    roots: NDArray[np.int32]
    feature: NDArray[np.int16]
    cut: NDArray[np.float64]
    left: NDArray[np.int32]
    leaf: NDArray[np.float32]

    def __post_init__(self) -> None:
        """Check every index and number, so that a walk stays inside the arrays and ends.

        Raises:
            ValueError: If one is wrong; see the message.
        """
        n = len(self.feature)
        for name, dtype in COLUMNS.items():
            column = getattr(self, name)
            long = name == "roots" or len(column) == n
            if column.ndim != 1 or column.dtype != dtype or not long:
                raise ValueError(f"{name} of {column.dtype} {column.shape}")
        inner = self.feature >= 0
        ordered = (self.left > np.arange(n)) & (self.left < n - 1)  # Downwards: it ends.
        if not (len(self.roots) and n and ordered[inner].all()):
            raise ValueError("a child out of bounds")
        if self.roots.min() < 0 or self.roots.max() >= n:
            raise ValueError("a root out of bounds")
        if n >= 1 << (31 - _FEATURE_BITS):
            raise ValueError(f"{n} nodes")
        if self.feature.max() >= len(self.features) or not np.isfinite(self.cut).all():
            raise ValueError("a split on no feature or no number")
        if self.vote not in ("mean", "logistic") or not np.isfinite(self.base):
            raise ValueError(f"vote {self.vote!r} from {self.base}")
        if not np.isfinite(self.leaf).all():
            raise ValueError("a leaf that is no number")
        if self.vote == "mean" and not ((self.leaf >= 0) & (self.leaf <= 1)).all():
            raise ValueError("a probability outside of 0 to 1")

    def laid_out(self, names: tuple[str, ...]) -> Nodes:
        """Return the nodes for ``add_leaves`` on rows whose columns are ``names``.

        Shallow trees are filled up to complete ones, whose walk has no branch: the children of node
        ``i`` are ``2 i`` and ``2 i + 1``. Deep ones keep links.
        """
        column = np.array([names.index(name) for name in self.features], dtype=np.int64)
        cut = self.cut.astype(np.float32)
        too_high = cut.astype(np.float64) > self.cut
        cut[too_high] = np.nextafter(cut[too_high], np.float32(-np.inf))
        inner = self.feature >= 0
        splits = np.where(inner, column[self.feature], 0)
        depth = max(self._depth(), 1)  # Nothing to split still is a complete tree.
        if depth > _DEEPEST:
            link = np.where(inner, (self.left.astype(np.int64) << _FEATURE_BITS) + splits, -1)
            value = np.where(inner, cut, self.leaf)[None]
            none = np.zeros((1, 1), dtype=np.uint8)
            return 0, none, value, self.roots.astype(np.float32)[None], link.astype(np.int32)
        leaves = 1 << depth
        complete = np.zeros((len(self.roots), leaves), dtype=np.int64)
        complete_splits = np.zeros((len(self.roots), leaves), dtype=np.uint8)
        cuts = np.full((len(self.roots), leaves), np.inf, dtype=np.float32)
        complete[:, 0] = complete_splits[:, 0] = 0
        here = self.roots.astype(np.int64)[:, None]
        for level in range(depth):
            places = np.arange(1 << level, 2 << level)
            split = inner[here]
            complete_splits[:, places] = np.where(split, splits[here], 0)
            cuts[:, places] = np.where(split, cut[here], np.inf)
            left = np.where(split, self.left[here], here)
            right = np.where(split, self.left[here] + 1, here)
            here = np.stack([left, right], axis=2).reshape(len(self.roots), -1)
        return depth, complete_splits, cuts, self.leaf[here], np.zeros(1, dtype=np.int32)

    def _depth(self) -> int:
        """Return the number of splits on the longest way."""
        depth = np.zeros(len(self.feature), dtype=np.int64)
        for node in np.flatnonzero(self.feature >= 0):  # Parents stand before their children.
            depth[self.left[node] : self.left[node] + 2] = depth[node] + 1
        return int(depth.max())

    def between(self, first: int, last: int) -> "Trees":
        """Return some of the trees; ``base`` stays with the first."""
        ends = np.append(self.roots, len(self.feature))
        begin, end = int(ends[first]), int(ends[last])
        return Trees(
            self.features,
            self.vote,
            self.base if first == 0 else 0.0,
            self.roots[first:last] - np.int32(begin),
            self.feature[begin:end],
            self.cut[begin:end],
            np.where(self.feature >= 0, self.left - begin, 0)[begin:end].astype(np.int32),
            self.leaf[begin:end],
        )

    def probability(self, sums: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the probability of red from the sums of leaves, ``base`` included."""
        return 1 / (1 + np.exp(-sums)) if self.vote == "logistic" else sums / len(self.roots)

    def log_odds(self, sums: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the log odds of red from the sums of leaves, ``base`` included."""
        if self.vote == "logistic":
            return sums
        with np.errstate(divide="ignore"):
            share = np.maximum(sums / len(self.roots), 0.0)
            return np.log(share) - np.log(1.0 - share)

    def sum_at(self, probability: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the sum of leaves at which the probability is this; see ``probability``."""
        if self.vote == "logistic":
            return np.log(probability / (1 - probability))
        return probability * len(self.roots)

    def packed(self, prefix: str) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Return arrays, their names prefixed, and a header for a file."""
        arrays = {prefix + name: getattr(self, name) for name in COLUMNS}
        return arrays, {"features": list(self.features), "vote": self.vote, "base": self.base}

    @classmethod
    def unpacked(
        cls, arrays: dict[str, NDArray[Any]], header: dict[str, Any], prefix: str, names: set[str]
    ) -> "Trees":
        """Return the trees of ``packed``.

        Args:
            arrays: With prefixed names.
            header: Of these trees.
            prefix: Of the names.
            names: Features that are known.

        Raises:
            ValueError: If something is wrong or unknown.
            KeyError: If something is missing.
        """
        features = tuple(header["features"])
        if not features or not set(features) <= names:
            raise ValueError(f"unknown features {sorted(set(features) - names)[:3]}")
        columns = {name: arrays[prefix + name] for name in COLUMNS}
        return cls(features, header["vote"], float(header["base"]), **columns)


@kernel
def add_leaves(features, rows, n_rows, nodes, first, last, sums):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Add to ``sums[k]`` what ``features[rows[k]]`` meets in trees, for k below ``n_rows``.

    Tree by tree, so that a tree is read once for all rows.

    Args:
        features: float32, shape (n, f).
        rows: Rows to look at, int64.
        n_rows: How many of them.
        nodes: Of ``Trees.laid_out``.
        first: The first tree to walk.
        last: The tree before which to stop.
        sums: float64, as long as ``rows``.
    """
    depth, splits, cuts, leaves, links = nodes
    if depth == 0:
        _walk_links(features, rows, n_rows, cuts[0], leaves[0], links, first, last, sums)
        return
    one, bottom = np.uint64(1), np.uint64(1 << depth)
    for tree in range(first, last):
        for k in range(n_rows):
            row = rows[k]
            i = one
            for _ in range(depth):
                i = (i << one) | np.uint64(
                    features[row, np.uint64(splits[tree, i])] > cuts[tree, i]
                )
            sums[k] += leaves[tree, i - bottom]


@kernel
def _walk_links(features, rows, n_rows, value, roots, links, first, last, sums):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Walk deep trees: a link is the left child and, in its lowest bits, the feature."""
    mask = np.int32((1 << _FEATURE_BITS) - 1)
    for root in roots[first:last]:
        for k in range(n_rows):
            node = np.int32(root)
            way = links[node]
            while way >= 0:
                right = features[rows[k], way & mask] > value[node]
                node = (way >> _FEATURE_BITS) + np.int32(right)
                way = links[node]
            sums[k] += value[node]
