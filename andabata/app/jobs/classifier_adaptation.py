"""Adaptation of the cell classifier to recordings: recordings and clouds in, a forest file out."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from andabata.app.console import Console
from andabata.datasets.drive_labeller import DriveSamples
from andabata.replay.labelled_drive import label_drive
from andabata.replay.options import ReplayOptions
from andabata.runs import atomic_io
from andabata.training.forest_adaptation import (
    Adaptation,
    DriveAdaptationConfig,
    adapt_to_drives,
)
from traversability.dataset import CellSamples, Split, join_samples, read_manifest, split_samples
from traversability.forest import Forest


def adapt_cell_classifier(
    bags: Sequence[Path],
    folders: Sequence[Path],
    forest: Forest,
    options: ReplayOptions,
    config: DriveAdaptationConfig,
    seed: int,
    console: Console,
) -> tuple[Adaptation, dict[str, Any]]:
    """Adapt a forest to recorded drives.

    Args:
        bags: Recordings.
        folders: Folders of synthetic clouds.
        forest: Forest to adapt.
        options: Choices for the replay of the recordings.
        config: Settings.
        seed: Seed of the draws.
        console: Console that shows the progress.

    Returns:
        The adaptation, and its scores and counts, ready for JSON.

    Raises:
        BagError: If a recording cannot be replayed.
        ValueError: If the drives label no cells, or the forest cannot be adapted.
    """
    drives = [_labelled(bag, forest, options, config, console) for bag in bags]
    synthetic, validation = (_cells(folders, split, forest, console) for split in _SPLITS)
    console.status(f"correcting the forest with {config.forest.trees} trees")
    # Goes into the file of the forest: whoever finds it can tell what it was adapted to.
    origin = {
        "recordings": [bag.name for bag in bags],
        "clouds_sha256": [read_manifest(folder).config_sha256 for folder in folders],
        "seed": seed,
        "config": config.model_dump(mode="json"),
    }
    adaptation = adapt_to_drives(forest, drives, synthetic, validation, config, seed, origin)
    data = adaptation.as_dict() | {
        "drive_cells": {
            "free": sum(int((~drive.cells.blocked).sum()) for drive in drives),
            "blocked": sum(int(drive.cells.blocked.sum()) for drive in drives),
            "unlabelled": sum(drive.cells.n_empty for drive in drives),
        },
        "troubles": {
            name: sum(drive.troubles[name] for drive in drives) for name in drives[0].troubles
        },
        "thresholds": adaptation.forest.thresholds.model_dump(),
    }
    return adaptation, data


def write_adapted(out: Path, adaptation: Adaptation, config: DriveAdaptationConfig) -> None:
    """Write the forest unless it loses recall.

    Raises:
        RecallLostError: If it does.
    """
    adaptation.check(config)
    atomic_io.write(out, adaptation.forest.to_bytes())


_SPLITS: tuple[Split, Split] = ("train", "validation")


def _labelled(
    bag: Path,
    forest: Forest,
    options: ReplayOptions,
    config: DriveAdaptationConfig,
    console: Console,
) -> DriveSamples:
    """Return the cells that a recording labels."""
    with console.progress(f"recorded seconds of {bag.name}", None) as step:
        samples, _ = label_drive(bag, options, forest.grid, config.labels, lambda: step(1))
    blocked = int(samples.cells.blocked.sum())
    console.status(
        f"{bag.name}: {len(samples.cells.blocked) - blocked} cells crossed, {blocked} blocked, "
        f"{samples.cells.n_empty} not labelled, in {samples.clouds} clouds"
    )
    return samples


def _cells(folders: Sequence[Path], split: Split, forest: Forest, console: Console) -> CellSamples:
    """Return the labelled cells of a split of all folders."""
    manifests = [read_manifest(folder) for folder in folders]
    pairs = zip(folders, manifests, strict=True)
    with console.progress(f"{split} clouds", sum(len(m.of(split)) for m in manifests)) as step:
        return join_samples([split_samples(*pair, split, forest.grid, step) for pair in pairs])
