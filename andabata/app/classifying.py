"""Judging a forest on labelled clouds, beside the paper's own figures."""

from pathlib import Path
from typing import Any

import numpy as np

from traversability.dataset import CellSamples, DatasetError, Manifest, Split, read_clouds
from traversability.features import cell_features
from traversability.forest import Forest
from traversability.labels import CellState, label_cells
from traversability.scores import FIGURES, PAPER, CellScores


def judge_forest(forest: Forest, folder: Path, manifest: Manifest, split: Split) -> dict[str, Any]:
    """Return a forest's scores on a split by name, with the number of cells of each colour.

    Raises:
        DatasetError: If the split has no clouds.
    """
    truth, called = [], []
    for cloud in read_clouds(folder, manifest, split):
        if cloud.nontraversable is None:
            raise DatasetError(f"{folder}: expected labelled clouds, got one without labels")
        truth.append(label_cells(cloud.points, cloud.nontraversable, forest.grid))
        called.append(forest.classify(cell_features(cloud.points, forest.grid), forest.grid))
    if not truth:
        raise DatasetError(f"{folder}: expected clouds of the {split} split, got none")
    states = np.stack(truth)
    scores = CellScores.of(states, np.stack(called)).as_dict()
    colours = {
        "green": int((states == CellState.TRAVERSABLE).sum()),
        "red": int((states == CellState.NON_TRAVERSABLE).sum()),
        "white": int((states == CellState.EMPTY).sum()),
    }
    return scores | {"n_cells": colours, "clouds": len(truth)}


def tables(data: dict[str, Any], training: CellSamples | None = None) -> str:
    """Return the paper's two tables with the right names, ours beside the paper's."""
    lines = []
    if training is not None:
        green, red = int((~training.red).sum()), int(training.red.sum())
        lines.append(f"training cells: {green} green, {red} red, {training.white} white")
    cells = data["n_cells"]
    lines += [
        f"judged cells: {cells['green']} green, {cells['red']} red, {cells['white']} white "
        f"in {data['clouds']} clouds",
        "",
        "Table 1, confusion matrix (red is positive)      ours    paper",
    ]
    paper = PAPER.as_dict()
    for name, about in (
        ("tp", "red called red"),
        ("tn", "green called green"),
        ("fp", "green called red"),
        ("fn", "red called green"),
    ):
        ours, theirs = data["confusion"][name], paper["confusion"][name]
        lines.append(f"  {name.upper()}  {about:36} {ours:10d} {theirs:8d}")
    lines += ["", "Table 2, scores                                  ours    paper"]
    lines += [f"  {name:40} {data[name]:10.3f} {paper[name]:8.3f}" for name in FIGURES]
    lines += ["", f"a cell is red from probability {data['threshold']:.2f} on"]
    return "\n".join(lines)
