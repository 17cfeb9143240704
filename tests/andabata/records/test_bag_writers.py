"""Written recordings come back as they were, beside a manifest; paths are new and known."""

import shutil

import numpy as np
import pytest

from andabata.exports.topics import decode_bag_cloud
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.bags import BagError
from andabata.records.messages import MessageBuilder
from andabata.records.salvage import salvage
from traversability.cloud import PointCloud


def test_existing_and_odd_paths_are_refused(tmp_path):
    """A recording is never overwritten; its suffix chooses the format."""
    path = tmp_path / "other.bag"
    open_writer(path).close()
    with pytest.raises(BagError, match="an existing one"):
        open_writer(path)
    with pytest.raises(BagError, match=r"\.bag, \.mcap or \.db3"):
        open_writer(tmp_path / "x.txt")


def test_a_cloud_survives_writing_and_reading(tmp_path):
    """Points and frame of a cloud come back exactly from both formats."""
    points = np.random.default_rng(0).normal(size=(500, 3)).astype(np.float32)
    for suffix, ros in (("bag", 1), ("mcap", 2)):
        path = tmp_path / f"one.{suffix}"
        writer, builder = open_writer(path), MessageBuilder(ros)
        message = builder.cloud(1.0, PointCloud(points, "base_footprint"))
        writer.write(topics.CLOUD, builder.stamp_ns(1.0), message)
        writer.close()
        cloud = decode_bag_cloud(path, None).cloud
        np.testing.assert_array_equal(cloud.points, points)
        assert cloud.frame == "base_footprint"


@pytest.mark.parametrize("kind", ["bag", "mcap", "db3"])
def test_a_killed_recorder_loses_at_most_a_second(tmp_path, kind):
    """What is on the disk before the end holds all but the last second, and has no end."""
    path = tmp_path / f"x.{kind}"
    writer = open_writer(path)
    builder = MessageBuilder(writer.ros)
    for k in range(36):
        message = builder.cloud(0.1 * k, PointCloud(np.zeros((1, 3), np.float32), "lidar"))
        writer.write(topics.CLOUD, builder.stamp_ns(0.1 * k), message)
    (shutil.copytree if path.is_dir() else shutil.copy)(path, tmp_path / f"killed.{kind}")
    killed = salvage(tmp_path / f"killed.{kind}", tmp_path / f"saved.{kind}")
    assert killed.messages == 30
    assert (killed.finished, killed.lost) == (False, False)
    assert killed.reason == "the recording has no end: its recorder did not finish it"
    writer.close()
    whole = salvage(path, tmp_path / f"whole.{kind}")
    assert (whole.messages, whole.finished, whole.reason) == (36, True, "")
