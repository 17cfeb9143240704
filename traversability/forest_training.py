"""Growing the trees of the cell classifier, and choosing its thresholds."""

from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from traversability.dataset import CellSamples
from traversability.features import ALL_FEATURES, OWN_FEATURES, PAPER_FEATURES
from traversability.forest import Exit, Forest, Screen, Thresholds, leaf_sums
from traversability.grid import PolarGrid
from traversability.tree_fitting import fit_boosted, flatten_random
from traversability.trees import Trees

_SCREEN_RATE = 0.5
"""Learning rate of a screen, whose few trees have to get far."""

FeatureSet = Literal["paper", "own", "all"]

_SETS: dict[FeatureSet, tuple[str, ...]] = {
    "paper": PAPER_FEATURES,
    "own": OWN_FEATURES,
    "all": ALL_FEATURES,
}


class ForestConfig(BaseModel):
    """How trees are grown.

    Attributes:
        kind: ``boosted`` trees, each of which mends the sum of those before it, or a ``random``
            forest.
        features: The ``paper``'s five, a cell's ``own``, or ``all``, the neighbours' with them.
        without: Names of features to leave out, for ablations.
        trees: Number of trees.
        max_depth: Deepest split.
        min_leaf: Fewest cells of a leaf.
        rate: Learning rate of boosted trees.
        shrink: L2 penalty of boosted leaves.
        near_miss: What a red cell called green costs within ``near_range``, in false alarms.
        far_miss: What it costs beyond.
        near_range: See ``near_miss`` [m].
        screen_trees: Number of boosted trees on a cell's own features that look first; 0 for none.
        screen_loss: Share of the red cells that they may take for green.
        exits: After how many trees clear cells leave.
        exit_loss: Share of the cells called red, and of those called green, that each exit may
            change over.
        held_out: Share of the worlds on which the thresholds are chosen, before the trees are grown
            afresh on all of them.
        thresholds: Instead of choosing.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    kind: Literal["boosted", "random"] = "boosted"
    features: FeatureSet = "all"
    without: tuple[str, ...] = ()
    trees: int = Field(default=300, ge=1, le=2000)
    max_depth: int = Field(default=6, ge=1, le=64)
    min_leaf: int = Field(default=200, ge=1)
    rate: float = Field(default=0.12, gt=0, le=1)
    shrink: float = Field(default=5.0, ge=0)
    near_miss: float = Field(default=4.0, gt=0)
    far_miss: float = Field(default=3.0, gt=0)
    near_range: float = Field(default=5.0, ge=0)
    screen_trees: int = Field(default=12, ge=0, le=1000)
    screen_loss: float = Field(default=0.002, ge=0, lt=1)
    exits: tuple[int, ...] = (30, 60, 120)
    exit_loss: float = Field(default=0.0001, ge=0, lt=0.5)
    held_out: float = Field(default=0.2, gt=0, lt=1)
    thresholds: Thresholds | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """The features that trees may split by."""
        return tuple(name for name in _SETS[self.features] if name not in self.without)


PAPER_RECIPE = ForestConfig(
    kind="random",
    features="paper",
    trees=100,
    max_depth=12,
    min_leaf=3,
    screen_trees=0,
    exits=(),
    near_miss=2.0,
    far_miss=2.0,
    near_range=0.0,
)
"""The paper's protocol: a random forest on five features (its size is an assumption)."""

PAPER_GRID = PolarGrid(cut="base")
"""The paper's grid: points higher than 1.2 m above the robot's base plane are not projected."""


def train_forest(
    samples: CellSamples,
    grid: PolarGrid,
    config: ForestConfig,
    seed: int,
    summary: dict[str, Any] | None = None,
) -> Forest:
    """Choose thresholds and screen on held-out worlds, then grow trees on all of them.

    A threshold is the one that costs least on the held-out worlds, a miss counting ``near_miss`` or
    ``far_miss`` false alarms. With a single world there is nothing to hold out: no screen then, and
    the thresholds of perfect calibration, ``1 / (1 + cost)``.

    Args:
        samples: Labelled cells.
        grid: The cells' grid, kept with the forest.
        config: How.
        seed: Of bootstrap, splits and held-out worlds.
        summary: Kept with the forest, ready for JSON.

    Raises:
        ValueError: If the cells are not of both kinds.
    """
    worlds = np.unique(samples.world)
    shuffled = np.random.default_rng(seed).permutation(worlds)
    judges = np.isin(samples.world, shuffled[: max(1, round(config.held_out * len(worlds)))])
    thresholds = {"near": 1 / (1 + config.near_miss), "far": 1 / (1 + config.far_miss)}
    limit: float | None = None
    exits: tuple[Exit, ...] = ()
    if (
        len(worlds) > 1
        and _both_kinds(samples.blocked[~judges])
        and _both_kinds(samples.blocked[judges])
    ):
        first, held = samples.select(~judges), samples.select(judges)
        limit = _screen_limit(first, held, config, seed)
        trial = _planted(first, grid, config, seed, limit)
        thresholds |= _cheapest_thresholds(trial, held, config)
        if config.kind == "boosted":
            exits = _exits(trial, held, tuple(thresholds.values()), config)
    forest = _planted(samples, grid, config, seed, limit)
    chosen = config.thresholds or Thresholds(**thresholds, near_range=config.near_range)
    return replace(forest, thresholds=chosen, exits=exits, summary=summary or {})


def _both_kinds(red: NDArray[np.bool_]) -> bool:
    """Return whether there are red and green cells."""
    return bool(red.any() and not red.all())


