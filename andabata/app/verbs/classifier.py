"""``andabata classifier``: classifiers of polar cells and of ground cells."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any

import typer

from andabata.app.options import ConfigFile, ForestFile, Json, Quiet, Seed, Set

app = typer.Typer(help="The cell classifier: train, evaluate.", no_args_is_help=True)


class SplitName(StrEnum):
    """The two splits of a data set."""

    TRAIN = "train"
    VALIDATION = "validation"


class Recipe(StrEnum):
    """Ready-made ways to train."""

    BEST = "best"
    PAPER = "paper"


Clouds = Annotated[Path, typer.Option("--clouds", help="Folder of `clouds generate`.")]
More = Annotated[
    list[Path] | None,
    typer.Option("--and", help="Train on this folder's clouds, too; may be repeated."),
]


@app.command()
def train(
    clouds: Clouds,
    out: Annotated[Path, typer.Option(help="Folder for forest.npz and the scores.")],
    recipe: Annotated[
        Recipe,
        typer.Option(help="All features and boosted trees, or the paper's five and random forest."),
    ] = Recipe.BEST,
    more: More = None,
    seed: Seed = 0,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Grow a forest on the training clouds and judge it on the validation clouds."""
    from andabata.app.console import Console
    from andabata.app.plots.perception import confusion_picture, importance_picture
    from andabata.app.settings import resolve
    from andabata.evaluation.classifier import judge_forest, tables
    from andabata.records import atomic_io
    from andabata.records.runs import describe, make_folder, write_json
    from traversability.dataset import join_samples, read_manifest, split_samples
    from traversability.forest_training import (
        PAPER_GRID,
        PAPER_RECIPE,
        ForestConfig,
        importances,
        train_forest,
    )
    from traversability.grid import PolarGrid

    console = Console(quiet, as_json)
    base, grid = (PAPER_RECIPE, PAPER_GRID) if recipe is Recipe.PAPER else (None, PolarGrid())
    resolved = resolve(ForestConfig, config, settings or (), base)
    folders = (clouds, *(more or ()))
    manifests = [read_manifest(folder) for folder in folders]
    pairs = zip(folders, manifests, strict=True)
    with console.progress(
        "clouds", sum(len(manifest.of("train")) for manifest in manifests)
    ) as step:
        samples = join_samples([split_samples(*pair, "train", grid, step) for pair in pairs])
    console.status(f"growing {resolved.trees} trees on {len(samples.blocked)} cells")
    summary = {
        "clouds_sha256": [manifest.config_sha256 for manifest in manifests],
        "clouds_seeds": [manifest.seed for manifest in manifests],
        "clouds": int(samples.cloud.max()) + 1,
        "cells": len(samples.blocked),
        "seed": seed,
        "config": resolved.model_dump(),
    }
    forest = train_forest(samples, grid, resolved, seed, summary)
    make_folder(out)
    atomic_io.write(out / "forest.npz", forest.to_bytes())  # Before judging: it took minutes.
    scores = judge_forest(forest, clouds, manifests[0], "validation")
    atomic_io.write(out / "confusion.png", confusion_picture(scores))
    worth = importances(forest, samples, seed)
    atomic_io.write(out / "importances.png", importance_picture(worth))
    data: dict[str, Any] = {
        **scores,
        "importances": worth,
        "thresholds": forest.thresholds.model_dump(),
        "out": str(out),
    }
    write_json(out / "scores.json", data)
    write_json(out / "run.json", describe("classifier train", resolved.model_dump(), seed))
    console.result(data, tables(data, samples))


@app.command()
def evaluate(
    clouds: Clouds,
    forest: ForestFile = None,
    split: Annotated[SplitName, typer.Option(help="Clouds to judge on.")] = SplitName.VALIDATION,
    as_json: Json = False,
) -> None:
    """Judge a forest on the clouds of a folder."""
    from andabata.app.console import Console
    from andabata.evaluation.classifier import judge_forest, tables
    from andabata.models import shipped_forest
    from traversability.dataset import read_manifest
    from traversability.forest import Forest

    loaded = Forest.load(forest) if forest else shipped_forest()
    scores = judge_forest(loaded, clouds, read_manifest(clouds), split.value)
    data = {**scores, "thresholds": loaded.thresholds.model_dump(), "split": split.value}
    Console(as_json=as_json).result(data, tables(data))


@app.command()
def ground(
    clouds: Clouds,
    out: Annotated[Path, typer.Option(help="Folder for ground_classifier.npz and the scores.")],
    more: More = None,
    seed: Seed = 0,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Grow the trees that judge the squares of the local map, on the same clouds."""
    from collections.abc import Iterator

    import numpy as np

    from andabata.app.console import Console
    from andabata.app.settings import resolve
    from andabata.evaluation.classifier import judge_squares, squares_table
    from andabata.records import atomic_io
    from andabata.records.runs import describe, make_folder, write_json
    from traversability.cartesian.classifier import (
        GroundClassifierConfig,
        ground_samples,
        train_ground_classifier,
    )
    from traversability.cloud import PointCloud
    from traversability.dataset import every_second_world, read_clouds, read_manifest

    console = Console(quiet, as_json)
    resolved = resolve(GroundClassifierConfig, config, settings or ())
    folders = (clouds, *(more or ()))
    manifests = [read_manifest(folder) for folder in folders]
    halves = [every_second_world(manifest, "train") for manifest in manifests]

    def training(half: int) -> Iterator[PointCloud]:
        parts = [pair[half] for pair in halves]
        total = sum(len(part.clouds) for part in parts)
        with console.progress(f"clouds of the {('first', 'second')[half]} look", total) as step:
            for pair in zip(folders, parts, strict=True):
                yield from read_clouds(*pair, "train", step)
            console.status(f"growing {resolved.trees} trees")

    summary = {
        "clouds_sha256": [manifest.config_sha256 for manifest in manifests],
        "clouds_seeds": [manifest.seed for manifest in manifests],
        "seed": seed,
        "config": resolved.model_dump(),
    }
    forest = train_ground_classifier((training(0), training(1)), resolved, seed, summary)
    make_folder(out)
    atomic_io.write(out / "ground_classifier.npz", forest.to_bytes())
    judging = read_clouds(clouds, manifests[0], "validation")
    rng = np.random.default_rng([seed, 2])
    held = ground_samples(judging, resolved.share, rng, forest.first)
    data = {**judge_squares(forest, held), "out": str(out)}
    write_json(out / "scores.json", data)
    write_json(out / "run.json", describe("classifier ground", resolved.model_dump(), seed))
    console.result(data, squares_table(data))


@app.command()
def export(
    out: Annotated[Path, typer.Option(help="ONNX file to write.")],
    forest: ForestFile = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write a forest as ONNX: features of cells in, probability of red out."""
    from andabata.app.console import Console
    from andabata.models import shipped_forest
    from andabata.records import atomic_io
    from traversability.export import forest_to_onnx
    from traversability.forest import Forest

    data = forest_to_onnx(Forest.load(forest) if forest else shipped_forest())
    atomic_io.write(out, data)
    Console(quiet, as_json).result(
        {"out": str(out), "bytes": len(data)}, f"{out}: {len(data)} bytes"
    )
