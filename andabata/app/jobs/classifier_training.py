"""Training of the classifiers on labelled clouds, with the files that it leaves in a folder."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from andabata.app.console import Console
from andabata.datasets.foreign_clouds import foreign_samples
from andabata.evaluation.classifier import score_forest, score_ground_classifier
from andabata.report.plots.axes import png
from andabata.report.plots.perception import confusions_figure, importance_figure
from andabata.runs import atomic_io
from andabata.runs.folder import describe, make_folder, write_json
from traversability.cartesian.classifier import (
    GroundClassifierConfig,
    ground_samples,
    train_ground_classifier,
)
from traversability.cloud import PointCloud
from traversability.dataset import (
    CellSamples,
    Manifest,
    every_second_world,
    join_samples,
    read_clouds,
    read_manifest,
    split_samples,
)
from traversability.forest_training import ForestConfig, importances, train_forest
from traversability.grid import PolarGrid


def train_cell_classifier(
    folders: Sequence[Path],
    out: Path,
    config: ForestConfig,
    grid: PolarGrid,
    seed: int,
    console: Console,
    added: Path | None = None,
) -> tuple[dict[str, Any], CellSamples]:
    """Train a forest on training clouds and evaluate it on the first folder's validation clouds.

    Args:
        folders: Folders of clouds.
        out: Folder for the forest, its scores and their pictures.
        config: Trees and thresholds.
        grid: Polar grid of the cells.
        seed: Seed of the forest.
        console: Console that shows the progress.
        added: Manifest of foreign labelled clouds that are learned from, too, or None.

    Returns:
        Scores, importances and thresholds, ready for JSON, and the training cells.
    """
    manifests = [read_manifest(folder) for folder in folders]
    # What counts as blocked depends on the plants that the robot of the clouds may cross, and so do
    # the features of heights.
    grid = _with_limit_of(manifests, grid)
    pairs = zip(folders, manifests, strict=True)
    with console.progress("clouds", sum(len(each.of("train")) for each in manifests)) as step:
        samples = join_samples([split_samples(*pair, "train", grid, step) for pair in pairs])
    origin = _origin(manifests)
    if added is not None:
        foreign = foreign_samples(added, grid)
        samples = join_samples([samples, foreign.cells])
        origin |= {"added_sha256": foreign.sha256, "added_cells": len(foreign.cells.blocked)}
        console.status(f"{added}: {len(foreign.cells.blocked)} cells of {foreign.clouds} clouds")
    console.status(f"training {config.trees} trees on {len(samples.blocked)} cells")
    summary = origin | {
        "clouds": int(samples.cloud.max()) + 1,
        "cells": len(samples.blocked),
        "seed": seed,
        "config": config.model_dump(),
    }
    forest = train_forest(samples, grid, config, seed, summary)
    make_folder(out)
    # Written before the evaluation: training took minutes.
    atomic_io.write(out / "forest.npz", forest.to_bytes())
    scores = score_forest(forest, folders[0], manifests[0], "validation")
    title = f"balanced accuracy {scores['balanced_accuracy']:.3f}"
    atomic_io.write(out / "confusion.png", png(confusions_figure({title: scores["confusion"]})))
    weights = importances(forest, samples, seed)
    atomic_io.write(out / "importances.png", png(importance_figure(weights)))
    data: dict[str, Any] = {
        **scores,
        "importances": weights,
        "thresholds": forest.thresholds.model_dump(),
        "training_cells": {
            "free": int((~samples.blocked).sum()),
            "blocked": int(samples.blocked.sum()),
            "empty": samples.n_empty,
        },
        "out": str(out),
    }
    write_scores(out, data, describe("classifier train", config.model_dump(), seed))
    return data, samples


def train_ground(
    folders: Sequence[Path], out: Path, config: GroundClassifierConfig, seed: int, console: Console
) -> dict[str, Any]:
    """Train the two stages of the ground classifier and return its scores, ready for JSON.

    The stages learn from different halves of the training worlds, so that the second stage sees
    the first one's errors as they are on new worlds.

    Args:
        folders: Folders of clouds; the first one's validation clouds give the scores.
        out: Folder for the classifier and its scores.
        config: Trees of the two stages.
        seed: Seed of the trees.
        console: Console that shows the progress.
    """
    manifests = [read_manifest(folder) for folder in folders]
    halves = [every_second_world(manifest, "train") for manifest in manifests]

    def training(half: int) -> Iterator[PointCloud]:
        parts = [pair[half] for pair in halves]
        total = sum(len(part.clouds) for part in parts)
        with console.progress(f"clouds of the {('first', 'second')[half]} stage", total) as step:
            for pair in zip(folders, parts, strict=True):
                yield from read_clouds(*pair, "train", step)
            console.status(f"training {config.trees} trees")

    summary = _origin(manifests) | {"seed": seed, "config": config.model_dump()}
    classifier = train_ground_classifier((training(0), training(1)), config, seed, summary)
    make_folder(out)
    atomic_io.write(out / "ground_classifier.npz", classifier.to_bytes())
    validation = read_clouds(folders[0], manifests[0], "validation")
    rng = np.random.default_rng([seed, 2])
    samples = ground_samples(validation, config.sample_share, rng, classifier.first)
    data = {**score_ground_classifier(classifier, samples), "out": str(out)}
    write_scores(out, data, describe("classifier ground", config.model_dump(), seed))
    return data


def _with_limit_of(manifests: Sequence[Manifest], grid: PolarGrid) -> PolarGrid:
    """Return a grid with the limit of plants that the robot of all clouds had.

    Raises:
        ValueError: If the clouds were labelled for robots with different limits.
    """
    name = "max_traversable_vegetation"
    # Clouds of versions before the limit have the default.
    default = getattr(PolarGrid(), name)
    limits = {float(each.config.get("robot", {}).get(name, default)) for each in manifests}
    if len(limits) > 1:
        raise ValueError(
            f"robot.{name}: expected one limit of plants in all clouds, got "
            f"{', '.join(f'{limit:g} m' for limit in sorted(limits))}; make them for one robot"
        )
    return grid.model_copy(update={name: limits.pop()})


def _origin(manifests: Sequence[Manifest]) -> dict[str, Any]:
    """Return the hashes and seeds of the data sets that a classifier learns from."""
    return {
        "clouds_sha256": [manifest.config_sha256 for manifest in manifests],
        "clouds_seeds": [manifest.seed for manifest in manifests],
    }


def write_scores(folder: Path, scores: Mapping[str, Any], about: Mapping[str, Any]) -> None:
    """Write the scores of a classifier and the settings that made them."""
    write_json(folder / "scores.json", scores)
    write_json(folder / "run.json", about)
