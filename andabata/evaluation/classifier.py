"""Scores of a forest on labelled clouds, beside the paper's own figures."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from traversability.cartesian.classifier import GroundClassifier, GroundSamples
from traversability.cartesian.context import CONTEXT_FEATURES
from traversability.cartesian.features import MAX_RANGE, MIN_RANGE
from traversability.dataset import CellSamples, DatasetError, Manifest, Split, read_clouds
from traversability.forest import Forest
from traversability.labels import CellState, beyond_doubt, label_cells, nontraversable
from traversability.scanner import TraversabilityScanner
from traversability.scores import FIGURES, PAPER, CellScores, range_errors
from traversability.two_truths import truth_lines, truth_scores, two_truths
from worlds.truth import TruthConfig

NEAR_RANGE = 5.0
"""Cells of rings that begin nearer than this count as near, as they do for the thresholds [m]."""

RANGE_BANDS = (MIN_RANGE, 1.8, 3.2, 5.0, MAX_RANGE)
"""Edges of the ranges over which ground cells are scored apart [m]."""


def score_forest(forest: Forest, folder: Path, manifest: Manifest, split: Split) -> dict[str, Any]:
    """Return a forest's scores on a split by name, with the number of cells of each state.

    Beside the scores of all cells stand those of cells beyond doubt, of near cells and of each kind
    of world, those by the two truths of ``two_truths``, and the errors of the virtual ranges.

    Raises:
        DatasetError: If the split has no clouds.
    """
    scanner = TraversabilityScanner(forest)
    grid = scanner.grid
    truth, called, clear, worlds, truths = [], [], [], [], []
    max_step = TruthConfig().max_step
    entries = manifest.of(split)
    for entry, cloud in zip(entries, read_clouds(folder, manifest, split), strict=True):
        truth.append(label_cells(cloud.points, nontraversable(cloud), grid))
        clear.append(beyond_doubt(cloud, grid))
        known = np.ones(len(cloud), dtype=np.bool_)
        truths.append(two_truths(cloud.points, nontraversable(cloud), known, grid, max_step))
        called.append(scanner.cells(cloud.points))
        worlds.append(entry.world)
    if not truth:
        raise DatasetError(f"{folder}: expected clouds of the {split} split, got none")
    states, predicted, sure, kind = (np.stack(rows) for rows in (truth, called, clear, worlds))
    scores = CellScores.of(states, predicted).as_dict()
    near = np.where(grid.ring_edges[:-1] < NEAR_RANGE, states, CellState.EMPTY)
    scores["beyond_doubt"] = CellScores.of(
        np.where(sure, states, CellState.EMPTY), predicted
    ).as_dict()
    scores["within_5_m"] = CellScores.of(near.astype(np.uint8), predicted).as_dict()
    scores["worlds"] = {
        str(name): CellScores.of(states[kind == name], predicted[kind == name]).as_dict()
        for name in np.unique(kind)
    }
    first, second = (np.stack(rows) for rows in zip(*truths, strict=True))
    scores["truths"] = truth_scores(first, second, predicted)
    scores["ranges"] = range_errors(states, predicted, grid)
    colours = {
        "green": int((states == CellState.TRAVERSABLE).sum()),
        "red": int((states == CellState.NON_TRAVERSABLE).sum()),
        "white": int((states == CellState.EMPTY).sum()),
    }
    return scores | {"n_cells": colours, "clouds": len(truth)}


def score_ground_classifier(forest: GroundClassifier, samples: GroundSamples) -> dict[str, Any]:
    """Return the scores of a ground classifier, over all ground cells and by range.

    The samples are those of the second stage. A ground cell is called blocked from even odds on;
    the local map weighs misses itself. ``recall_low`` is the recall of blocked cells of low
    objects.
    """
    odds = forest.second.log_odds(samples.features)
    far = samples.features[:, CONTEXT_FEATURES.index("range")]

    def of(chosen: NDArray[np.bool_]) -> dict[str, Any]:
        states = np.where(samples.blocked, CellState.NON_TRAVERSABLE, CellState.TRAVERSABLE)[chosen]
        called = np.where(odds >= 0, CellState.NON_TRAVERSABLE, CellState.TRAVERSABLE)[chosen]
        return CellScores.of(states.astype(np.uint8), called.astype(np.uint8)).as_dict()

    bands = {
        f"{begin:g}_to_{end:g}_m": of((far >= begin) & (far < end))
        for begin, end in pairwise(RANGE_BANDS)
    }
    recall_low = float(np.mean(odds[samples.low] >= 0)) if samples.low.any() else None
    scores = {"bands": bands, "ground_cells": len(far), "recall_low": recall_low}
    return {**of(np.ones(len(far), dtype=np.bool_)), **scores}


def ground_classifier_table(data: dict[str, Any]) -> str:
    """Return a table of the scores of ground cells by range."""
    rows = {"all": data, **data["bands"]}
    columns = ("balanced_accuracy", "precision", "recall", "f1_red")
    low = "none" if data["recall_low"] is None else f"{data['recall_low']:.3f}"
    lines = [
        f"ground cells: {data['ground_cells']}; recall of blocked ones of low objects: {low}",
        "",
        " " * 14 + "".join(f"{c:>19}" for c in columns),
    ]
    lines += [
        f"{name.replace('_', ' '):14}" + "".join(f"{row[column]:19.3f}" for column in columns)
        for name, row in rows.items()
    ]
    return "\n".join(lines)


def tables(data: dict[str, Any], training: CellSamples | None = None) -> str:
    """Return the paper's two tables with the right names, ours beside the paper's."""
    lines = []
    if training is not None:
        free, blocked = int((~training.blocked).sum()), int(training.blocked.sum())
        lines.append(f"training cells: {free} free, {blocked} blocked, {training.n_empty} unknown")
    cells = data["n_cells"]
    lines += [
        f"scored cells: {cells['green']} free, {cells['red']} blocked, {cells['white']} unknown "
        f"in {data['clouds']} clouds",
        "",
        "Table 1, confusion matrix (blocked is positive)  ours    paper",
    ]
    paper = PAPER.as_dict()
    for name, about in (
        ("tp", "blocked called blocked"),
        ("tn", "free called free"),
        ("fp", "free called blocked"),
        ("fn", "blocked called free"),
    ):
        ours, theirs = data["confusion"][name], paper["confusion"][name]
        lines.append(f"  {name.upper()}  {about:36} {ours:10d} {theirs:8d}")
    lines += ["", "Table 2, scores                                  ours    paper"]
    lines += [f"  {name:40} {data[name]:10.3f} {paper[name]:8.3f}" for name in FIGURES]
    lines += [""]
    parts = {
        "all cells": data,
        "beyond doubt": data["beyond_doubt"],
        "within 5 m": data["within_5_m"],
    }
    lines += ["cells                balanced accuracy   F1 (blocked) recall"]
    lines += [
        f"  {name:18} {part['balanced_accuracy']:17.3f} {part['f1_red']:10.3f} "
        f"{part['recall']:10.3f}"
        for name, part in (parts | data["worlds"]).items()
    ]
    lines += ["", *truth_lines(data["truths"]), ""]
    long, short = (100 * data["ranges"][name] for name in ("too_long", "too_short"))
    lines += [f"sectors wrong by more than a ring: {long:.2f} % too long, {short:.2f} % too short"]
    limits = data["thresholds"]
    lines += [
        f"a cell is blocked from probability {limits['near']:.2f} on within "
        f"{limits['near_range']:.0f} m, {limits['far']:.2f} beyond"
    ]
    return "\n".join(lines)
