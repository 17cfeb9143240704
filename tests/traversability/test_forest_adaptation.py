"""Adaptation of a forest to cells of one's own ground."""

from dataclasses import replace

import numpy as np
import pytest

from tests.support.cell_samples import GRID, SMALL, cells
from traversability import forest_adaptation
from traversability.forest import Forest, leaf_sums
from traversability.forest_adaptation import AdaptationConfig, adapt_forest, sample_scores
from traversability.forest_training import PAPER_RECIPE, train_forest

CONFIG = AdaptationConfig(trees=20, cells=2000)


@pytest.fixture(scope="module")
def forest():
    """Return a small forest with exits."""
    return train_forest(cells(), GRID, SMALL, seed=1, summary={"cells": 4000})


def own_ground(forest, number=1500):
    """Return free cells with a mark of their own that the forest takes for blocked."""
    samples = cells(number * 3, seed=11)
    alarms = forest.predict_proba(samples.features) >= 0.5
    samples = samples.select(alarms)
    features = samples.features.copy()
    features[:, 7] += 40.0  # Nothing in the synthetic cells is like it.
    return replace(samples, features=features, blocked=np.zeros(len(features), dtype=np.bool_))


def test_false_alarms_on_own_ground_vanish_and_recall_stays(forest):
    """Learned from half of the own cells, most false alarms on the others go, recall does not."""
    synthetic, fresh, own = cells(seed=2), cells(seed=3), own_ground(forest)
    half = np.arange(len(own.blocked)) % 2 == 0
    adapted = adapt_forest(forest, synthetic, own.select(half), CONFIG, 0)
    before, after = (sample_scores(each, own.select(~half)) for each in (forest, adapted))
    assert before.fp > 100
    assert after.fp < before.fp / 2
    before, after = (sample_scores(each, fresh) for each in (forest, adapted))
    assert after.recall >= before.recall - 0.02


def test_held_out_recall_is_that_of_the_first_forest(forest):
    """On the held-out synthetic worlds no blocked cell fewer is found than before, by zone."""
    synthetic = cells(seed=2)
    config = CONFIG.model_copy(update={"held_out": 0.99})  # All worlds but one are held out.
    adapted = adapt_forest(forest, synthetic, own_ground(forest), config, 0)
    worlds = np.random.default_rng(0).permutation(np.unique(synthetic.world))
    held = synthetic.select(np.isin(synthetic.world, worlds[:-1]))
    whole = replace(adapted, exits=())
    assert sample_scores(whole, held).tp >= sample_scores(forest, held).tp - 1


def test_corrections_are_fitted_to_the_cells_that_the_forest_sees(forest, monkeypatch):
    """Those from the screen's limit on, that sum itself included, as the forest passes them."""
    own, synthetic = own_ground(forest), cells(seed=2)
    sums = leaf_sums(forest.screen.trees, own.features)
    limit = float(np.sort(sums)[len(sums) // 2])
    screened = replace(forest, screen=replace(forest.screen, limit=limit))
    fitted = []

    def fit(features, blocked, *others):
        fitted.append((len(features), int(blocked.sum())))
        raise InterruptedError

    monkeypatch.setattr(forest_adaptation, "fit_correction", fit)
    config = CONFIG.model_copy(update={"cells": 10_000})
    with pytest.raises(InterruptedError):
        adapt_forest(screened, synthetic, own, config, 0)
    worlds = np.random.default_rng(0).permutation(np.unique(synthetic.world))
    learned = synthetic.select(~np.isin(synthetic.world, worlds[:6]))  # 30 % of 20 are held out.
    passed = leaf_sums(forest.screen.trees, learned.features) >= limit
    assert (sums == limit).any()
    assert fitted == [
        (int(passed.sum() + (sums >= limit).sum()), int((passed & learned.blocked).sum()))
    ]


def test_an_adapted_forest_is_kept_and_read_as_any_other(forest):
    """The file holds trees, exits and both accounts; equal seeds give equal bytes."""
    arguments = (forest, cells(seed=2), own_ground(forest), CONFIG, 5, {"recordings": ["a.bag"]})
    one, two = (adapt_forest(*arguments) for _ in range(2))
    assert one.to_bytes() == two.to_bytes()
    read = Forest.from_bytes(one.to_bytes())
    assert read.summary == {"cells": 4000, "adaptation": {"recordings": ["a.bag"]}}
    assert len(read.trees.roots) == len(forest.trees.roots) + CONFIG.trees
    rows = cells(500, seed=8).features
    np.testing.assert_array_equal(read.predict_proba(rows), one.predict_proba(rows))


def test_a_forest_that_cannot_be_corrected_is_refused(forest):
    """A random forest has no log odds to add to; one world leaves nothing to hold out."""
    random = train_forest(cells(), GRID, PAPER_RECIPE.model_copy(update={"trees": 5}), seed=1)
    with pytest.raises(ValueError, match="expected boosted trees"):
        adapt_forest(random, cells(), cells(), CONFIG, 0)
    one = cells()
    one = replace(one, world=np.zeros_like(one.world))
    with pytest.raises(ValueError, match="expected two worlds or more, got 1"):
        adapt_forest(forest, one, cells(), CONFIG, 0)


def test_scores_are_those_of_the_thresholds_of_each_ring(forest):
    """Cells are called blocked from the threshold of their own ring on."""
    samples = cells(800, seed=4)
    limits = forest.thresholds.of_rings(GRID)[samples.ring]
    called = forest.predict_proba(samples.features) >= limits
    scores = sample_scores(forest, samples)
    assert scores.tp == (called & samples.blocked).sum()
    assert scores.fp == (called & ~samples.blocked).sum()
    assert scores.tp + scores.fn == samples.blocked.sum()
