"""The flat trees equal scikit-learn's, and files that could not be walked safely are refused."""

import numpy as np
import pytest
from sklearn.ensemble import HistGradientBoostingClassifier, RandomForestClassifier

from traversability.arrays import pack, unpack
from traversability.dataset import CellSamples
from traversability.features import ALL_FEATURES, OWN_FEATURES, PAPER_FEATURES, CellFeatures
from traversability.forest import Forest, ForestFileError, Thresholds
from traversability.forest_training import (
    PAPER_RECIPE,
    ForestConfig,
    cheapest_threshold,
    train_forest,
)
from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.tree_fitting import flatten_boosted, flatten_random
from traversability.trees import Trees

GRID = PolarGrid()
SMALL = ForestConfig(trees=12, screen_trees=20, screen_loss=0.02)


def cells(n=4000, seed=0):
    rng = np.random.default_rng(seed)
    features = rng.normal(size=(n, len(ALL_FEATURES))).astype(np.float32)
    red = features[:, 0] + 0.5 * features[:, 4] + features[:, 30] + rng.normal(0, 0.3, n) > 1
    world = np.arange(n) // (n // 20)
    ring = rng.integers(0, GRID.n_rings, n).astype(np.int32)
    return CellSamples(features, red, red | True, 0, ring, world.astype(np.int32), world)


@pytest.fixture(scope="module")
def forest():
    return train_forest(cells(), GRID, SMALL, seed=1, summary={"cells": 4000})


@pytest.mark.parametrize("depth", [4, 12])
def test_a_random_forest_equals_scikit_learns(depth):
    samples, fresh = cells(), cells(3000, seed=9).features
    model = RandomForestClassifier(20, max_depth=depth, random_state=0)
    model.fit(samples.features[:, :5], samples.blocked)
    flat = Forest(flatten_random(model, PAPER_FEATURES), Thresholds(), GRID)
    expected = model.predict_proba(fresh[:, :5])[:, 1]
    np.testing.assert_allclose(flat.predict_proba(fresh), expected, atol=1e-6)


@pytest.mark.parametrize("depth", [3, 6, 10])
def test_boosted_trees_equal_scikit_learns(depth):
    samples, fresh = cells(), cells(3000, seed=9).features
    model = HistGradientBoostingClassifier(max_iter=20, max_depth=depth, max_leaf_nodes=None)
    model.fit(samples.features, samples.blocked)
    flat = Forest(flatten_boosted(model, ALL_FEATURES), Thresholds(), GRID)
    expected = model.predict_proba(fresh)[:, 1]
    np.testing.assert_allclose(flat.predict_proba(fresh), expected, atol=1e-6)


def test_a_value_on_a_cut_goes_left():
    samples = cells()
    values = np.round(samples.features, 1).astype(np.float32)
    model = RandomForestClassifier(10, max_depth=6, random_state=0)
    model.fit(values[:, :5], samples.blocked)
    flat = Forest(flatten_random(model, PAPER_FEATURES), Thresholds(), GRID)
    cuts = flat.trees.cut[flat.trees.feature >= 0].astype(np.float32)
    values[:, 0] = np.resize(cuts, len(values))
    expected = model.predict_proba(values[:, :5])[:, 1]
    np.testing.assert_allclose(flat.predict_proba(values), expected, atol=1e-6)


def test_the_screen_spares_cells_and_loses_few_red_ones(forest):
    samples = cells(8000, seed=5)
    assert set(forest.screen.trees.features) == set(OWN_FEATURES)
    bare = Forest(forest.trees, forest.thresholds, GRID)
    with_, without = (f.predict_proba(samples.features) for f in (forest, bare))
    spared = with_ != without
    assert 0.05 < spared.mean() < 0.95
    assert samples.blocked[spared].mean() < 0.04


def test_bytes_come_back_the_same(forest):
    again = Forest.from_bytes(forest.to_bytes())
    fresh = cells(500, seed=3).features
    np.testing.assert_array_equal(again.predict_proba(fresh), forest.predict_proba(fresh))
    for name in ("thresholds", "grid", "summary"):
        assert getattr(again, name) == getattr(forest, name)
    assert again.to_bytes() == forest.to_bytes()


