"""Measures what each group of features contributes: forests without it, on the same clouds.

``python -m andabata.bench.studies.ablation CLOUDS`` trains on the training split of a data set,
evaluates on a validation split and prints a Markdown table.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track

from andabata.bench.table import Row, markdown_table
from traversability.dataset import CellSamples, read_manifest, split_samples
from traversability.features import ALL_FEATURES, CONTEXT
from traversability.forest_training import PAPER_RECIPE, ForestConfig, train_forest
from traversability.grid import PolarGrid

GRID = PolarGrid()
"""Grid of the cells."""

PLANES = (
    *("slope_max", "slope_mean", "step_max", "step_second", "step_mean"),
    *("above_plane", "below_plane", "lowest_around", "highest_around"),
)
"""Features of planes through quarters of a cell."""

GAPS = ("gap_after", "gap_after_mean", "gap_before", "spacing", "seen_beyond")
"""Features of gaps between the laser's rings."""

RISES = ("bend", "rise_before", "rise_after")
"""Features of the profile along a sector."""


def features_at(positions: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names of the features of neighbours at some positions of ``CONTEXT``."""
    return tuple(name for name in ALL_FEATURES if name.split(":")[0] in positions)


VARIANTS = {
    "all": ForestConfig(),
    "without the screen": ForestConfig(screen_trees=0),
    "without neighbours": ForestConfig(features="own"),
    "without neighbours aside": ForestConfig(
        excluded_features=features_at(
            tuple(position for position in CONTEXT if "sides" in position)
        )
    ),
    "without planes through quarters": ForestConfig(
        excluded_features=(*PLANES, *(n for n in ALL_FEATURES if n.split(":")[-1] in PLANES))
    ),
    "without gaps": ForestConfig(excluded_features=GAPS),
    "without rises and bends": ForestConfig(excluded_features=RISES),
    "without distance": ForestConfig(excluded_features=("distance",)),
    "the paper's five, boosted": ForestConfig(features="paper"),
    "the paper's five, random forest": PAPER_RECIPE,
}
"""Configuration of each forest by name."""


def best_scores(config: ForestConfig, train: CellSamples, test: CellSamples) -> Row:
    """Return the scores of a forest at the threshold with its best F1.

    Each forest has the threshold that suits it best, so that forests with different calibrations
    can be compared.

    Args:
        config: Configuration of the forest.
        train: Cells to train on.
        test: Cells to evaluate on.
    """
    forest = train_forest(train, GRID, config, seed=0)
    probability = forest.predict_proba(test.features)
    near = GRID.ring_edges[:-1][test.ring] < 5.0
    best: Row = {"balanced accuracy": None, "F1": 0.0, "recall within 5 m": None}
    for threshold in np.arange(0.05, 0.7, 0.02):
        called = probability >= threshold
        hits = (called & test.blocked).sum()
        f1 = 2 * hits / (called.sum() + test.blocked.sum())
        if f1 > best["F1"]:
            specificity = (~called & ~test.blocked).sum() / (~test.blocked).sum()
            best = {
                "balanced accuracy": float((hits / test.blocked.sum() + specificity) / 2),
                "F1": float(f1),
                "recall within 5 m": float(
                    (called & test.blocked & near).sum() / (test.blocked & near).sum()
                ),
            }
    return best


def main(argv: Sequence[str] | None = None) -> None:
    """Train, evaluate and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("clouds", type=Path, help="Data set to train on.")
    parser.add_argument("--test-clouds", type=Path, help="Data set to evaluate on; default: CLOUDS")
    options = parser.parse_args(argv)
    train_folder, test_folder = options.clouds, options.test_clouds or options.clouds
    train = split_samples(train_folder, read_manifest(train_folder), "train", GRID)
    test = split_samples(test_folder, read_manifest(test_folder), "validation", GRID)
    sys.stdout.write(f"{len(train.blocked)} training cells, {len(test.blocked)} test cells\n\n")
    rows = [
        {"forest": name} | best_scores(config, train, test)
        for name, config in track(VARIANTS.items(), "forests", console=Console(stderr=True))
    ]
    sys.stdout.write(markdown_table(rows))


if __name__ == "__main__":
    main()
