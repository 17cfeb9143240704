"""Training of the cell classifier: its trees, its screen, its exits and its thresholds."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from traversability.dataset import CellSamples
from traversability.features import ALL_FEATURES, OWN_FEATURES, PAPER_FEATURES
from traversability.forest import Exit, Forest, Screen, Thresholds, leaf_sums
from traversability.grid import PolarGrid
from traversability.trees.fitting import fit_boosted, flatten_random
from traversability.trees.flat import Trees

_SCREEN_RATE = 0.5
"""Smallest learning rate of a screen, whose trees are few."""

FeatureSet = Literal["paper", "own", "all"]
"""Name of a set of features that trees may split by."""

_SETS: dict[FeatureSet, tuple[str, ...]] = {
    "paper": PAPER_FEATURES,
    "own": OWN_FEATURES,
    "all": ALL_FEATURES,
}


class ForestConfig(BaseModel):
    """Parameters of training; see ``train_forest``.

    Attributes:
        kind: Kind of trees: ``boosted``, each of which corrects the sum of those before it, or a
            ``random`` forest.
        features: Set of features: the ``paper``'s five, a cell's ``own``, or ``all``, the
            neighbours' with them.
        excluded_features: Names of features to leave out, for ablations.
        trees: Number of trees.
        max_depth: Largest number of splits from the root of a tree to a leaf.
        min_leaf: Smallest number of cells in a leaf.
        learning_rate: Learning rate of boosted trees.
        l2_regularization: L2 penalty of boosted leaves.
        near_miss_cost: Cost of a blocked cell classified as free within ``near_range`` [false
            alarms].
        far_miss_cost: Cost of the same beyond ``near_range`` [false alarms].
        near_range: Distance up to which ``near_miss_cost`` holds [m].
        screen_trees: Number of boosted trees of the screen, on a cell's own features; 0 for none.
        screen_loss: Share of the blocked cells that the screen may take for free.
        exits: Numbers of trees after which clear cells leave.
        exit_loss: Share of the cells classified as blocked, and of those classified as free, that
            each exit may change.
        held_out: Share of the worlds on which the thresholds are chosen, before the trees are
            fitted again to all of them.
        thresholds: Thresholds to use; None to choose them.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["boosted", "random"] = "boosted"
    features: FeatureSet = "all"
    excluded_features: tuple[str, ...] = ()
    trees: int = Field(default=300, ge=1, le=2000)
    max_depth: int = Field(default=6, ge=1, le=64)
    min_leaf: int = Field(default=200, ge=1)
    learning_rate: float = Field(default=0.12, gt=0, le=1)
    l2_regularization: float = Field(default=5.0, ge=0)
    near_miss_cost: float = Field(default=4.0, gt=0)
    far_miss_cost: float = Field(default=3.0, gt=0)
    near_range: float = Field(default=5.0, ge=0)
    screen_trees: int = Field(default=12, ge=0, le=1000)
    screen_loss: float = Field(default=0.002, ge=0, lt=1)
    exits: tuple[int, ...] = (30, 60, 120)
    exit_loss: float = Field(default=0.0001, ge=0, lt=0.5)
    held_out: float = Field(default=0.2, gt=0, lt=1)
    thresholds: Thresholds | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the features that trees may split by."""
        return tuple(name for name in _SETS[self.features] if name not in self.excluded_features)


PAPER_RECIPE = ForestConfig(
    kind="random",
    features="paper",
    trees=100,
    max_depth=12,
    min_leaf=3,
    screen_trees=0,
    exits=(),
    near_miss_cost=2.0,
    far_miss_cost=2.0,
    near_range=0.0,
)
"""Parameters of the paper's protocol: a random forest on five features; its size is an
assumption."""

PAPER_GRID = PolarGrid(cut="base")
"""Grid of the paper: points higher than 1.2 m above the robot's base plane are not projected."""


