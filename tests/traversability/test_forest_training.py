"""Training of the forest: same seed same bytes, thresholds from costs, the screen's losses."""

import numpy as np
import pytest

from tests.support.cell_samples import GRID, SMALL, cells
from traversability.features import ALL_FEATURES, OWN_FEATURES
from traversability.forest import Forest
from traversability.forest_training import (
    PAPER_RECIPE,
    cheapest_threshold,
    importances,
    train_forest,
)


@pytest.fixture(scope="module")
def forest():
    """Return a small forest."""
    return train_forest(cells(), GRID, SMALL, seed=1, summary={"cells": 4000})


def test_the_screen_decides_cells_and_loses_few_blocked_ones(forest):
    """It uses own features alone, and decides some cells, nearly all of them free."""
    samples = cells(8000, seed=5)
    assert set(forest.screen.trees.features) == set(OWN_FEATURES)
    bare = Forest(forest.trees, forest.thresholds, GRID)
    with_, without = (f.predict_proba(samples.features) for f in (forest, bare))
    screened = with_ != without
    assert 0.05 < screened.mean() < 0.95
    assert samples.blocked[screened].mean() < 0.04


@pytest.mark.parametrize("recipe", [SMALL, PAPER_RECIPE.model_copy(update={"trees": 10})])
def test_the_same_seed_gives_the_same_forest(recipe):
    """Files are equal byte by byte."""
    first, second = (train_forest(cells(), GRID, recipe, seed=1) for _ in range(2))
    assert first.to_bytes() == second.to_bytes()


def test_a_feature_can_be_left_out():
    """A feature that is left out changes no probability."""
    config = SMALL.model_copy(update={"excluded_features": ("roughness",)})
    forest = train_forest(cells(), GRID, config, seed=1)
    assert "roughness" not in forest.trees.features
    samples = cells(500, seed=2).features
    moved = samples.copy()
    moved[:, 0] += 10
    np.testing.assert_array_equal(forest.predict_proba(samples), forest.predict_proba(moved))


def test_the_threshold_is_that_of_calibration():
    """With calibrated probabilities the cheapest threshold is 1 / (1 + cost)."""
    rng = np.random.default_rng(0)
    probability = rng.random(50_000)
    blocked = rng.random(50_000) < probability  # Perfectly calibrated.
    for cost in (1.0, 3.0, 9.0):
        assert cheapest_threshold(blocked, probability, cost) == pytest.approx(
            1 / (1 + cost), abs=0.04
        )


def test_cells_of_one_kind_are_refused():
    """There is nothing to separate."""
    samples = cells()
    free = samples.select(~samples.blocked)
    with pytest.raises(ValueError, match="expected cells of both kinds"):
        train_forest(free, GRID, SMALL, 0)


def test_the_features_that_decide_are_the_important_ones(forest):
    """Labels depend on the columns 0, 4 and 30: shuffling these costs most."""
    found = importances(forest, cells(2000, seed=4), seed=0)
    values = list(found.values())
    assert values == sorted(values, reverse=True)
    assert set(list(found)[:2]) <= {ALL_FEATURES[column] for column in (0, 4, 30)}
