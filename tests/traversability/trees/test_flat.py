"""Trees as flat arrays: equal to scikit-learn's, on cuts and without splits, too."""

import numpy as np
import pytest

from tests.support.cell_samples import GRID, SMALL, cells
from traversability.features import ALL_FEATURES
from traversability.forest import Forest, Thresholds, leaf_sums
from traversability.forest_training import PAPER_RECIPE, train_forest
from traversability.trees.flat import Trees


@pytest.mark.parametrize("recipe", [SMALL, PAPER_RECIPE.model_copy(update={"trees": 10})])
def test_log_odds_and_probability_agree(recipe):
    """Log odds are the logit of the probability, infinite and NaN included."""
    trees = train_forest(cells(), GRID, recipe, seed=1).trees
    shares = np.array([0.1, 0.5, 0.9])
    sums = trees.sum_at(shares)
    np.testing.assert_allclose(trees.probability(sums), shares)
    np.testing.assert_allclose(trees.log_odds(sums), np.log(shares / (1 - shares)), atol=1e-12)
    assert trees.log_odds(np.array([-np.inf]))[0] == -np.inf
    assert np.isnan(trees.log_odds(np.array([np.nan]))[0])


def test_trees_without_a_split_add_their_leaves():
    """The probability is the mean of the leaves."""
    trees = Trees(
        features=("tilt",),
        vote="mean",
        base=0.0,
        roots=np.array([0, 1], dtype=np.int32),
        feature=np.array([-1, -1], dtype=np.int16),
        cut=np.zeros(2),
        left=np.zeros(2, dtype=np.int32),
        leaf=np.array([0.25, 0.75], dtype=np.float32),
    )
    forest = Forest(trees, Thresholds(), GRID)
    features = np.random.default_rng(1).random((20, len(ALL_FEATURES))).astype(np.float32)
    np.testing.assert_allclose(forest.predict_proba(features), 0.5, atol=1e-6)


def stump(cut=0.5, left=1):
    """Return one tree of one split by the first feature."""
    return Trees(
        features=("tilt",),
        vote="mean",
        base=0.0,
        roots=np.zeros(1, dtype=np.int32),
        feature=np.array([0, -1, -1], dtype=np.int16),
        cut=np.array([cut, 0.0, 0.0]),
        left=np.array([left, 0, 0], dtype=np.int32),
        leaf=np.array([0.0, 0.25, 0.75], dtype=np.float32),
    )


@pytest.mark.parametrize("left", [-1, 0, 2, 3])
def test_children_stand_behind_their_parent_and_inside_the_arrays(left):
    """The right child is the next node after the left one: it has to be there, too."""
    with pytest.raises(ValueError, match="a child out of bounds"):
        stump(left=left)


@pytest.mark.parametrize("cut", [0.1, 0.7, -0.3, 0.5])
def test_a_value_goes_to_the_side_of_the_exact_cut(cut):
    """Cuts are no float32 numbers, values are: that nearest to a cut goes right if it is above."""
    trees = stump(cut)
    nearest = np.float32(cut)
    values = np.array([np.nextafter(nearest, np.float32(side)) for side in (-9, 9)] + [nearest])
    features = np.zeros((3, len(ALL_FEATURES)), dtype=np.float32)
    features[:, ALL_FEATURES.index("tilt")] = values
    expected = np.where(values.astype(np.float64) > cut, 0.75, 0.25)
    np.testing.assert_array_equal(leaf_sums(trees, features), expected)


def test_parts_of_the_trees_add_up_to_the_whole():
    """The base belongs to the first part."""
    trees = train_forest(cells(), GRID, SMALL, seed=1).trees
    features = cells(300, seed=2).features
    parts = leaf_sums(trees.between(0, 5), features) + leaf_sums(trees.between(5, 12), features)
    np.testing.assert_allclose(parts, leaf_sums(trees, features), atol=1e-12)


def test_trees_before_others_add_their_sums():
    """The sums of both, base included, add up; other features or another vote are refused."""
    first, second = (train_forest(cells(seed=k), GRID, SMALL, seed=k).trees for k in (1, 2))
    rows = cells(500, seed=3).features
    both = first.before(second)
    expected = leaf_sums(first, rows) + leaf_sums(second, rows)
    np.testing.assert_allclose(leaf_sums(both, rows), expected, atol=1e-9)
    n = len(first.roots)
    part = leaf_sums(both.between(0, n), rows) - second.base
    np.testing.assert_allclose(part, leaf_sums(first, rows), atol=1e-9)
    with pytest.raises(ValueError, match="expected the same features and vote"):
        first.before(stump())


def chain(n_splits, roots=(0,)):
    """Return trees that are one path: the left child of each split is the next one."""
    n = 2 * n_splits + 1
    inner = np.arange(n) % 2 == 0
    inner[-1] = False
    return Trees(
        features=("tilt",),
        vote="logistic",
        base=0.0,
        roots=np.array(roots, dtype=np.int32),
        feature=np.where(inner, 0, -1).astype(np.int16),
        cut=np.zeros(n),
        left=np.where(inner, np.arange(1, n + 1), 0).astype(np.int32),
        leaf=np.zeros(n, dtype=np.float32),
    )


def test_walks_are_bounded():
    """Paths deeper than 64 splits, too many trees and the same tree twice are refused."""
    for n_splits in (0, 1, 7, 8, 64):
        depth = max(n_splits, 1) if n_splits < 8 else 0  # Deep ones keep their links.
        assert chain(n_splits).laid_out(ALL_FEATURES).depth == depth
    with pytest.raises(ValueError, match="a path of more than 64 splits"):
        chain(65)
    with pytest.raises(ValueError, match=r"2 trees, .* out of order"):
        chain(3, (2, 2))
    assert len(chain(3000, range(5900, 6000)).roots) == 100
    with pytest.raises(ValueError, match="5001 trees"):
        chain(3000, range(0, 5001))