def train_forest(
    samples: CellSamples,
    grid: PolarGrid,
    config: ForestConfig,
    seed: int,
    summary: dict[str, Any] | None = None,
) -> Forest:
    """Choose thresholds, screen and exits on held-out worlds, then fit the trees to all worlds.

    A threshold is the one that costs least on the held-out worlds, a miss counting
    ``near_miss_cost`` or ``far_miss_cost`` false alarms. With a single world there is nothing to
    hold out: no screen then, and the thresholds of perfect calibration, ``1 / (1 + cost)``.

    Args:
        samples: Labelled cells.
        grid: Polar grid of the cells, kept with the forest.
        config: Parameters of training.
        seed: Seed of bootstrap, splits and choice of held-out worlds.
        summary: Account of the training, kept with the forest, ready for JSON.

    Raises:
        ValueError: If the cells are not of both kinds.
    """
    worlds = np.unique(samples.world)
    shuffled = np.random.default_rng(seed).permutation(worlds)
    is_held = np.isin(samples.world, shuffled[: max(1, round(config.held_out * len(worlds)))])
    thresholds = {"near": 1 / (1 + config.near_miss_cost), "far": 1 / (1 + config.far_miss_cost)}
    limit: float | None = None
    exits: tuple[Exit, ...] = ()
    first, held = samples.select(~is_held), samples.select(is_held)
    if len(worlds) > 1 and _both_kinds(first.blocked) and _both_kinds(held.blocked):
        limit = _screen_limit(first, held, config, seed)
        trial = _fit_forest(first, grid, config, seed, limit)
        thresholds |= _cheapest_thresholds(trial, held, config)
        if config.kind == "boosted":
            exits = early_exits(trial, held, tuple(thresholds.values()), config)
    forest = _fit_forest(samples, grid, config, seed, limit)
    chosen = config.thresholds or Thresholds(**thresholds, near_range=config.near_range)
    return replace(forest, thresholds=chosen, exits=exits, summary=summary or {})


def _both_kinds(blocked: NDArray[np.bool_]) -> bool:
    """Return True if there are blocked and free cells."""
    return bool(blocked.any() and not blocked.all())


def _fit_forest(
    samples: CellSamples, grid: PolarGrid, config: ForestConfig, seed: int, limit: float | None
) -> Forest:
    """Return a forest fitted to all samples; with a screen, to those that pass it.

    Args:
        samples: Labelled cells.
        grid: Polar grid of the cells.
        config: Parameters of training.
        seed: Seed of bootstrap and splits.
        limit: Limit of the screen; None for no screen.
    """
    if not _both_kinds(samples.blocked):
        counts = f"{int(samples.blocked.sum())} blocked of {len(samples.blocked)}"
        raise ValueError(f"blocked: expected cells of both kinds, got {counts}; add clouds")
    screen = None
    if limit is not None:
        screen = Screen(_fit_screen(samples, config, seed), limit)
        samples = samples.select(leaf_sums(screen.trees, samples.features) >= limit)
    trees = _fit_trees(samples, config, config.names, config.trees, seed)
    return Forest(trees, Thresholds(), grid, screen)


def _fit_screen(samples: CellSamples, config: ForestConfig, seed: int) -> Trees:
    """Return the trees of a screen, on a cell's own features."""
    names = tuple(name for name in config.names if name in OWN_FEATURES)
    eager = config.model_copy(update={"learning_rate": max(config.learning_rate, _SCREEN_RATE)})
    return _fit_trees(samples, eager, names, config.screen_trees, seed)


def _screen_limit(
    samples: CellSamples, held: CellSamples, config: ForestConfig, seed: int
) -> float | None:
    """Return the sum below which the screen loses no more than its share of blocked cells.

    Args:
        samples: Cells to fit a trial screen to.
        held: Cells of held-out worlds, on which the limit is chosen.
        config: Parameters of training.
        seed: Seed of the splits.
    """
    if config.screen_trees == 0:
        return None
    screen = _fit_screen(samples, config, seed)
    sums = leaf_sums(screen, held.features[held.blocked])
    return float(np.quantile(sums, config.screen_loss))


def _fit_trees(
    samples: CellSamples, config: ForestConfig, names: tuple[str, ...], trees: int, seed: int
) -> Trees:
    """Return trees fitted to some features of all samples.

    Args:
        samples: Labelled cells.
        config: Parameters of training.
        names: Names of the features.
        trees: Number of trees.
        seed: Seed of bootstrap and splits.
    """
    columns = [ALL_FEATURES.index(name) for name in names]
    features, blocked = samples.features[:, columns], samples.blocked
    if config.kind == "random":
        from sklearn.ensemble import RandomForestClassifier

        model: Any = RandomForestClassifier(
            n_estimators=trees,
            max_depth=config.max_depth,
            min_samples_leaf=config.min_leaf,
            random_state=seed,
            n_jobs=1,
        )
        return flatten_random(model.fit(features, blocked), names)
    return fit_boosted(features, blocked, names, trees, config, seed)


