"""Decision trees as flat arrays, walked by compiled loops."""

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

Vote = Literal["mean", "logistic"]
"""Way from the sum of leaves to a probability."""

_MAX_COMPLETE_DEPTH = 7
"""Depth up to which trees are filled up to complete ones: 2^7 leaves of a tree fit in the cache."""

_MAX_DEPTH, _MAX_TREES = 64, 5000
"""Most splits on a path, and most trees: a walk through more would take minutes a cloud."""

_FEATURE_BITS = 10
"""Lowest bits of a link, which hold the feature; the others hold the left child."""


class TreeNodes(NamedTuple):
    """Trees laid out for ``add_leaves``, either filled up to complete ones or linked.

    Node ``i`` of a complete tree has the children ``2 i`` and ``2 i + 1``, the root is node 1: a
    walk needs no branch. Trees that are too deep for that keep their links.

    Attributes:
        n_trees: Number of trees, t.
        depth: Number of splits from the root to each leaf of complete trees; 0 for linked ones.
        splits: Column that each node of complete trees splits by, uint8, shape (t, 2^depth).
        cuts: Largest value that goes left at each node, float32, shape (t, 2^depth); of linked
            trees, cuts and leaves of all nodes in one row, shape (1, n).
        leaves: Leaves of complete trees, float32, shape (t, 2^depth).
        links: Left child and column of each node of linked trees, negative at a leaf, int32, shape
            (n,).
        roots: First node of each linked tree, int32, shape (t,).
    """

    n_trees: int
    depth: int
    splits: NDArray[np.uint8]
    cuts: NDArray[np.float32]
    leaves: NDArray[np.float32]
    links: NDArray[np.int32]
    roots: NDArray[np.int32]


COLUMNS: dict[str, type[np.generic]] = {
    "roots": np.int32,
    "feature": np.int16,
    "cut": np.float64,
    "left": np.int32,
    "leaf": np.float32,
}
"""Arrays of ``Trees`` by name, with their types."""


