"""A data set is whole or refused: hashes, splits, labels."""

import hashlib

import numpy as np
import pytest

from traversability.cloud import PointCloud
from traversability.dataset import (
    CloudEntry,
    DatasetError,
    Manifest,
    cell_samples,
    config_hash,
    dataset_card,
    every_second_world,
    join_samples,
    read_clouds,
    read_manifest,
    split_samples,
)
from traversability.files import cloud_to_bytes
from traversability.grid import PolarGrid


def labelled(seed):
    """Return a labelled cloud of a flat field."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-8, 8, (6000, 3)).astype(np.float32)
    points[:, 2] = 0.05 * rng.normal(size=6000)
    return PointCloud(points, nontraversable=points[:, 0] > 3)


def write(folder, worlds):
    """Write clouds and their manifest, and return it."""
    entries = []
    for number, (split, world_seed) in enumerate(worlds):
        data = cloud_to_bytes(labelled(number))
        name = f"cloud_{number:05d}.npz"
        (folder / name).write_bytes(data)
        digest = hashlib.sha256(data).hexdigest()
        entries.append(
            CloudEntry(
                file=name,
                sha256=digest,
                split=split,
                world="natural",
                world_seed=world_seed,
                points=6000,
            )
        )
    manifest = Manifest(
        seed=1, config={"a": 1}, config_sha256=config_hash({"a": 1}), clouds=tuple(entries)
    )
    (folder / "manifest.json").write_bytes(manifest.to_bytes())
    return manifest


def test_what_was_written_is_read(tmp_path):
    """Manifest, clouds, cells and card agree with each other."""
    manifest = write(tmp_path, [("train", 1), ("train", 2), ("validation", 3)])
    assert read_manifest(tmp_path) == manifest
    clouds = list(read_clouds(tmp_path, manifest, "train"))
    samples = cell_samples(clouds, PolarGrid())
    assert set(samples.cloud) == {0, 1}
    assert len(samples.features) == len(samples.blocked) == len(samples.cloud)
    assert len(samples.blocked) + samples.n_empty == 2 * 320
    assert 0.1 < samples.blocked.mean() < 0.5
    card = dataset_card(manifest, {"train": np.array([7, 8, 9, 6, 1, 3])})
    assert "| train | 2 | 2 | 12000 | 8 | 9 | 7 | 0.75 |" in card


def test_data_sets_are_joined(tmp_path):
    """Cells are added up, and clouds are numbered on."""
    parts = []
    for name, worlds in (("a", (1, 2)), ("b", (3,))):
        (tmp_path / name).mkdir()
        manifest = write(tmp_path / name, [("train", world) for world in worlds])
        parts.append(split_samples(tmp_path / name, manifest, "train", PolarGrid()))
    both = join_samples(parts)
    assert len(both.blocked) == len(parts[0].blocked) + len(parts[1].blocked)
    assert set(both.cloud) == {0, 1, 2}
    assert set(both.world) == {1, 2, 3}
    assert both.n_empty == parts[0].n_empty + parts[1].n_empty
    assert join_samples(parts[:1]) is parts[0]


def test_a_world_on_both_sides_of_the_split_is_refused(tmp_path):
    """Training and validation share no world."""
    write(tmp_path, [("train", 1), ("validation", 1)])
    with pytest.raises(DatasetError, match="expected each world on one side of the split"):
        read_manifest(tmp_path)


def test_halves_have_no_world_in_common_and_lose_no_cloud(tmp_path):
    """Worlds alternate, their clouds stay together."""
    write(tmp_path, [("train", seed) for seed in (1, 1, 2, 3, 3, 3, 4)] + [("validation", 9)])
    manifest = read_manifest(tmp_path)
    halves = every_second_world(manifest, "train")
    seeds = [[entry.world_seed for entry in half.clouds] for half in halves]
    assert seeds == [[1, 1, 3, 3, 3], [2, 4]]
    assert [len(list(read_clouds(tmp_path, half, "train"))) for half in halves] == [5, 2]
    alone = every_second_world(manifest, "validation")
    assert [len(half.clouds) for half in alone] == [1, 0]


def test_a_changed_cloud_is_refused(tmp_path):
    """Its hash is not that of the manifest."""
    manifest = write(tmp_path, [("train", 1)])
    (tmp_path / "cloud_00000.npz").write_bytes(cloud_to_bytes(labelled(9)))
    with pytest.raises(DatasetError, match="expected SHA-256"):
        list(read_clouds(tmp_path, manifest, "train"))


def test_a_missing_manifest_names_the_next_step(tmp_path):
    """The error names the command that makes one."""
    with pytest.raises(DatasetError, match="andabata clouds generate"):
        read_manifest(tmp_path)


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"version": 2}', "nonsense"])
def test_a_damaged_manifest_is_refused(tmp_path, text):
    """Whatever is wrong, the error names the version that is expected."""
    (tmp_path / "manifest.json").write_text(text)
    with pytest.raises(DatasetError, match="expected a manifest of version 1"):
        read_manifest(tmp_path)
