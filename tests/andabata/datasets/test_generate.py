"""Data sets of labelled clouds: the same seed gives the same bytes, worlds serve one split."""

import json

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.bench.studies.cluster import digests
from andabata.datasets import generate
from andabata.datasets.generate import file_name, generate_dataset, plan, world_of
from andabata.datasets.labelled_cloud import CloudsConfig
from worlds.splits import DATASET_START

SMALL = ["--set", "patch_size=40", "--set", "patch_cell=0.25"]
CONFIG = CloudsConfig(patch_size=40.0, patch_cell=0.25)


def test_the_same_seed_gives_the_same_clouds_whatever_the_workers(capsys, tmp_path):
    """One process and two write the same files and the same manifest."""
    found = []
    for workers in ("1", "2"):
        words = ["--train", "2", "--validation", "1", "--seed", "7", "--workers", workers]
        out = tmp_path / workers
        assert main(["clouds", "generate", "--out", str(out), *words, *SMALL, "--json"]) == 0
        text = capsys.readouterr().out
        assert text.count("\n") == 1  # One JSON object and nothing else.
        found.append((json.loads(text)["sha256"], (out / "manifest.json").read_bytes()))
    assert found[0] == found[1]
    manifest = json.loads(found[0][1])
    assert found[0][0] == {entry["file"]: entry["sha256"] for entry in manifest["clouds"]}
    assert len(set(found[0][0].values())) == 3  # No cloud is taken twice.


def test_clouds_have_generators_of_their_own(monkeypatch):
    """The generator of a cloud follows from the seed and its number, and from nothing else."""
    states = []

    def take(scene, config, rng):
        states.append(tuple(rng.integers(2**31, size=3).tolist()))
        raise StopAsyncIteration

    monkeypatch.setattr(generate, "take_cloud", take)
    monkeypatch.setattr(generate, "cloud_scene", lambda *_: None)
    for seed in (0, 1):
        for batch in plan(CONFIG, {"train": 8, "validation": 4}):
            for number in batch.clouds:
                one = generate.CloudBatch(batch.world, batch.split, (number,), batch.first)
                with pytest.raises(StopAsyncIteration):
                    generate.make_clouds(CONFIG, seed, False, one)
    assert len(states) == len(set(states)) == 24


def test_each_split_has_its_own_worlds_and_every_kind():
    """Clouds are numbered through, a world serves one split, each split has every preset."""
    batches = plan(CloudsConfig(clouds_per_world=10), {"train": 100, "validation": 30})
    clouds = [number for batch in batches for number in batch.clouds]
    assert sorted(clouds) == list(range(130))
    assert len({batch.world for batch in batches}) == len(batches)
    for split in ("train", "validation"):
        kinds = {batch.world % 8 for batch in batches if batch.split == split}
        assert len(kinds) == 8 == len(CONFIG.presets)
        assert max(len(batch.clouds) for batch in batches if batch.split == split) <= 10


def test_worlds_of_data_sets_are_theirs_alone():
    """Presets are taken in turn; worlds of two seeds differ, and none is trained or driven in."""
    presets = CONFIG.presets
    n = 2 * len(presets)
    found = [world_of(CONFIG, seed, k) for seed in (0, 1) for k in range(n)]
    assert [preset for preset, _ in found[:n]] == [*presets, *presets]
    assert len(set(found)) == 2 * n
    assert min(seed for _, seed in found) >= DATASET_START


def test_a_split_spreads_its_clouds_over_its_worlds():
    """No world has more clouds than set, and counts of two worlds differ by one at most."""
    batches = plan(CloudsConfig(clouds_per_world=4), {"train": 50, "validation": 3})
    train = [len(batch.clouds) for batch in batches if batch.split == "train"]
    assert len(train) == 13
    assert max(train) == 4
    assert max(train) - min(train) <= 1
    assert [batch.clouds for batch in batches if batch.split == "validation"] == [
        (50,),
        (51,),
        (52,),
    ]
    assert {batch.first for batch in batches} == {0, 50}


def test_files_are_numbered():
    """Names of files have five digits, so that they sort by number."""
    assert file_name(42) == "cloud_00042.npz"


def test_the_manifest_comes_last(tmp_path, monkeypatch):
    """A set that was not finished has no manifest, also where an older one stood."""
    (tmp_path / "manifest.json").write_text("old")

    def fail(*_):
        raise OSError("disk full")

    monkeypatch.setattr(generate, "make_clouds", fail)
    with pytest.raises(OSError, match="disk full"):
        generate_dataset(tmp_path, CONFIG, {"train": 1}, 0, print)
    assert not (tmp_path / "manifest.json").exists()


def test_each_cloud_is_reported_and_counted(tmp_path):
    """The manifest knows points, world and split of each cloud, the card counts the cells."""
    seen = []
    manifest = generate_dataset(tmp_path, CONFIG, {"train": 1, "validation": 1}, 3, seen.append)
    assert seen == [1, 1]
    for number, entry in enumerate(manifest.clouds):
        assert entry.file == file_name(number)
        with np.load(tmp_path / entry.file) as data:
            assert len(data["points"]) == entry.points > 1000
        assert (entry.world, entry.world_seed) == world_of(CONFIG, 3, number)
    assert [entry.split for entry in manifest.clouds] == ["train", "validation"]
    assert "train" in (tmp_path / "README.md").read_text()


def test_a_killed_run_goes_on_where_it_was(tmp_path, monkeypatch):
    """Worlds of the journal are not made again; the end has the bytes of an unbroken run."""
    config = CONFIG.model_copy(update={"clouds_per_world": 1})
    counts, made, make = {"train": 2, "validation": 1}, [], generate.make_clouds
    generate_dataset(tmp_path / "whole", config, counts, 3, made.append, kitti=True)
    assert made == [1, 1, 1]

    def kill(count):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        generate_dataset(tmp_path / "cut", config, counts, 3, kill, kitti=True)
    assert not (tmp_path / "cut/manifest.json").exists()
    with pytest.raises(ValueError, match=r"a journal of this run, got .* seed; take another"):
        generate_dataset(tmp_path / "cut", config, counts, 4, made.append, kitti=True)
    again = []
    monkeypatch.setattr(
        generate, "make_clouds", lambda *most: again.append(most[-1].world) or make(*most)
    )
    generate_dataset(tmp_path / "cut", config, counts, 3, made.append, kitti=True)
    assert again == [1, 2]
    assert digests(tmp_path / "cut", "run.json") == digests(tmp_path / "whole", "run.json")
