"""Trees in bins: equal to walked trees, bit by bit, and refused where they do not fit."""

import numpy as np
import pytest

from traversability.trees.binned import add_binned_leaves, bin_trees
from traversability.trees.fitting import fit_boosted
from traversability.trees.flat import TreeNodes, Trees, add_leaves

NAMES = tuple("abcde")


class Config:
    """Parameters of small trees."""

    max_depth, min_leaf, learning_rate, l2_regularization = 6, 5, 0.3, 1.0


def boosted(depth=6, seed=0):
    """Return features and boosted trees of a rule that needs several of them."""
    rng, config = np.random.default_rng(seed), Config()
    config.max_depth = depth
    features = rng.normal(0, 1, (3_000, len(NAMES))).astype(np.float32)
    blocked = features[:, 0] * features[:, 1] + features[:, 2] > rng.normal(0, 0.3, 3_000)
    return features, fit_boosted(features, blocked, NAMES, 12, config, seed)


def walked(features, nodes):
    """Return the sums of leaves that walks reach."""
    sums = np.full(len(features), 0.25)
    add_leaves(features, np.arange(len(features)), len(features), nodes, 0, nodes.n_trees, sums)
    return sums


@pytest.mark.parametrize("depth", [1, 2, 5, 6, 7])
def test_sums_are_those_of_walks_bit_by_bit(depth):
    """For every depth, and around the sizes of blocks and lanes."""
    features, trees = boosted(depth)
    nodes = trees.laid_out(NAMES)
    binned = bin_trees(nodes, len(NAMES))
    for n_rows in (0, 1, 63, 64, 65, 1023, 1025, 1500):
        sums = np.full(n_rows, 0.25)
        add_binned_leaves(features[:n_rows], binned, sums)
        np.testing.assert_array_equal(sums, walked(features[:n_rows], nodes))


def test_values_on_a_cut_beside_it_and_no_numbers_go_where_walks_go():
    """A value equal to a cut goes left, the next one right, and NaN left."""
    _, trees = boosted()
    nodes = trees.laid_out(NAMES)
    binned = bin_trees(nodes, len(NAMES))
    on = binned.cuts[binned.begins[0] : binned.begins[1]]
    values = [on, np.nextafter(on, np.float32(np.inf)), np.nextafter(on, np.float32(-np.inf))]
    values = np.concatenate([*values, np.float32([np.nan, np.inf, -np.inf])])
    rows = np.zeros((len(values), len(NAMES)), dtype=np.float32)
    rows[:, 0] = values
    sums = np.full(len(rows), 0.25)
    add_binned_leaves(rows, binned, sums)
    np.testing.assert_array_equal(sums, walked(rows, nodes))


def stump(leaf):
    """Return a tree without a split."""
    zero = np.zeros(1, dtype=np.int32)
    return Trees(NAMES, "logistic", 0.0, zero, np.int16([-1]), np.zeros(1), zero, leaf)


def test_a_tree_without_a_split_adds_its_leaf():
    """Every value goes left."""
    binned = bin_trees(stump(np.float32([0.5])).laid_out(NAMES), len(NAMES))
    sums = np.zeros(3)
    add_binned_leaves(np.full((3, len(NAMES)), 9.0, dtype=np.float32), binned, sums)
    assert sums.tolist() == [0.5, 0.5, 0.5]


def test_trees_that_do_not_fit_are_refused():
    """Too deep ones, and too many cuts of a column."""
    deep = boosted(9)[1].laid_out(NAMES)
    with pytest.raises(ValueError, match="expected few splits from root to leaf"):
        bin_trees(deep, len(NAMES))
    cuts = np.arange(512, dtype=np.float32).reshape(4, 128)
    some = np.zeros((4, 128), dtype=np.uint8)
    none = np.zeros(1, dtype=np.int32)
    many = TreeNodes(4, 7, some, cuts, cuts, none, none)
    with pytest.raises(ValueError, match="at most 255 different ones a column, got 5"):
        bin_trees(many, len(NAMES))