@pytest.mark.parametrize("recipe", [SMALL, PAPER_RECIPE.model_copy(update={"trees": 10})])
def test_the_same_seed_gives_the_same_forest(recipe):
    first, second = (train_forest(cells(), GRID, recipe, seed=1) for _ in range(2))
    assert first.to_bytes() == second.to_bytes()


@pytest.mark.parametrize("recipe", [SMALL, PAPER_RECIPE.model_copy(update={"trees": 10})])
def test_odds_and_probability_tell_the_same(recipe):
    trees = train_forest(cells(), GRID, recipe, seed=1).trees
    shares = np.array([0.1, 0.5, 0.9])
    sums = trees.sum_at(shares)
    np.testing.assert_allclose(trees.probability(sums), shares)
    np.testing.assert_allclose(trees.log_odds(sums), np.log(shares / (1 - shares)), atol=1e-12)
    assert trees.log_odds(np.array([-np.inf]))[0] == -np.inf
    assert np.isnan(trees.log_odds(np.array([np.nan]))[0])


def test_a_feature_can_be_left_out():
    config = SMALL.model_copy(update={"without": ("roughness",)})
    forest = train_forest(cells(), GRID, config, seed=1)
    assert "roughness" not in forest.trees.features
    samples = cells(500, seed=2).features
    moved = samples.copy()
    moved[:, 0] += 10
    np.testing.assert_array_equal(forest.predict_proba(samples), forest.predict_proba(moved))


def test_cells_with_few_points_stay_empty(forest):
    counts = np.full((GRID.n_sectors, GRID.n_rings), 4, dtype=np.int32)
    counts[2, 3] = 5
    values = np.zeros((*counts.shape, len(ALL_FEATURES)), dtype=np.float32)
    states = forest.classify(CellFeatures(values, counts), GRID)
    assert states[2, 3] != CellState.EMPTY
    assert (states != CellState.EMPTY).sum() == 1


def test_another_grid_is_refused_but_for_the_number_of_sectors(forest):
    forest.check_grid(PolarGrid(n_sectors=64))
    with pytest.raises(ValueError, match=r"10 rings to 10\.0 m over the ground that the forest"):
        forest.check_grid(PolarGrid(n_rings=8))
    with pytest.raises(ValueError, match="over the base"):
        forest.check_grid(PolarGrid(cut="base"))


def test_the_threshold_falls_as_misses_grow_dear():
    rng = np.random.default_rng(0)
    probability = rng.random(50_000)
    red = rng.random(50_000) < probability  # Perfectly calibrated.
    for cost in (1.0, 3.0, 9.0):
        assert cheapest_threshold(red, probability, cost) == pytest.approx(1 / (1 + cost), abs=0.04)


def test_near_rings_have_their_own_threshold():
    limits = Thresholds(near=0.1, far=0.3, near_range=5.0).of_rings(GRID)
    np.testing.assert_array_equal(limits == 0.1, GRID.ring_edges[:-1] < 5.0)
    assert set(limits) == {0.1, 0.3}


def test_one_colour_cannot_be_learnt():
    samples = cells()
    green = samples.select(~samples.blocked)
    with pytest.raises(ValueError, match="expected cells of both kinds"):
        train_forest(green, GRID, SMALL, 0)


@pytest.mark.parametrize(
    ("name", "change"),
    [
        ("left", lambda a: np.where(a > 0, 1, a).astype(a.dtype)),
        ("left", lambda a: a + np.int32(10_000_000)),
        ("screen_left", lambda a: a + np.int32(10_000_000)),
        ("feature", lambda a: np.where(a >= 0, 500, a).astype(a.dtype)),
        ("cut", lambda a: a * np.nan),
        ("roots", lambda a: a - np.int32(1)),
        ("leaf", lambda a: a + np.float32(np.inf)),
        ("leaf", lambda a: a[:-1]),
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


def test_trees_that_found_nothing_to_split_say_what_their_leaves_say():
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
    forest = Forest(trees, Thresholds(), PolarGrid())
    features = np.random.default_rng(1).random((20, len(ALL_FEATURES))).astype(np.float32)
    np.testing.assert_allclose(forest.predict_proba(features), 0.5, atol=1e-6)
