"""Fitted trees as flat arrays are those of scikit-learn."""

import numpy as np
import pytest
from sklearn.ensemble import HistGradientBoostingClassifier, RandomForestClassifier

from tests.support.cell_samples import GRID, cells
from traversability.features import ALL_FEATURES, PAPER_FEATURES
from traversability.forest import Forest, Thresholds, leaf_sums
from traversability.forest_adaptation import AdaptationConfig
from traversability.trees.fitting import fit_correction, flatten_boosted, flatten_random


@pytest.mark.parametrize("depth", [4, 12])
def test_a_random_forest_equals_scikit_learns(depth):
    """Probabilities are equal, for complete trees and for linked ones."""
    samples, fresh = cells(), cells(3000, seed=9).features
    model = RandomForestClassifier(20, max_depth=depth, random_state=0)
    model.fit(samples.features[:, :5], samples.blocked)
    flat = Forest(flatten_random(model, PAPER_FEATURES), Thresholds(), GRID)
    expected = model.predict_proba(fresh[:, :5])[:, 1]
    np.testing.assert_allclose(flat.predict_proba(fresh), expected, atol=1e-6)


@pytest.mark.parametrize("depth", [3, 6, 10])
def test_boosted_trees_equal_scikit_learns(depth):
    """Probabilities are equal, for complete trees and for linked ones."""
    samples, fresh = cells(), cells(3000, seed=9).features
    model = HistGradientBoostingClassifier(max_iter=20, max_depth=depth, max_leaf_nodes=None)
    model.fit(samples.features, samples.blocked)
    flat = Forest(flatten_boosted(model, ALL_FEATURES), Thresholds(), GRID)
    expected = model.predict_proba(fresh)[:, 1]
    np.testing.assert_allclose(flat.predict_proba(fresh), expected, atol=1e-6)


def test_a_value_on_a_cut_goes_left():
    """As in scikit-learn, also where the cut is no float32."""
    samples = cells()
    values = np.round(samples.features, 1).astype(np.float32)
    model = RandomForestClassifier(10, max_depth=6, random_state=0)
    model.fit(values[:, :5], samples.blocked)
    flat = Forest(flatten_random(model, PAPER_FEATURES), Thresholds(), GRID)
    cuts = flat.trees.cut[flat.trees.feature >= 0].astype(np.float32)
    values[:, 0] = np.resize(cuts, len(values))
    expected = model.predict_proba(values[:, :5])[:, 1]
    np.testing.assert_allclose(flat.predict_proba(values), expected, atol=1e-6)


SETTINGS = AdaptationConfig(max_depth=3, learning_rate=1.0, l2_regularization=0.0)


def correction(samples, sums, trees=1, config=SETTINGS, weights=None):
    """Return trees that correct log odds of samples, fitted to all features."""
    weights = np.ones(len(sums)) if weights is None else weights
    words = (weights, ALL_FEATURES, trees, 1.0, config, 0)
    return fit_correction(samples.features, samples.blocked, sums, *words)


def test_a_correction_of_one_leaf_is_a_newton_step():
    """Without a split the leaf is the weighted gradient over curvature and penalty, times rate."""
    samples = cells(400)
    sums, weights = np.linspace(-2, 2, 400), np.linspace(0.5, 2, 400)
    config = SETTINGS.model_copy(
        update={"min_leaf": 300, "learning_rate": 0.3, "l2_regularization": 7.0}
    )
    (leaf,) = correction(samples, sums, 1, config, weights).leaf
    p = 1 / (1 + np.exp(-sums))
    expected = 0.3 * (weights * (samples.blocked - p)).sum() / ((weights * p * (1 - p)).sum() + 7)
    assert leaf == pytest.approx(expected, rel=1e-5)


def test_a_correction_goes_on_from_the_given_log_odds():
    """Wrong log odds are put right, those that are right already are left alone."""
    samples = cells(2000)
    right = np.where(samples.blocked, 3.0, -3.0)
    for start, least in ((-right, 0.9), (right, 1.0)):
        trees = correction(
            samples, start, 25, SETTINGS.model_copy(update={"l2_regularization": 1.0})
        )
        after = start + leaf_sums(trees, samples.features)
        assert ((after > 0) == samples.blocked).mean() >= least
    assert (after * right > 0).all()


def test_equal_seeds_give_equal_corrections():
    """Trees with a share of the features depend on the seed alone."""
    samples, sums = cells(1000), np.zeros(1000)
    one, two, other = (
        fit_correction(
            samples.features,
            samples.blocked,
            sums,
            np.ones(1000),
            ALL_FEATURES,
            5,
            0.2,
            SETTINGS,
            seed,
        )
        for seed in (3, 3, 40)
    )
    assert (one.leaf == two.leaf).all()
    assert len(one.leaf) != len(other.leaf) or (one.leaf != other.leaf).any()