def _cheapest_thresholds(
    forest: Forest, held: CellSamples, config: ForestConfig
) -> dict[str, float]:
    """Return the near and far thresholds that cost least on held-out cells, by zone."""
    probability = forest.predict_proba(held.features)
    near = forest.grid.ring_edges[:-1][held.ring] < config.near_range
    return {
        zone: cheapest_threshold(held.blocked[inside], probability[inside], cost)
        for zone, inside, cost in (
            ("near", near, config.near_miss_cost),
            ("far", ~near, config.far_miss_cost),
        )
        if held.blocked[inside].any()
    }


def early_exits(
    forest: Forest, held: CellSamples, thresholds: tuple[float, ...], config: ForestConfig
) -> tuple[Exit, ...]:
    """Return exits that change few held-out cells, whichever of the thresholds applies.

    Args:
        forest: Forest fitted without the held-out worlds.
        held: Cells of held-out worlds.
        thresholds: Thresholds of the near and far rings.
        config: Parameters of training.
    """
    features = held.features
    if forest.screen is not None:
        features = features[leaf_sums(forest.screen.trees, features) >= forest.screen.limit]
    trees, limits = forest.trees, forest.trees.sum_at(np.array(thresholds))
    final = leaf_sums(trees, features)
    # Cells blocked at the lower limit must not leave as free; at the higher one the reverse.
    blocked, free = final >= limits.min(), final < limits.max()
    exits = []
    for after in config.exits:
        if after >= len(trees.roots) or not (blocked.any() and free.any()):
            break
        part = leaf_sums(trees.between(0, after), features)
        low = min(float(np.quantile(part[blocked], config.exit_loss)), limits.min())
        high = max(float(np.quantile(part[free], 1 - config.exit_loss)), limits.max())
        exits.append(Exit(after, low, high))
    return tuple(exits)


def importances(forest: Forest, samples: CellSamples, seed: int) -> dict[str, float]:
    """Return the permutation importance of each feature (Breiman 2001).

    Args:
        forest: Forest whose features are shuffled.
        samples: Labelled cells, of which up to 20,000 are drawn.
        seed: Seed of draw and shuffles.

    Returns:
        Increase of the cross-entropy when a feature is shuffled [nats per cell], by name, the
        largest first.
    """
    rng = np.random.default_rng(seed)
    rows = rng.permutation(len(samples.blocked))[:20_000]
    features, blocked = samples.features[rows], samples.blocked[rows]

    def loss(values: NDArray[np.float32]) -> float:
        """Return the mean cross-entropy of some features [nats]."""
        p = np.clip(forest.predict_proba(values), 1e-6, 1 - 1e-6)
        return float(-np.where(blocked, np.log(p), np.log(1 - p)).mean())

    whole = loss(features)
    increase = {}
    for name in forest.trees.features:
        shuffled = features.copy()
        column = ALL_FEATURES.index(name)
        shuffled[:, column] = rng.permutation(shuffled[:, column])
        increase[name] = loss(shuffled) - whole
    return dict(sorted(increase.items(), key=lambda item: -item[1]))


def cheapest_threshold(
    blocked: NDArray[np.bool_], probability: NDArray[np.float64], miss: float
) -> float:
    """Return the threshold that costs least, a miss counting ``miss`` false alarms.

    Args:
        blocked: True for blocked cells, shape (n,).
        probability: Probability of each cell to be blocked, shape (n,).
        miss: Cost of a blocked cell classified as free [false alarms].

    Returns:
        Threshold in steps of 0.01, from 0.02 to 0.8.
    """
    thresholds = np.round(np.arange(0.02, 0.805, 0.01), 2)
    missed = np.searchsorted(np.sort(probability[blocked]), thresholds)
    alarms = (~blocked).sum() - np.searchsorted(np.sort(probability[~blocked]), thresholds)
    return float(thresholds[np.argmin(miss * missed + alarms)])
