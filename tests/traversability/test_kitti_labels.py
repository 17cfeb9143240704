"""SemanticKITTI's labels beside a cloud: classes, instances, and what is traversable."""

import numpy as np
import pytest

from traversability.cloud import PointCloud
from traversability.files import CloudFileError, cloud_to_bytes, decode_cloud_file, read_cloud
from traversability.kitti_labels import kitti_labels

RNG = np.random.default_rng(0)
POINTS = RNG.normal(size=(40, 3)).astype(np.float32)


def kitti(folder, labels, traversable=None):
    """Write a cloud in the layout of SemanticKITTI and return its path."""
    for name in ("velodyne", "labels"):
        (folder / name).mkdir()
    path = folder / "velodyne" / "000007.bin"
    path.write_bytes(cloud_to_bytes(PointCloud(POINTS, "sensor"), "bin"))
    (folder / "labels" / "000007.label").write_bytes(np.asarray(labels, dtype="<u4").tobytes())
    if traversable is not None:
        (folder / "traversable.txt").write_text(traversable)
    return path


def test_labels_beside_a_kitti_file_are_semantic_kittis(tmp_path):
    """Points without a label are left out."""
    terrain, trunk, unlabelled = 72, 71 | (5 << 16), 0  # The upper half is the instance.
    cloud = read_cloud(kitti(tmp_path, [terrain] * 20 + [trunk] * 15 + [unlabelled] * 5))
    assert len(cloud) == 35
    np.testing.assert_array_equal(cloud.nontraversable, np.arange(35) >= 20)
    np.testing.assert_array_equal(cloud.classes[:1], [72])


def test_a_sequence_may_name_its_own_traversable_classes(tmp_path):
    """``traversable.txt`` replaces the assumed classes."""
    cloud = read_cloud(kitti(tmp_path, [0, 1, 2, 3] * 10, "0 1\n"))
    np.testing.assert_array_equal(cloud.nontraversable, np.arange(40) % 4 > 1)


@pytest.mark.parametrize(("labels", "words"), [([72] * 39, None), ([72] * 40, "grass")])
def test_labels_that_do_not_fit_are_refused(tmp_path, labels, words):
    """One label too few, or a class that is no number."""
    with pytest.raises(CloudFileError, match=r"expected (40 labels, got 39|class numbers)"):
        read_cloud(kitti(tmp_path, labels, words))


def test_instances_of_semantic_kitti_come_back(tmp_path):
    """Classes are the lower half of a label, instances the upper one."""
    for name in ("velodyne", "labels"):
        (tmp_path / name).mkdir()
    path = tmp_path / "velodyne" / "1.bin"
    rows = np.column_stack([RNG.normal(size=(40, 3)), np.zeros(40)]).astype("<f4")
    path.write_bytes(rows.tobytes())
    labels = (np.arange(40, dtype="<u4") << 16 | 252).tobytes()
    (tmp_path / "labels" / "1.label").write_bytes(labels)
    cloud = decode_cloud_file(path).cloud
    np.testing.assert_array_equal(cloud.instances, np.arange(40))
    assert kitti_labels(cloud) == labels
    with pytest.raises(ValueError, match="expected 0 to 65535 in a label file"):
        kitti_labels(PointCloud(cloud.points, "sensor", classes=np.full(40, 70_000)))
