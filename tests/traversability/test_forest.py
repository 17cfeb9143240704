"""The flat forest equals scikit-learn's, and refuses files that it could not walk safely."""

import numpy as np
import pytest
from sklearn.ensemble import RandomForestClassifier

from traversability.arrays import pack, unpack
from traversability.features import CellFeatures
from traversability.forest import (
    Forest,
    ForestConfig,
    ForestFileError,
    best_threshold,
    flatten,
    train_forest,
)
from traversability.grid import PolarGrid
from traversability.labels import CellState

GRID = PolarGrid()


def cells(n=2000, seed=0):
    rng = np.random.default_rng(seed)
    features = rng.normal(size=(n, 5)).astype(np.float32)
    red = features[:, 0] + 0.5 * features[:, 4] + rng.normal(0, 0.5, n) > 0.5
    return features, red


@pytest.fixture(scope="module")
def forest():
    return train_forest(*cells(), GRID, ForestConfig(trees=30), seed=1, summary={"cells": 2000})


def test_probabilities_equal_scikit_learns():
    features, red = cells()
    model = RandomForestClassifier(40, max_depth=12, random_state=0).fit(features, red)
    flat = flatten(model, 0.5, GRID, {})
    fresh, _ = cells(3000, seed=9)
    np.testing.assert_allclose(
        flat.predict_proba(fresh), model.predict_proba(fresh)[:, 1], atol=1e-6
    )


def test_bytes_come_back_the_same(forest):
    again = Forest.from_bytes(forest.to_bytes())
    fresh, _ = cells(500, seed=3)
    np.testing.assert_array_equal(again.predict_proba(fresh), forest.predict_proba(fresh))
    assert (again.threshold, again.grid, again.summary) == (
        forest.threshold,
        forest.grid,
        forest.summary,
    )
    assert again.to_bytes() == forest.to_bytes()


def test_the_same_seed_gives_the_same_forest(forest):
    again = train_forest(*cells(), GRID, ForestConfig(trees=30), seed=1, summary={"cells": 2000})
    assert again.to_bytes() == forest.to_bytes()


def test_cells_with_few_points_stay_empty(forest):
    counts = np.full((GRID.n_sectors, GRID.n_rings), 4, dtype=np.int32)
    counts[2, 3] = 5
    values = np.zeros((*counts.shape, 5), dtype=np.float32)
    states = forest.classify(CellFeatures(values, counts), GRID)
    assert states[2, 3] != CellState.EMPTY
    assert (states != CellState.EMPTY).sum() == 1


def test_another_grid_is_refused(forest):
    features = CellFeatures(np.zeros((32, 8, 5), np.float32), np.zeros((32, 8), np.int32))
    with pytest.raises(ValueError, match=r"10 rings to 10\.0 m that the forest was trained for"):
        forest.classify(features, PolarGrid(n_rings=8))


def test_the_threshold_balances_both_errors():
    red = np.array([True] * 10 + [False] * 90)
    probability = np.where(red, 0.35, 0.1)
    assert 0.2 <= best_threshold(red, probability) <= 0.35


def test_one_colour_cannot_be_learnt():
    with pytest.raises(ValueError, match="expected cells of both kinds"):
        train_forest(cells()[0], np.zeros(2000, dtype=bool), GRID, ForestConfig(), 0)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("left", lambda a: np.where(a > 0, 1, a).astype(a.dtype)),
        ("left", lambda a: a + np.int32(10_000_000)),
        ("feature", lambda a: np.where(a >= 0, 7, a).astype(a.dtype)),
        ("cut", lambda a: a * np.nan),
        ("roots", lambda a: a - np.int32(1)),
        ("red", lambda a: a + np.float32(1)),
        ("red", lambda a: a[:-1]),
        ("cut", lambda a: a.astype(np.float32)),
    ],
)
def test_a_forest_that_cannot_be_walked_is_refused(forest, name, change):
    arrays, header = unpack(forest.to_bytes(), 1 << 30)
    arrays[name] = change(arrays[name])
    with pytest.raises(ForestFileError, match="expected a forest written by andabata"):
        Forest.from_bytes(pack(arrays, header))


def test_damaged_bytes_never_crash(forest):
    data = forest.to_bytes()
    rng = np.random.default_rng(0)
    refused = 0
    for _ in range(100):
        spoilt = bytearray(data)
        if rng.random() < 0.3:
            spoilt = spoilt[: rng.integers(len(spoilt))]
        for place in rng.integers(0, max(len(spoilt), 1), 5):
            if len(spoilt):
                spoilt[place] = rng.integers(256)
        try:
            Forest.from_bytes(bytes(spoilt))
        except ForestFileError:
            refused += 1
    assert refused > 90
