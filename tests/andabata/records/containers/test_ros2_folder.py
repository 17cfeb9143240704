"""ROS 2 folders are read with and without metadata, split and compressed."""

import pytest
import zstandard

from andabata.records.bags import Bag, BagError
from andabata.records.containers.opening import is_recording, open_container
from tests.support.recordings import note, stamp, write_bag, write_db3, write_mcap
from traversability import unpacked_size


def notes_of(path, damaged=False):
    """Return the texts of all messages of a recording."""
    with Bag(path, damaged) as bag:
        return [message.content.data for message in bag.messages()]


EVERY = [f"note {k}" for k in range(10)]


@pytest.mark.parametrize("suffix", ["db3", "mcap"])
def test_a_folder_without_metadata_is_read_from_its_files(tmp_path, suffix):
    """Without metadata.yaml the files are read, and a note reports it."""
    folder = tmp_path / "drive"
    folder.mkdir()
    (write_db3 if suffix == "db3" else write_mcap)(folder / f"drive_0.{suffix}")
    with Bag(folder) as bag:
        assert bag.topics["/notes"] == ("std_msgs/msg/String", 10)
        assert "metadata.yaml" in bag.notes[0]
    assert notes_of(folder) == EVERY


def test_split_files_are_read_in_order_as_one_connection(tmp_path):
    """Twelve files are read in numerical order, and equal connections are merged."""
    folder = tmp_path / "drive"
    folder.mkdir()
    for part in range(12):
        write_db3(folder / f"drive_{part}.db3", 2, first=2 * part)
    with Bag(folder) as bag:
        assert len(bag.connections) == 1
        assert bag.connections[0].latching
        found = [(m.stamp_ns, m.content.data) for m in bag.messages()]
    assert found == [(stamp(k), f"note {k}") for k in range(24)]


@pytest.mark.parametrize("suffix", ["db3", "mcap"])
def test_files_compressed_by_zstd_are_read_in_a_folder_and_alone(tmp_path, suffix):
    """A compressed file is read by its own path and by its folder's."""
    plain = (write_db3 if suffix == "db3" else write_mcap)(tmp_path / f"x.{suffix}")
    folder = tmp_path / "drive"
    folder.mkdir()
    packed = folder / f"x_0.{suffix}.zstd"
    packed.write_bytes(zstandard.compress(plain.read_bytes()))
    assert notes_of(packed) == EVERY
    assert notes_of(folder) == EVERY
    assert is_recording(packed)


def test_messages_compressed_one_by_one_are_read(tmp_path):
    """Messages that are compressed each are read."""
    path = write_db3(tmp_path / "x.db3", data=lambda k: zstandard.compress(note(2, k)))
    assert notes_of(path) == EVERY


def test_a_listed_file_that_is_missing_is_damage(tmp_path):
    """A missing file is named as damage, and the others can be read."""
    folder = tmp_path / "drive"
    folder.mkdir()
    write_db3(folder / "drive_0.db3")
    (folder / "metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  relative_file_paths: [drive_0.db3, drive_1.db3]\n"
    )
    with pytest.raises(BagError, match=r"drive_1\.db3"), Bag(folder):
        pass
    assert notes_of(folder, damaged=True) == EVERY


def test_metadata_with_other_counts_is_noted(tmp_path):
    """Wrong counts in metadata.yaml, or a damaged one, are noted only."""
    folder = tmp_path / "drive"
    folder.mkdir()
    write_db3(folder / "drive_0.db3")
    (folder / "metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  relative_file_paths: [drive_0.db3]\n"
        "  topics_with_message_count:\n"
        "  - {topic_metadata: {name: /notes}, message_count: 12}\n"
    )
    with Bag(folder) as bag:
        assert "counts 12 messages, the file holds 10" in bag.notes[0]
    (folder / "metadata.yaml").write_text("{rosbag2_bagfile")
    with Bag(folder) as bag:
        assert "damaged" in bag.notes[0]
        assert bag.topics["/notes"][1] == 10


def test_one_unreadable_file_is_skipped_alone(tmp_path):
    """An empty file among others is damage, and the others are read."""
    folder = tmp_path / "drive"
    folder.mkdir()
    write_db3(folder / "drive_0.db3")
    (folder / "drive_1.db3").write_bytes(b"")
    assert notes_of(folder, damaged=True) == EVERY


def test_a_folder_without_a_recording_is_an_error(tmp_path):
    """A folder without any file of messages raises a BagError."""
    with pytest.raises(BagError, match=r"\.db3 or \.mcap files, got none"), Bag(tmp_path):
        pass


def test_recordings_are_recognised_by_their_content(tmp_path):
    """The format follows from the first bytes, whatever the suffix."""
    names = {
        write_bag(tmp_path / "a.bag"): "a.bag.active",
        write_mcap(tmp_path / "b.mcap"): "b.bin",
        write_db3(tmp_path / "c.db3"): "c",
    }
    for path, name in names.items():
        other = path.rename(tmp_path / name)
        assert is_recording(other)
        assert notes_of(other) == EVERY
    (tmp_path / "cloud.ply").write_bytes(b"ply\n")
    assert not is_recording(tmp_path / "cloud.ply")


@pytest.mark.parametrize("name", ["x.bag.active", "x.db3", "x.mcap.zstd", "folder"])
def test_a_cloud_of_any_recording_is_scanned(tmp_path, monkeypatch, capsys, name):
    """`scan` reads a cloud from every format of recordings."""
    import json

    import numpy as np

    from andabata.app.cli import main
    from andabata.records import topics
    from andabata.records.bag_writers import open_writer
    from andabata.records.messages import MessageBuilder
    from traversability.cloud import PointCloud

    monkeypatch.chdir(tmp_path)
    points = np.random.default_rng(0).uniform(-8, 8, (3000, 3)).astype(np.float32)
    points[:, 2] = -0.72
    suffix = {"x.bag.active": ".bag", "x.mcap.zstd": ".mcap"}.get(name, ".db3")
    ros = 1 if suffix == ".bag" else 2
    made = tmp_path / f"made{suffix}"
    writer, builder = open_writer(made), MessageBuilder(ros)
    cloud = builder.cloud(0.0, PointCloud(points, "velodyne"))
    writer.write(topics.CLOUD, builder.stamp_ns(0.0), cloud)
    writer.close()
    path = tmp_path / name
    if name == "x.mcap.zstd":
        path.write_bytes(zstandard.compress(made.read_bytes()))
    else:
        (next(made.glob("*.db3")) if name == "x.db3" else made).rename(path)
    if name == "folder":
        (path / "metadata.yaml").unlink()
    assert main(["scan", str(path), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["points"] == len(points)


def test_a_small_file_that_decompresses_to_far_more_is_refused(tmp_path, monkeypatch):
    """Decompression stops at the limit, and leaves no file behind."""
    zeros, path = bytes(1 << 20), tmp_path / "x.mcap.zstd"
    monkeypatch.setattr(unpacked_size, "_SMALL", 1000)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    path.write_bytes(zstandard.compress(zeros))
    with pytest.raises(BagError, match=r"x\.mcap\.zstd: expected at most [\d,]+ bytes"):
        open_container(path)
    assert list(tmp_path.iterdir()) == [path]
