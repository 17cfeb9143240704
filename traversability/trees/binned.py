"""Shallow trees on features in bins: all nodes of a tree at once, for many rows at once.

A walk from the root cannot read a node before the comparison at its parent is done. Here every
node of a complete tree compares its feature in hundreds of rows with its cut, and passes up the
leaf that the comparison selects of the two below. That is ten times the comparisons, but none
depends on another, and features are given by the number of cuts below them, in a byte: compilers
pack 16 to 64 of them into one instruction. Cuts as integers are those of QuickScorer (Lucchese et
al. 2015).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.trees.flat import TreeNodes

_MAX_CUTS = 255
"""Largest number of different cuts of a column, so that a byte holds how many are below a value."""

_BLOCK = 1024
"""Number of rows at a time, most ground cells of a cloud: their bins and selected leaves stay in
the fastest cache, and few starts of loops are shared by many rows."""

_MAX_DEPTH = 8
"""Largest depth of a tree, so that a byte holds the number of a leaf."""

_LANES = 64
"""Number of bytes that the widest processors compare at once: rows are rounded up to it."""


class BinnedTrees(NamedTuple):
    """Complete trees whose cuts are counted, laid out for ``add_binned_leaves``.

    Node ``i`` has the children ``2 i`` and ``2 i + 1``, the root is node 1; see ``TreeNodes``.

    Attributes:
        cuts: Different cuts of each column in ascending order, one column after the other, each
            filled up to an even number by infinity, float32, shape (c,).
        begins: First cut of each column, and the end of the last one, int64, shape (f + 1,).
        splits: Column that each node splits by, uint8, shape (t, 2^depth).
        ranks: Number of the column's cuts below the node's own, ``_MAX_CUTS`` where every value
            goes left, uint8, shape (t, 2^depth).
        leaves: Leaves from left to right, float32, shape (t, 2^depth).
    """

    cuts: NDArray[np.float32]
    begins: NDArray[np.int64]
    splits: NDArray[np.uint8]
    ranks: NDArray[np.uint8]
    leaves: NDArray[np.float32]


def bin_trees(nodes: TreeNodes, n_columns: int) -> BinnedTrees:
    """Return complete trees with their cuts counted.

    Args:
        nodes: Trees of ``Trees.laid_out``.
        n_columns: Number of columns of the rows that will be given.

    Raises:
        ValueError: If the trees are too deep to be complete, or a column has too many cuts.
    """
    if nodes.depth == 0:
        raise ValueError("trees: expected few splits from root to leaf, got too many for bins")
    own = [
        np.unique(nodes.cuts[(nodes.splits == k) & np.isfinite(nodes.cuts)])
        for k in range(n_columns)
    ]
    most = max(map(len, own))
    if most > _MAX_CUTS:
        raise ValueError(f"cuts: expected at most {_MAX_CUTS} different ones a column, got {most}")
    ranks = np.full(nodes.cuts.shape, _MAX_CUTS, dtype=np.uint8)
    for k, cuts in enumerate(own):
        here = (nodes.splits == k) & np.isfinite(nodes.cuts)
        ranks[here] = np.searchsorted(cuts, nodes.cuts[here])
    # No value lies above infinity, so that it counts for nothing.
    even = [np.append(cuts, np.full(len(cuts) % 2, np.inf, dtype=np.float32)) for cuts in own]
    begins = np.cumsum([0, *map(len, even)])
    return BinnedTrees(np.concatenate(even), begins, nodes.splits, ranks, nodes.leaves)


@kernel
def sum_binned_leaves(
    features: NDArray[np.float32], trees: BinnedTrees, base: float
) -> NDArray[np.float64]:
    """Return the sum of the leaves that each row reaches, and a base, float64, shape (n,).

    Args:
        features: Features, float32, shape (n, f).
        trees: Trees of ``bin_trees``.
        base: Number at which the sums begin.
    """
    leaf_sums = np.full(len(features), base)
    add_binned_leaves(features, trees, leaf_sums)
    return leaf_sums


@kernel
def add_binned_leaves(
    features: NDArray[np.float32], trees: BinnedTrees, sums: NDArray[np.float64]
) -> None:
    """Add to each sum the leaves that its row reaches, tree by tree: what ``add_leaves`` adds.

    Args:
        features: Features, float32, shape (n, f).
        trees: Trees of ``bin_trees``.
        sums: Sums to add to, float64, shape (n,).
    """
    bins = np.zeros((features.shape[1], _BLOCK), dtype=np.uint8)
    # A node waits for its right neighbour: at most one of each level is kept, and a new one.
    selected = np.empty((_MAX_DEPTH + 1, _BLOCK), dtype=np.uint8)
    for first in range(0, len(sums), _BLOCK):
        n = min(_BLOCK, len(sums) - first)
        _fill_bins(features[first : first + n], trees, bins)
        # Beyond the last row are bins of no meaning, whose leaves are not added.
        width = -(-n // _LANES) * _LANES
        for tree in range(len(trees.leaves)):
            _select_leaves(bins[:, :width], trees.splits[tree], trees.ranks[tree], selected)
            leaves, chosen = trees.leaves[tree], selected[0]
            for k in range(n):
                sums[first + k] += leaves[np.uint64(chosen[k])]


@kernel
def _fill_bins(features: NDArray[np.float32], trees: BinnedTrees, bins: NDArray[np.uint8]) -> None:
    """Write how many of its column's cuts lie below each value; NaN is above none.

    Args:
        features: Features, shape (n, f).
        trees: Trees with the cuts.
        bins: Output in the first n columns, uint8, shape (f, _BLOCK).
    """
    n = len(features)
    values = np.empty(n, dtype=np.float32)
    for column in range(features.shape[1]):
        values[:] = features[:, column]
        own = bins[column, :n]
        own[:] = 0
        # Two cuts at a time, which halves the ways to memory.
        for c in range(trees.begins[column], trees.begins[column + 1], 2):
            cut, next_cut = trees.cuts[c], trees.cuts[c + 1]
            for k in range(n):
                value = values[k]
                own[k] += np.uint8(value > cut) + np.uint8(value > next_cut)


@kernel
def _select_leaves(
    bins: NDArray[np.uint8],
    splits: NDArray[np.uint8],
    ranks: NDArray[np.uint8],
    selected: NDArray[np.uint8],
) -> None:
    """Write the number of the leaf that each row reaches in one tree.

    Nodes come in the order in which both below are known, those of the lowest level from left to
    right: what is selected is read again at once.

    Args:
        bins: Bins of the rows, shape (f, width).
        splits: Column that each node splits by, shape (2^depth,).
        ranks: Rank of each node's cut, shape (2^depth,).
        selected: Memory for the leaves that are selected below nodes which wait for their parent,
            shape (depth + 1, width); the first row is the output.
    """
    width, half, waiting = bins.shape[1], len(ranks) // 2, 0
    for lowest in range(half, 2 * half):
        own, rank, leaves = bins[splits[lowest]], ranks[lowest], selected[waiting, :width]
        left = np.uint8(2 * (lowest - half))
        for k in range(width):
            leaves[k] = left + np.uint8(own[k] > rank)
        node = lowest
        while node > 1 and node % 2 == 1:  # A right child: the left one waits.
            node //= 2
            waiting -= 1
            own, rank = bins[splits[node]], ranks[node]
            lefts, rights = selected[waiting, :width], selected[waiting + 1, :width]
            for k in range(width):
                # Both are read before the choice: a branch would keep the compiler from packing.
                left, right = lefts[k], rights[k]
                lefts[k] = right if own[k] > rank else left
        waiting += 1
