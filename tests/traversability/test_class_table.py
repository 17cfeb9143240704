"""Tables of semantic classes, and the labels that they judge."""

import numpy as np
import pytest

from traversability.class_table import (
    ClassTableError,
    class_table_names,
    load_class_table,
)
from traversability.cloud import PointCloud
from traversability.decoding import DecodedCloud
from traversability.files import CloudFileError, cloud_to_bytes, decode_cloud_file

MINE = '[free]\n1 = "moss"\n[blocked]\n2 = "wall"\n[unknown]\n0 = "none"\n'


@pytest.fixture
def mine(tmp_path):
    """Return a table of one's own."""
    file = tmp_path / "mine.toml"
    file.write_text(MINE)
    return load_class_table(str(file))


def test_the_tables_of_the_package_are_whole():
    """Each names its data set's classes once; roads are free, people blocked, void unknown."""
    assert class_table_names() == ["goose", "rellis", "semantickitti"]
    for name, size, free, blocked, unknown in (
        ("goose", 64, 23, 14, 0),
        ("rellis", 20, 10, 17, 0),
        ("semantickitti", 34, 40, 30, 0),
    ):
        table = load_class_table(name)
        assert len(table.free) + len(table.blocked) + len(table.unknown) == size
        assert free in table.free
        assert blocked in table.blocked
        assert unknown in table.unknown


def test_classes_are_judged_and_strangers_named(mine):
    """Free and blocked classes are known, unknown ones and strangers are not, and none are bad."""
    bad, known, strangers = mine.judge(np.array([1, 2, 0, 7, 9, 7], dtype=np.uint8))
    assert bad.tolist() == [False, True, False, False, False, False]
    assert known.tolist() == [True, True, False, False, False, False]
    assert strangers == (7, 9)


def test_strangers_are_said(mine):
    """A remark names the classes that the table lacks, and the share of unknown points."""
    cloud = PointCloud(np.ones((4, 3), np.float32), classes=np.array([1, 2, 0, 7]))
    decoded = mine.apply(DecodedCloud(cloud))
    assert decoded.cloud.nontraversable.tolist() == [False, True, False, False]
    assert decoded.labelling.unlabelled == 2
    assert any("labels 7 are not in the table mine.toml" in text for text in decoded.remarks)
    assert any("50 % of the points" in text for text in decoded.remarks)
    plain = DecodedCloud(PointCloud(cloud.points[:2], classes=cloud.classes[:2]))
    assert mine.apply(plain).remarks == ()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('[free]\n1 = "a"\n[blocked]\n1 = "b"\n', "class in one section, got 1 in two"),
        ('[free]\n1 = "a"\n', "blocked: Field required"),
        ('[free]\nroad = "a"\n[blocked]\n1 = "b"\n', "free.road"),
        ("[free\n", "expected TOML"),
        ("a = " + 5000 * "[" + "\n", "expected TOML"),
        ("a = " + 5000 * "9" + "\n", "expected TOML"),
        (b"[free]\n1 = '\xff'\n", "expected TOML"),
        ('[fre]\n1 = "a"\n', "NUMBER = "),
    ],
)
def test_a_wrong_table_is_refused(tmp_path, text, words):
    """The error names the file, the place and the form of a line."""
    file = tmp_path / "wrong.toml"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(ClassTableError, match=r"wrong\.toml: ") as error:
        load_class_table(str(file))
    assert words in str(error.value)


def test_an_unknown_table_names_those_that_are_known():
    """Neither a table of the package nor a file: the error lists the tables."""
    with pytest.raises(ClassTableError, match="expected goose, rellis, semantickitti or a TOML"):
        load_class_table("cityscapes")


def write_labels(path, labels):
    """Write a label file of SemanticKITTI: the class in the lower half, an instance above."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes((np.asarray(labels, np.uint32) | 5 << 16).astype("<u4").tobytes())


@pytest.mark.parametrize(
    ("name", "cloud", "labels"),
    [
        ("semantickitti", "velodyne/000001.bin", "labels/000001.label"),
        ("semantickitti", "000001.bin", "000001.label"),
        (
            "rellis",
            "os1_cloud_node_kitti_bin/000001.bin",
            "os1_cloud_node_semantickitti_label_id/000001.label",
        ),
        ("goose", "lidar/val/s/x__1_2_vls128.bin", "labels/val/s/x__1_2_goose.label"),
        ("goose", "x.ply", "x.label"),
    ],
)
def test_labels_beside_a_cloud_are_found(tmp_path, name, cloud, labels):
    """Each data set's own folders are known; instances are above the class, no-returns drop out."""
    table = load_class_table(name)
    points = np.random.default_rng(0).uniform(1, 5, (40, 3)).astype(np.float32)
    points[3] = 0  # A no-return, whose label has to go with it.
    classes = np.resize([table.free[0], table.blocked[0], table.unknown[0]], 40)
    path = tmp_path / cloud
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(cloud_to_bytes(PointCloud(points, "sensor"), path.suffix[1:]))
    write_labels(tmp_path / labels, classes)
    found = decode_cloud_file(path, 4 if path.suffix == ".bin" else None, labels=table)
    kept = np.delete(classes, 3)
    assert found.cloud.classes.tolist() == kept.tolist()
    assert found.cloud.nontraversable.tolist() == (kept == table.blocked[0]).tolist()
    assert found.labelling.assumed is False


def test_a_column_of_classes_does_without_a_label_file(tmp_path, mine):
    """Classes of a PLY file's own column are judged by the table."""
    cloud = PointCloud(np.ones((5, 3), np.float32), "sensor", classes=np.array([1, 2, 2, 1, 1]))
    path = tmp_path / "a.ply"
    path.write_bytes(cloud_to_bytes(cloud, "ply"))
    found = decode_cloud_file(path, labels=mine).cloud.nontraversable
    assert found.tolist() == [False, True, True, False, False]


def test_missing_and_wrong_labels_are_refused(tmp_path, mine):
    """No labels at all, or another number than points: the error says what was looked for."""
    path = tmp_path / "a.bin"
    cloud = PointCloud(np.ones((40, 3), np.float32) * 2, "sensor")
    path.write_bytes(cloud_to_bytes(cloud, "bin"))
    with pytest.raises(CloudFileError, match=r"or a file NAME\.label beside the cloud"):
        decode_cloud_file(path, 4, labels=mine)
    write_labels(tmp_path / "a.label", np.ones(39))
    with pytest.raises(CloudFileError, match=r"a\.label: expected 40 labels, got 39"):
        decode_cloud_file(path, 4, labels=mine)
