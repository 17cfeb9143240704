"""Making data sets of labelled clouds."""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from andabata.datasets.kitti import begin_sequence, end_sequence, scan_files
from andabata.datasets.labelled_cloud import CloudsConfig, cloud_scene, take_cloud
from andabata.engine import Engine, SerialEngine
from andabata.machine.pose import Pose
from andabata.runs import atomic_io
from andabata.runs.folder import commit, describe, make_folder, write_json
from andabata.runs.journal import Journal
from traversability.binning import fill_quarters
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
from traversability.height_rule import RULE_HEIGHT, RULE_QUANTILE, rule_obstacles
from traversability.labels import label_cells, nontraversable
from traversability.scores import CellScores
from worlds.splits import dataset_world

JOURNAL = "worlds.jsonl"
"""Journal of a set that is not finished: a line for each world whose clouds are on the disk."""

CELL_COUNTS = ("empty", "free", "blocked", "rule_hits", "rule_false_alarms", "rule_misses")
"""Numbers of cells of a split: by state, and of the height rule on them."""

_WRITERS = 8
"""Number of threads that write: a disk puts many files onto it in the time that one takes."""

_SEQUENCES: dict[Split, str] = {"train": "00", "validation": "01"}


def generate_dataset(
    folder: Path,
    config: CloudsConfig,
    counts: Mapping[Split, int],
    seed: int,
    on_clouds: Callable[[int], None],
    kitti: bool = False,
    engine: Engine | None = None,
) -> Manifest:
    """Write labelled clouds, then the manifest that makes them a data set.

    A worker makes the clouds of a world; they are written here and then noted in a journal, from
    which a run that was killed goes on. The manifest takes the journal's place.

    Args:
        folder: Folder of the data set, made where it is missing.
        config: Settings of the clouds.
        counts: Number of clouds of each split; no world is in two splits.
        seed: Seed of the data set.
        on_clouds: Function that is called with each number of clouds that came to the disk.
        kitti: True to write the clouds in the layout of SemanticKITTI, too; ``kitti/00`` is the
            training split, ``01`` the validation split.
        engine: Engine that makes the clouds, on which the result does not depend; None for this
            process.

    Raises:
        ValueError: If there are more clouds than one seed has worlds, or the folder holds a part
            of another set.
    """
    make_folder(folder)
    (folder / MANIFEST).unlink(missing_ok=True)  # Half a set must not pass for a whole one.
    if kitti:
        for sequence in _SEQUENCES.values():
            begin_sequence(folder / "kitti" / sequence)
    about = {"config": config.model_dump(mode="json"), "seed": seed, "counts": dict(counts)}
    journal = Journal(folder / JOURNAL, about | {"kitti": kitti, "commit": commit()})
    done = {entry["world"]: [Made(*one) for one in entry["made"]] for entry in journal.entries}
    for made in done.values():
        on_clouds(len(made))
    batches = plan(config, counts)
    missing = [batch for batch in batches if batch.world not in done]
    work = partial(make_clouds, config, seed, kitti)
    with ThreadPoolExecutor(_WRITERS) as writers:
        for _, batch, clouds in (engine or SerialEngine()).run(work, missing):
            files = {folder / name: data for cloud in clouds for name, data in cloud.files.items()}
            list(writers.map(atomic_io.write, files.keys(), files.values()))
            done[batch.world] = [cloud.made for cloud in clouds]
            journal.append({"world": batch.world, "made": done[batch.world]})
            on_clouds(len(clouds))
    if kitti:
        _write_poses(folder / "kitti", config, batches, done)
    manifest = _write_manifest(folder, config, seed, batches, done)
    (folder / JOURNAL).unlink()
    return manifest


def _write_poses(
    folder: Path,
    config: CloudsConfig,
    batches: Sequence["CloudBatch"],
    done: Mapping[int, Sequence["Made"]],
) -> None:
    """Write the poses of both sequences, in the order of their clouds."""
    for split, sequence in _SEQUENCES.items():
        made = {
            number: one
            for batch in batches
            if batch.split == split
            for number, one in zip(batch.clouds, done[batch.world], strict=True)
        }
        poses = [made[number].pose for number in sorted(made)]
        end_sequence(folder / sequence, poses, config.robot.lidar_height)


def _write_manifest(
    folder: Path,
    config: CloudsConfig,
    seed: int,
    batches: Sequence["CloudBatch"],
    done: Mapping[int, Sequence["Made"]],
) -> Manifest:
    """Write the run, the card and, last, the manifest, which is returned."""
    entries = []
    cells = {batch.split: np.zeros(len(CELL_COUNTS), dtype=np.int64) for batch in batches}
    for batch in batches:
        preset, world_seed = world_of(config, seed, batch.world)
        for number, one in zip(batch.clouds, done[batch.world], strict=True):
            cells[batch.split] += one.cells
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
    entries.sort(key=lambda entry: entry.file)
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


class Made(NamedTuple):
    """Summary of a cloud, ready for JSON.

    Attributes:
        sha256: SHA-256 of its file.
        points: Number of points.
        position: Estimated position of the robot in the map [m]: x, y, z.
        quaternion: Estimated rotation of the robot: x, y, z, w.
        cells: Numbers of cells, in the order of ``CELL_COUNTS``.
    """

    sha256: str
    points: int
    position: list[float]
    quaternion: list[float]
    cells: list[int]

    @property
    def pose(self) -> Pose:
        """Estimated pose of the robot."""
        return Pose(np.array(self.position), np.array(self.quaternion))


class MadeCloud(NamedTuple):
    """A cloud that is to be written.

    Attributes:
        files: Bytes of its files, by their paths in the folder of the data set.
        made: Summary of the cloud.
    """

    files: dict[str, bytes]
    made: Made


def make_clouds(config: CloudsConfig, seed: int, kitti: bool, batch: CloudBatch) -> list[MadeCloud]:
    """Return the clouds of one world."""
    scene = cloud_scene(config, *world_of(config, seed, batch.world))
    grid = PolarGrid()
    clouds = []
    for number in batch.clouds:
        cloud, pose = take_cloud(scene, config, np.random.default_rng([seed, number]))
        data = cloud_to_bytes(cloud)
        files = {file_name(number): data}
        if kitti:
            scan = scan_files(number - batch.first, cloud, config.robot.lidar_height)
            sequence = f"kitti/{_SEQUENCES[batch.split]}"
            files |= {f"{sequence}/{name}": content for name, content in scan.items()}
        bins = fill_quarters(cloud.points, grid).bins[: len(cloud)]
        states = label_cells(cloud.points, nontraversable(cloud), grid, bins=bins)
        called = rule_obstacles(cloud.points, bins, RULE_HEIGHT, RULE_QUANTILE, grid)
        scores = CellScores.of(states, label_cells(cloud.points, called, grid, bins=bins))
        colours = np.bincount(states.ravel(), minlength=3).tolist()
        cells = [*colours, scores.tp, scores.fp, scores.fn]
        digest = hashlib.sha256(data).hexdigest()
        place, turn = pose.position.tolist(), pose.quaternion.tolist()
        clouds.append(MadeCloud(files, Made(digest, len(cloud), place, turn, cells)))
    return clouds
