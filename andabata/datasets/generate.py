"""Making data sets of labelled clouds."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from andabata.datasets.kitti import begin_sequence, end_sequence, write_scan
from andabata.datasets.labelled_cloud import CloudsConfig, cloud_scene, take_cloud
from andabata.engine import run_tasks
from andabata.machine.pose import Pose
from andabata.records import atomic_io
from andabata.records.runs import describe, make_folder, write_json
from traversability.dataset import (
    MANIFEST,
    CloudEntry,
    Manifest,
    Split,
    config_hash,
    dataset_card,
)
from traversability.files import cloud_to_bytes
from traversability.grid import PolarGrid
from traversability.height_rule import RULE_HEIGHT, RULE_QUANTILE, quantile_rule
from traversability.labels import label_cells, nontraversable
from traversability.scores import CellScores
from worlds.splits import dataset_world


def generate_dataset(
    folder: Path,
    config: CloudsConfig,
    counts: Mapping[Split, int],
    seed: int,
    workers: int,
    on_cloud: Callable[[], None],
    kitti: bool = False,
) -> Manifest:
    """Write labelled clouds, then the manifest that makes them a data set.

    Args:
        folder: Folder of the data set, made where it is missing.
        config: Settings of the clouds.
        counts: Number of clouds of each split; no world is in two splits.
        seed: Seed of the data set.
        workers: Number of processes.
        on_cloud: Function that is called after each cloud.
        kitti: True to write the clouds in the layout of SemanticKITTI, too; ``kitti/00`` is the
            training split, ``01`` the validation split.

    Raises:
        ValueError: If there are more clouds than one seed has worlds.
    """
    make_folder(folder)
    (folder / MANIFEST).unlink(missing_ok=True)  # Half a set must not pass for a whole one.
    batches = plan(config, counts)
    entries = []
    cells = {split: np.zeros(6, dtype=np.int64) for split, count in counts.items() if count}
    poses: dict[Split, dict[int, Pose]] = {"train": {}, "validation": {}}
    if kitti:
        for sequence in _SEQUENCES.values():
            begin_sequence(folder / "kitti" / sequence)
    work = partial(make_clouds, config, seed, folder, kitti)
    for batch, made in run_tasks(work, batches, workers):
        preset, world_seed = world_of(config, seed, batch.world)
        for number, one in zip(batch.clouds, made, strict=True):
            cells[batch.split] += one.cells
            poses[batch.split][number] = one.pose
            entries.append(
                CloudEntry(
                    file=file_name(number),
                    sha256=one.sha256,
                    split=batch.split,
                    world=preset,
                    world_seed=world_seed,
                    points=one.points,
                )
            )
            on_cloud()
    entries.sort(key=lambda entry: entry.file)
    if kitti:
        for split, sequence in _SEQUENCES.items():
            ordered = [poses[split][number] for number in sorted(poses[split])]
            end_sequence(folder / "kitti" / sequence, ordered, config.robot.lidar_height)
    resolved = config.model_dump(mode="json")
    manifest = Manifest(
        seed=seed, config=resolved, config_sha256=config_hash(resolved), clouds=tuple(entries)
    )
    counted = {
        split: dict(zip(CELL_COUNTS, row.tolist(), strict=True)) for split, row in cells.items()
    }
    about = describe("clouds generate", resolved, seed) | {"cells": counted}
    write_json(folder / "run.json", about)
    atomic_io.write(folder / "README.md", dataset_card(manifest, cells).encode())
    atomic_io.write(folder / MANIFEST, manifest.to_bytes())
    return manifest


_SEQUENCES: dict[Split, str] = {"train": "00", "validation": "01"}

CELL_COUNTS = ("empty", "free", "blocked", "rule_hits", "rule_false_alarms", "rule_misses")
"""Numbers of cells of a split: by state, and of the height rule on them."""


@dataclass(frozen=True)
class CloudBatch:
    """Clouds that are taken in one world, so that the world is made once.

    Attributes:
        world: Number of the world.
        split: Split of the clouds.
        clouds: Numbers of the clouds.
        first: Number of the split's first cloud.
    """

    world: int
    split: Split
    clouds: tuple[int, ...]
    first: int


def plan(config: CloudsConfig, counts: Mapping[Split, int]) -> list[CloudBatch]:
    """Return which clouds are taken in which world; a split's clouds are spread over its worlds.

    A split has at least one world of each preset, as far as its clouds go.
    """
    batches: list[CloudBatch] = []
    first = 0
    for split, count in counts.items():
        worlds = max(-(-count // config.clouds_per_world), min(count, len(config.presets)))
        batches += [
            CloudBatch(
                len(batches) + k, split, tuple(range(first + k, first + count, worlds)), first
            )
            for k in range(worlds)
        ]
        first += count
    return batches


def world_of(config: CloudsConfig, seed: int, number: int) -> tuple[str, int]:
    """Return preset and world seed of a data set's world."""
    return config.presets[number % len(config.presets)], dataset_world(seed, number)


def file_name(number: int) -> str:
    """Return the file of a data set's cloud."""
    return f"cloud_{number:05d}.npz"


@dataclass(frozen=True)
class Made:
    """Summary of a written cloud.

    Attributes:
        sha256: SHA-256 of its file.
        points: Number of points.
        pose: Estimated pose of the robot.
        cells: Numbers of unknown, free and blocked ones, and the hits, false alarms and misses of
            the one-line rule on them, shape (6,).
    """

    sha256: str
    points: int
    pose: Pose
    cells: NDArray[np.int64]


def make_clouds(
    config: CloudsConfig, seed: int, folder: Path, kitti: bool, batch: CloudBatch
) -> list[Made]:
    """Write the clouds of one world."""
    scene = cloud_scene(config, *world_of(config, seed, batch.world))
    grid = PolarGrid()
    rule = quantile_rule(RULE_HEIGHT, RULE_QUANTILE, grid)
    made = []
    for number in batch.clouds:
        cloud, pose = take_cloud(scene, config, np.random.default_rng([seed, number]))
        data = cloud_to_bytes(cloud)
        atomic_io.write(folder / file_name(number), data)
        if kitti:
            sequence = folder / "kitti" / _SEQUENCES[batch.split]
            write_scan(sequence, number - batch.first, cloud, config.robot.lidar_height)
        states = label_cells(cloud.points, nontraversable(cloud), grid)
        scores = CellScores.of(states, label_cells(cloud.points, rule(cloud.points), grid))
        colours = np.bincount(states.ravel(), minlength=3)
        cells = np.array([*colours, scores.tp, scores.fp, scores.fn])
        made.append(Made(hashlib.sha256(data).hexdigest(), len(cloud), pose, cells))
    return made
