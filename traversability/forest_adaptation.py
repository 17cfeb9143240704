"""Adaptation of a forest to cells of one's own ground, beside those that it was trained on.

Boosting goes on from the forest's own log odds: what it knows of all worlds stays, and a few
shallow trees correct it where the new cells disagree. So minutes and some hundred clouds do, where
a new forest takes all clouds that the old one was trained on.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from traversability.dataset import CellSamples, join_samples
from traversability.features import ALL_FEATURES
from traversability.forest import Forest, Thresholds, leaf_sums
from traversability.forest_training import ForestConfig, early_exits
from traversability.labels import CellState
from traversability.scores import CellScores
from traversability.trees.fitting import fit_correction
from traversability.trees.flat import Trees

_THRESHOLDS = np.round(np.arange(0.02, 0.805, 0.01), 2)
"""Thresholds to choose from, as in training."""


class AdaptationConfig(BaseModel):
    """Parameters of the adaptation.

    Attributes:
        trees: Number of trees that correct the forest.
        max_depth: Largest number of splits from the root of a tree to a leaf.
        min_leaf: Smallest number of cells in a leaf.
        learning_rate: Learning rate.
        l2_regularization: L2 penalty of leaves.
        feature_share: Share of the features that each split chooses from.
        own_share: Share of the new cells in the weight of all cells.
        cells: Largest number of synthetic cells to fit to, drawn by chance.
        held_out: Share of the synthetic worlds on which thresholds and exits are chosen.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    trees: int = Field(default=60, ge=1, le=1000)
    max_depth: int = Field(default=4, ge=1, le=7)
    min_leaf: int = Field(default=20, ge=1)
    learning_rate: float = Field(default=0.2, gt=0, le=1)
    l2_regularization: float = Field(default=5.0, ge=0)
    feature_share: float = Field(default=0.25, gt=0, le=1)
    own_share: float = Field(default=0.3, gt=0, lt=1)
    cells: int = Field(default=40_000, ge=100)
    held_out: float = Field(default=0.3, gt=0, lt=1)


def adapt_forest(
    forest: Forest,
    synthetic: CellSamples,
    own: CellSamples,
    config: AdaptationConfig,
    seed: int,
    summary: dict[str, Any] | None = None,
) -> Forest:
    """Return a forest that is corrected by cells of one's own ground.

    On held-out synthetic worlds its thresholds are the highest ones with the recall that the forest
    has there without the correction: what is learned about free ground costs no recall.

    Args:
        forest: Boosted forest.
        synthetic: Labelled cells of synthetic clouds, of two worlds or more.
        own: Labelled cells of one's own ground.
        config: Parameters.
        seed: Seed of the draws.
        summary: Account of the adaptation, kept with the forest beside that of its training.

    Raises:
        ValueError: If the forest is not boosted, or there are too few worlds.
    """
    if forest.trees.vote != "logistic":
        raise ValueError(
            "forest: expected boosted trees, which corrections are added to, got a random forest; "
            "train one with --recipe best"
        )
    rng = np.random.default_rng(seed)
    worlds = rng.permutation(np.unique(synthetic.world))
    if len(worlds) < 2:
        raise ValueError(f"clouds: expected two worlds or more, got {len(worlds)}; add clouds")
    number = min(max(1, round(config.held_out * len(worlds))), len(worlds) - 1)
    is_held = np.isin(synthetic.world, worlds[:number])
    held = synthetic.select(is_held)
    trees = _correction(forest, synthetic.select(~is_held), own, config, rng, seed)
    joined = trees.before(forest.trees)
    adapted = replace(forest, trees=joined, exits=())
    adapted = replace(adapted, thresholds=_same_recall(forest, adapted, held))
    limits = adapted.thresholds
    stages = tuple(config.trees + exit_.trees for exit_ in forest.exits)
    exits = early_exits(
        adapted, join_samples([held, own]), (limits.near, limits.far), ForestConfig(exits=stages)
    )
    return replace(adapted, exits=exits, summary={**forest.summary, "adaptation": summary or {}})


def _correction(
    forest: Forest,
    synthetic: CellSamples,
    own: CellSamples,
    config: AdaptationConfig,
    rng: np.random.Generator,
    seed: int,
) -> Trees:
    """Return trees that correct the forest on cells that pass its screen."""
    if forest.screen is not None:
        synthetic, own = (
            part.select(leaf_sums(forest.screen.trees, part.features) >= forest.screen.limit)
            for part in (synthetic, own)
        )
    if len(synthetic.blocked) > config.cells:
        drawn = np.zeros(len(synthetic.blocked), dtype=np.bool_)
        drawn[rng.permutation(len(drawn))[: config.cells]] = True
        synthetic = synthetic.select(drawn)
    n, n_own = len(synthetic.blocked), max(len(own.blocked), 1)
    each = config.own_share / (1 - config.own_share) * n / n_own
    weights = np.concatenate([np.ones(n), np.full(len(own.blocked), each)])
    both = join_samples([synthetic, own])
    columns = [ALL_FEATURES.index(name) for name in forest.trees.features]
    return fit_correction(
        both.features[:, columns],
        both.blocked,
        leaf_sums(forest.trees, both.features),
        weights,
        forest.trees.features,
        config.trees,
        config.feature_share,
        config,
        seed,
    )


def _same_recall(forest: Forest, adapted: Forest, held: CellSamples) -> Thresholds:
    """Return the highest thresholds at which an adapted forest has the recall of the first one."""
    limits = forest.thresholds
    begins = forest.grid.ring_edges[:-1][held.ring]
    before, after = (each.predict_proba(held.features) for each in (forest, adapted))
    chosen = {}
    for zone, inside in (
        ("near", begins < limits.near_range),
        ("far", begins >= limits.near_range),
    ):
        old = getattr(limits, zone)
        blocked = inside & held.blocked
        hits = int((before[blocked] >= old).sum())
        good = [limit for limit in _THRESHOLDS if (after[blocked] >= limit).sum() >= hits]
        chosen[zone] = float(max(good, default=_THRESHOLDS[0])) if blocked.any() else old
    return limits.model_copy(update=chosen)


def sample_scores(forest: Forest, samples: CellSamples) -> CellScores:
    """Return the confusion matrix of a forest on labelled cells.

    Args:
        forest: Forest to score.
        samples: Labelled cells.
    """
    called = (
        forest.predict_proba(samples.features)
        >= (forest.thresholds.of_rings(forest.grid)[samples.ring])
    )
    return CellScores.of(_states(samples.blocked), _states(called))


def _states(blocked: NDArray[np.bool_]) -> NDArray[np.uint8]:
    """Return the ``CellState`` of cells that are blocked or free."""
    states = np.where(blocked, CellState.NON_TRAVERSABLE, CellState.TRAVERSABLE)
    return states.astype(np.uint8)