@dataclass(frozen=True)
class Trees:
    """Trees one after the other; the children of node ``k`` are ``left[k]`` and ``left[k] + 1``.

    Attributes:
        features: Names of the features that nodes split by.
        vote: Way to the probability: the ``mean`` of the leaves (a random forest) or the
            ``logistic`` function of their sum (boosted trees).
        base: Start of the sum of leaves.
        roots: First node of each tree, int32, shape (t,).
        feature: Index in ``features`` that each node splits by, -1 at a leaf, int16, shape (n,).
        cut: Largest value that goes left at each node, float64, shape (n,).
        left: Left child of each node, int32, shape (n,).
        leaf: Value that each leaf adds: the share of non-traversable training samples, or log odds,
            float32, shape (n,).
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
        if len(self.roots) > _MAX_TREES or (np.diff(self.roots) <= 0).any():
            raise ValueError(f"{len(self.roots)} trees, more than {_MAX_TREES} or out of order")
        if n >= 1 << (31 - _FEATURE_BITS):
            raise ValueError(f"{n} nodes")
        if self._depth() > _MAX_DEPTH:
            raise ValueError(f"a path of more than {_MAX_DEPTH} splits")
        if self.feature.max() >= len(self.features) or not np.isfinite(self.cut).all():
            raise ValueError("a split on no feature or no number")
        if self.vote not in ("mean", "logistic") or not np.isfinite(self.base):
            raise ValueError(f"vote {self.vote!r} from {self.base}")
        if not np.isfinite(self.leaf).all():
            raise ValueError("a leaf that is no number")
        if self.vote == "mean" and not ((self.leaf >= 0) & (self.leaf <= 1)).all():
            raise ValueError("a probability outside of 0 to 1")

    def laid_out(self, names: tuple[str, ...]) -> TreeNodes:
        """Return the nodes for ``add_leaves``; shallow trees are filled up to complete ones.

        Args:
            names: Names of the columns of the rows that will be given.
        """
        column = np.array([names.index(name) for name in self.features], dtype=np.int64)
        # Rows are float32: a cut becomes the largest float32 that is not above it, so that a value
        # goes to the same side as with the exact cut.
        cut = self.cut.astype(np.float32)
        too_high = cut.astype(np.float64) > self.cut
        cut[too_high] = np.nextafter(cut[too_high], np.float32(-np.inf))
        inner = self.feature >= 0
        splits = np.where(inner, column[self.feature], 0)
        depth = max(self._depth(), 1)  # Nothing to split still is a complete tree.
        if depth > _MAX_COMPLETE_DEPTH:
            return self._linked(cut, splits)
        return self._complete(cut, splits, depth)

    def _linked(self, cut: NDArray[np.float32], splits: NDArray[np.int64]) -> TreeNodes:
        """Return the trees as linked nodes.

        Args:
            cut: Cut of each node in float32, shape (n,).
            splits: Column that each node splits by, shape (n,).
        """
        inner = self.feature >= 0
        link = np.where(inner, (self.left.astype(np.int64) << _FEATURE_BITS) + splits, -1)
        return TreeNodes(
            n_trees=len(self.roots),
            depth=0,
            splits=np.zeros((1, 1), dtype=np.uint8),
            cuts=np.where(inner, cut, self.leaf)[None],
            leaves=np.zeros((1, 1), dtype=np.float32),
            links=link.astype(np.int32),
            roots=self.roots,
        )

    def _complete(
        self, cut: NDArray[np.float32], splits: NDArray[np.int64], depth: int
    ) -> TreeNodes:
        """Return the trees as complete ones: below an early leaf, all leaves are the same.

        Args:
            cut: Cut of each node in float32, shape (n,).
            splits: Column that each node splits by, shape (n,).
            depth: Number of splits from the root to each leaf.
        """
        inner = self.feature >= 0
        n_trees, leaves = len(self.roots), 1 << depth
        complete_splits = np.zeros((n_trees, leaves), dtype=np.uint8)
        cuts = np.full((n_trees, leaves), np.inf, dtype=np.float32)
        here = self.roots.astype(np.int64)[:, None]
        for level in range(depth):
            places = np.arange(1 << level, 2 << level)
            split = inner[here]
            # Nothing is above infinity: an early leaf goes left all the way down.
            complete_splits[:, places] = np.where(split, splits[here], 0)
            cuts[:, places] = np.where(split, cut[here], np.inf)
            left = np.where(split, self.left[here], here)
            right = np.where(split, self.left[here] + 1, here)
            here = np.stack([left, right], axis=2).reshape(n_trees, -1)
        none = np.zeros(1, dtype=np.int32)
        return TreeNodes(n_trees, depth, complete_splits, cuts, self.leaf[here], none, none)

    def _depth(self) -> int:
        """Return the number of splits on the longest path from a root to a leaf.

        Counting ends behind the largest depth that is allowed.
        """
        depth, here = 0, self.roots[self.feature[self.roots] >= 0]
        while len(here) and depth <= _MAX_DEPTH:
            depth += 1
            # Damaged trees share nodes: each is followed once a level.
            children = np.unique(np.concatenate([self.left[here], self.left[here] + 1]))
            here = children[self.feature[children] >= 0]
        return depth

    def between(self, first: int, last: int) -> "Trees":
        """Return some of the trees; ``base`` belongs to the first one.

        Args:
            first: First tree to return.
            last: Tree before which to stop.
        """
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

    def before(self, later: "Trees") -> "Trees":
        """Return these trees and then others on the same features, whose sums of leaves add up.

        Args:
            later: Trees that follow.

        Raises:
            ValueError: If the two differ in features or vote.
        """
        if (self.features, self.vote) != (later.features, later.vote):
            raise ValueError("trees: expected the same features and vote, got different ones")
        n = np.int32(len(self.feature))
        moved = np.where(later.feature >= 0, later.left + n, 0).astype(np.int32)
        return Trees(
            self.features,
            self.vote,
            self.base + later.base,
            np.concatenate([self.roots, later.roots + n]),
            np.concatenate([self.feature, later.feature]),
            np.concatenate([self.cut, later.cut]),
            np.concatenate([self.left, moved]),
            np.concatenate([self.leaf, later.leaf]),
        )

    def probability(self, sums: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the probability of blocked from the sums of leaves, ``base`` included."""
        return 1 / (1 + np.exp(-sums)) if self.vote == "logistic" else sums / len(self.roots)

    def log_odds(self, sums: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the log odds of blocked from the sums of leaves, ``base`` included."""
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
        """Return the trees as arrays and a header for a file; see ``unpacked``.

        Args:
            prefix: Prefix of the arrays' names.
        """
        arrays = {prefix + name: getattr(self, name) for name in COLUMNS}
        return arrays, {"features": list(self.features), "vote": self.vote, "base": self.base}

    @classmethod
    def unpacked(
        cls, arrays: dict[str, NDArray[Any]], header: dict[str, Any], prefix: str, names: set[str]
    ) -> "Trees":
        """Return the trees of ``packed``.

        Args:
            arrays: Arrays of the file, by prefixed name.
            header: Header of these trees.
            prefix: Prefix of their arrays' names.
            names: Names of the features that are known.

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
def add_leaves(
    features: NDArray[np.float32],
    rows: NDArray[np.int64],
    n_rows: int,
    nodes: TreeNodes,
    first: int,
    last: int,
    sums: NDArray[np.float64],
) -> None:
    """Add to ``sums[k]`` the leaves that ``features[rows[k]]`` reaches, for k below ``n_rows``.

    Trees are the outer loop, so that the nodes of one tree stay in the cache for all rows.

    Args:
        features: Features, float32, shape (n, f).
        rows: Rows of ``features`` to classify, int64, shape (m,).
        n_rows: Number of rows to classify, up to m.
        nodes: Trees of ``Trees.laid_out``.
        first: First tree to walk.
        last: Tree before which to stop.
        sums: Sums to add to, float64, shape (m,).
    """
    if nodes.depth == 0:
        _walk_links(features, rows, n_rows, nodes, first, last, sums)
        return
    splits, cuts, leaves = nodes.splits, nodes.cuts, nodes.leaves
    # Unsigned indices spare numba the test for negative ones.
    one, bottom = np.uint64(1), np.uint64(1 << nodes.depth)
    for tree in range(first, last):
        for k in range(n_rows):
            row = rows[k]
            i = one
            for _ in range(nodes.depth):
                # One bit a level: 0 goes left, 1 goes right.
                i = (i << one) | np.uint64(
                    features[row, np.uint64(splits[tree, i])] > cuts[tree, i]
                )
            sums[k] += leaves[tree, i - bottom]


@kernel
def _walk_links(
    features: NDArray[np.float32],
    rows: NDArray[np.int64],
    n_rows: int,
    nodes: TreeNodes,
    first: int,
    last: int,
    sums: NDArray[np.float64],
) -> None:
    """Walk linked trees; see ``add_leaves``."""
    values, links = nodes.cuts[0], nodes.links
    mask = np.int32((1 << _FEATURE_BITS) - 1)
    for root in nodes.roots[first:last]:
        for k in range(n_rows):
            node = root
            link = links[node]
            while link >= 0:
                # The children are neighbours in memory: the right one is the next.
                right = features[rows[k], link & mask] > values[node]
                node = (link >> _FEATURE_BITS) + np.int32(right)
                link = links[node]
            sums[k] += values[node]
