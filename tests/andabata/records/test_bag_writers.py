"""Written recordings come back as they were, beside a manifest; paths are new and known."""

import hashlib
import json

import numpy as np
import pytest

from andabata.exports.topics import decode_bag_cloud
from andabata.records import topics
from andabata.records.bag_writers import open_writer, write_manifest
from andabata.records.bags import BagError
from andabata.records.messages import MessageBuilder
from traversability.cloud import PointCloud


def test_existing_and_odd_paths_are_refused(tmp_path):
    """A recording is never overwritten; its suffix chooses the format."""
    path = tmp_path / "other.bag"
    open_writer(path).close()
    with pytest.raises(BagError, match="an existing one"):
        open_writer(path)
    with pytest.raises(BagError, match=r"\.bag, \.mcap or \.db3"):
        open_writer(tmp_path / "x.txt")


def test_the_manifest_holds_checksums_and_facts(tmp_path):
    """The manifest holds the SHA-256 of a file, or of each file of a folder."""
    file, folder = tmp_path / "x.mcap", tmp_path / "x.db3"
    file.write_bytes(b"one")
    folder.mkdir()
    (folder / "metadata.yaml").write_bytes(b"two")
    for path, name, data in ((file, "x.mcap", b"one"), (folder, "metadata.yaml", b"two")):
        manifest = write_manifest(path, {"seed": 3})
        assert manifest == path.with_name(f"{path.name}.json")
        sums = {name: hashlib.sha256(data).hexdigest()}
        assert json.loads(manifest.read_text()) == {"sha256": sums, "seed": 3}


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
