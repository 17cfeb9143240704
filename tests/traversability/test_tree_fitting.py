"""Fitted trees as flat arrays are those of scikit-learn."""

import numpy as np
import pytest
from sklearn.ensemble import HistGradientBoostingClassifier, RandomForestClassifier

from tests.traversability.made_cells import GRID, cells
from traversability.features import ALL_FEATURES, PAPER_FEATURES
from traversability.forest import Forest, Thresholds
from traversability.tree_fitting import flatten_boosted, flatten_random


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