def _planted(
    samples: CellSamples, grid: PolarGrid, config: ForestConfig, seed: int, limit: float | None
) -> Forest:
    """Return a forest grown on all samples; behind a screen it learns what the screen lets pass."""
    if not _both_kinds(samples.blocked):
        red, all_ = int(samples.blocked.sum()), len(samples.blocked)
        raise ValueError(f"red: expected cells of both kinds, got {red} red of {all_}; add clouds")
    screen = None
    if limit is not None:
        screen = Screen(_grow_screen(samples, config, seed), limit)
        samples = samples.select(leaf_sums(screen.trees, samples.features) >= limit)
    trees = _grow(samples, config, config.names, config.trees, seed)
    return Forest(trees, Thresholds(), grid, screen)


def _grow_screen(samples: CellSamples, config: ForestConfig, seed: int) -> Trees:
    """Return the trees of a screen, on a cell's own features."""
    names = tuple(name for name in config.names if name in OWN_FEATURES)
    eager = config.model_copy(update={"rate": max(config.rate, _SCREEN_RATE)})
    return _grow(samples, eager, names, config.screen_trees, seed)


def _screen_limit(
    samples: CellSamples, held: CellSamples, config: ForestConfig, seed: int
) -> float | None:
    """Return the sum below which the screen loses no more than its share of held-out red cells."""
    if config.screen_trees == 0:
        return None
    screen = _grow_screen(samples, config, seed)
    sums = leaf_sums(screen, held.features[held.blocked])
    return float(np.quantile(sums, config.screen_loss))


def _grow(
    samples: CellSamples, config: ForestConfig, names: tuple[str, ...], trees: int, seed: int
) -> Trees:
    """Return trees grown on some features of all samples."""
    columns = [ALL_FEATURES.index(name) for name in names]
    features, red = samples.features[:, columns], samples.blocked
    if config.kind == "random":
        from sklearn.ensemble import RandomForestClassifier

        model: Any = RandomForestClassifier(
            n_estimators=trees,
            max_depth=config.max_depth,
            min_samples_leaf=config.min_leaf,
            random_state=seed,
            n_jobs=1,
        )
        return flatten_random(model.fit(features, red), names)
    return fit_boosted(features, red, names, trees, config, seed)


def _cheapest_thresholds(
    forest: Forest, held: CellSamples, config: ForestConfig
) -> dict[str, float]:
    """Return the thresholds near and far that cost least on held-out cells."""
    probability = forest.predict_proba(held.features)
    near = forest.grid.ring_edges[:-1][held.ring] < config.near_range
    return {
        zone: cheapest_threshold(held.blocked[inside], probability[inside], cost)
        for zone, inside, cost in (
            ("near", near, config.near_miss),
            ("far", ~near, config.far_miss),
        )
        if held.blocked[inside].any()
    }


def _exits(
    forest: Forest, held: CellSamples, thresholds: tuple[float, ...], config: ForestConfig
) -> tuple[Exit, ...]:
    """Return exits that change few held-out cells over, whichever of the thresholds counts."""
    features = held.features
    if forest.screen is not None:
        features = features[leaf_sums(forest.screen.trees, features) >= forest.screen.limit]
    trees, limits = forest.trees, forest.trees.sum_at(np.array(thresholds))
    final = leaf_sums(trees, features)
    # At the lower limit a cell called red must not leave as green, at the higher one the reverse.
    red, green = final >= limits.min(), final < limits.max()
    found = []
    for after in config.exits:
        if after >= len(trees.roots) or not (red.any() and green.any()):
            break
        part = leaf_sums(trees.between(0, after), features)
        low = min(float(np.quantile(part[red], config.exit_loss)), limits.min())
        high = max(float(np.quantile(part[green], 1 - config.exit_loss)), limits.max())
        found.append(Exit(after, low, high))
    return tuple(found)


def importances(forest: Forest, samples: CellSamples, seed: int) -> dict[str, float]:
    """Return what each feature is worth: how much cross-entropy is lost when it is shuffled.

    Args:
        forest: Whose features.
        samples: Cells to look at; a sample of 20,000 is taken.
        seed: Of sample and shuffles.

    Returns:
        Loss in nats a cell by name, the dearest first.
    """
    rng = np.random.default_rng(seed)
    rows = rng.permutation(len(samples.blocked))[:20_000]
    features, red = samples.features[rows], samples.blocked[rows]

    def loss(values: NDArray[np.float32]) -> float:
        p = np.clip(forest.predict_proba(values), 1e-6, 1 - 1e-6)
        return float(-np.where(red, np.log(p), np.log(1 - p)).mean())

    whole = loss(features)
    worth = {}
    for name in forest.trees.features:
        shuffled = features.copy()
        column = ALL_FEATURES.index(name)
        shuffled[:, column] = rng.permutation(shuffled[:, column])
        worth[name] = loss(shuffled) - whole
    return dict(sorted(worth.items(), key=lambda item: -item[1]))


def cheapest_threshold(
    red: NDArray[np.bool_], probability: NDArray[np.float64], miss: float
) -> float:
    """Return the threshold that costs least, a miss counting ``miss`` false alarms.

    Args:
        red: Whether each cell is red, shape (n,).
        probability: That it is, shape (n,).
        miss: Cost of a red cell called green.

    Returns:
        In steps of 0.01, from 0.02 to 0.8.
    """
    thresholds = np.round(np.arange(0.02, 0.805, 0.01), 2)
    missed = np.searchsorted(np.sort(probability[red]), thresholds)
    alarms = (~red).sum() - np.searchsorted(np.sort(probability[~red]), thresholds)
    return float(thresholds[np.argmin(miss * missed + alarms)])
