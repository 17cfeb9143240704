"""What each group of features buys: forests without it, on the same clouds.

Run with ``python tests/benchmarks/bench_ablation.py CLOUDS [TEST]``: grown on the training split of
CLOUDS, judged on the validation split of TEST (or of CLOUDS).
"""

import sys
from pathlib import Path

import numpy as np

from traversability.dataset import CellSamples, read_manifest, split_samples
from traversability.features import ALL_FEATURES, CONTEXT, OWN_FEATURES, PAPER_FEATURES
from traversability.forest_training import PAPER_RECIPE, ForestConfig, grow_forest
from traversability.grid import PolarGrid

GRID = PolarGrid()
PLANES = (
    *("slope_max", "slope_mean", "step_max", "step_second", "step_mean"),
    *("above_plane", "below_plane", "lowest_around", "highest_around"),
)
GAPS = ("gap_after", "gap_after_mean", "gap_before", "spacing", "seen_beyond")
RISES = ("bend", "rise_before", "rise_after")


def neighbours(places: tuple[str, ...]) -> tuple[str, ...]:
    """Return the features of neighbours at some places."""
    return tuple(name for name in ALL_FEATURES if name.split(":")[0] in places)


VARIANTS = {
    "all": ForestConfig(),
    "without the screen": ForestConfig(screen_trees=0),
    "without neighbours": ForestConfig(features="own"),
    "without neighbours aside": ForestConfig(
        without=neighbours(tuple(place for place in CONTEXT if "sides" in place))
    ),
    "without planes through quarters": ForestConfig(
        without=(*PLANES, *(n for n in ALL_FEATURES if n.split(":")[-1] in PLANES))
    ),
    "without gaps": ForestConfig(without=GAPS),
    "without rises and bends": ForestConfig(without=RISES),
    "without distance": ForestConfig(without=("distance",)),
    "the paper's five, boosted": ForestConfig(features="paper"),
    "the paper's five, random forest": PAPER_RECIPE,
}


def scores(config: ForestConfig, train: CellSamples, test: CellSamples) -> dict[str, float]:
    """Return the figures of a variant; the threshold with the best F1 makes them comparable."""
    forest = grow_forest(train, GRID, config, seed=0)
    probability = forest.predict_proba(test.features)
    best: dict[str, float] = {"f1_red": 0.0}
    near = GRID.ring_edges[:-1][test.ring] < 5.0
    for threshold in np.arange(0.05, 0.7, 0.02):
        called = probability >= threshold
        hits = (called & test.red).sum()
        f1 = 2 * hits / (called.sum() + test.red.sum())
        if f1 > best["f1_red"]:
            specificity = (~called & ~test.red).sum() / (~test.red).sum()
            best = {
                "balanced_accuracy": (hits / test.red.sum() + specificity) / 2,
                "f1_red": f1,
                "recall_5m": (called & test.red & near).sum() / (test.red & near).sum(),
            }
    return best


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    judge = Path(sys.argv[2]) if len(sys.argv) > 2 else folder
    train = split_samples(folder, read_manifest(folder), "train", GRID)
    test = split_samples(judge, read_manifest(judge), "validation", GRID)
    sys.stdout.write(f"{len(train.red)} training and {len(test.red)} judged cells\n")
    assert set(PAPER_FEATURES) < set(OWN_FEATURES)
    for name, config in VARIANTS.items():
        found = scores(config, train, test)
        row = "  ".join(f"{key} {value:.3f}" for key, value in found.items())
        sys.stdout.write(f"{name:34} {row}\n")
        sys.stdout.flush()
