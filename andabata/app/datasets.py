"""Making data sets of labelled clouds."""

import hashlib
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path

import numpy as np

from andabata.app.runs import make_folder
from andabata.app.workers import run_tasks
from andabata.records.storage import write_atomically
from andabata.tasks.clouds import CloudsConfig, labelled_cloud
from andabata.tasks.seeds import dataset_world
from traversability.cloud import PointCloud
from traversability.dataset import (
    MANIFEST,
    CloudEntry,
    Manifest,
    Split,
    cell_samples,
    config_hash,
    dataset_card,
    read_clouds,
)
from traversability.files import cloud_to_bytes
from traversability.grid import PolarGrid


def generate_dataset(
    folder: Path,
    config: CloudsConfig,
    counts: Mapping[Split, int],
    seed: int,
    workers: int,
    on_cloud: Callable[[], None],
) -> Manifest:
    """Write labelled clouds, then the manifest that makes them a data set.

    Args:
        folder: Where; made when it is not there.
        config: How clouds are made.
        counts: Clouds of each split; each cloud has a world of its own.
        seed: The data set's.
        workers: Processes.
        on_cloud: Called after each cloud.

    Raises:
        ValueError: If there are more clouds than one seed has worlds.
    """
    total = sum(counts.values())
    make_folder(folder)
    (folder / MANIFEST).unlink(missing_ok=True)  # Half a set is no set.
    splits: list[Split] = [split for split, count in counts.items() for _ in range(count)]
    entries = []
    work = partial(make_cloud, config, seed)
    for number, (data, points) in run_tasks(work, range(total), workers):
        name = f"cloud_{number:05d}.npz"
        write_atomically(folder / name, data)
        preset, world_seed = world_of(config, seed, number)
        entries.append(
            CloudEntry(
                file=name,
                sha256=hashlib.sha256(data).hexdigest(),
                split=splits[number],
                world=preset,
                world_seed=world_seed,
                points=points,
            )
        )
        on_cloud()
    resolved = config.model_dump(mode="json")
    manifest = Manifest(
        seed=seed, config=resolved, config_sha256=config_hash(resolved), clouds=tuple(entries)
    )
    cells = {
        split: cell_samples(list(read_clouds(folder, manifest, split)), PolarGrid())
        for split, count in counts.items()
        if count
    }
    write_atomically(folder / "README.md", dataset_card(manifest, cells).encode())
    write_atomically(folder / MANIFEST, manifest.to_bytes())
    return manifest


def world_of(config: CloudsConfig, seed: int, number: int) -> tuple[str, int]:
    """Return preset and world seed of a data set's cloud."""
    return config.presets[number % len(config.presets)], dataset_world(seed, number)


def make_cloud(config: CloudsConfig, seed: int, number: int) -> tuple[bytes, int]:
    """Return the file of a data set's cloud, and its number of points."""
    from andabata.tasks.scenes import SceneShelf

    preset, world_seed = world_of(config, seed, number)
    scene = SceneShelf(1).get(preset, world_seed)
    cloud: PointCloud = labelled_cloud(scene, config, np.random.default_rng([seed, number]))
    return cloud_to_bytes(cloud), len(cloud)
