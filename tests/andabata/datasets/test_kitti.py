"""Labelled clouds in SemanticKITTI's layout come back with the labels they had."""

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.datasets.kitti import ROUGH_GROUND, begin_sequence, end_sequence, scan_files
from andabata.machine.pose import Pose
from terrain.classes import SemanticClass
from traversability.cloud import PointCloud
from traversability.files import read_cloud


def test_both_layouts_hold_the_same_clouds(tmp_path, capsys):
    """Each split is a sequence with its clouds in the sensor frame, labels and poses."""
    counts = ["--train", "2", "--validation", "1", "--workers", "1"]
    small = ["--set", "patch_size=40", "--quiet"]
    assert main(["clouds", "generate", "--out", str(tmp_path), "--kitti", *counts, *small]) == 0
    for split, numbers in (("00", (0, 1)), ("01", (2,))):
        folder = tmp_path / "kitti" / split
        poses = np.loadtxt(folder / "poses.txt", ndmin=2)
        assert poses.shape == (len(numbers), 12)
        turns = poses.reshape(-1, 3, 4)[:, :, :3]
        np.testing.assert_allclose(
            turns @ turns.transpose(0, 2, 1), [np.eye(3)] * len(turns), atol=1e-6
        )
        assert "rough_ground" in (folder / "andabata.yaml").read_text()
        for place, number in enumerate(numbers):
            ours = read_cloud(tmp_path / f"cloud_{number:05d}.npz")
            theirs = read_cloud(folder / "velodyne" / f"{place:06d}.bin")
            lifted = theirs.points + np.float32([0, 0, 0.72])
            np.testing.assert_allclose(lifted, ours.points, atol=1e-5)
            np.testing.assert_array_equal(theirs.nontraversable, ours.nontraversable)


def test_a_cloud_is_converted_with_its_labels(tmp_path, capsys):
    """A converted cloud keeps points and labels; an unknown format is refused."""
    counts = ["--train", "1", "--validation", "0", "--workers", "1"]
    assert main(["clouds", "generate", "--out", str(tmp_path), *counts, "--quiet"]) == 0
    source, ply = tmp_path / "cloud_00000.npz", tmp_path / "cloud.ply"
    assert main(["clouds", "convert", str(source), str(ply)]) == 0
    ours, theirs = read_cloud(source), read_cloud(ply)
    np.testing.assert_array_equal(theirs.points, ours.points)
    np.testing.assert_array_equal(theirs.severity, ours.severity)
    assert main(["clouds", "convert", str(source), str(tmp_path / "cloud.docx")]) == 1
    assert "expected npz, ply, pcd, las, laz or bin" in capsys.readouterr().err


def test_a_scan_is_known_to_the_byte():
    """Points are written below the sensor's height, rough ground gets a label of its own."""
    kinds = [SemanticClass.GROUND, SemanticClass.GROUND, SemanticClass.TRUNK]
    cloud = PointCloud(
        np.array([[1, 2, 0], [3, 4, 0.5], [5, 6, 1]], dtype=np.float32),
        "base_footprint",
        classes=np.array(kinds, dtype=np.uint8),
        nontraversable=np.array([False, True, True]),
    )
    files = scan_files(7, cloud, 0.75)
    points = np.frombuffer(files.pop("velodyne/000007.bin"), "<f4").reshape(-1, 4)
    np.testing.assert_allclose(points[:, :3], [[1, 2, -0.75], [3, 4, -0.25], [5, 6, 0.25]])
    labels = np.frombuffer(files.pop("labels/000007.label"), "<u4")
    expected = [SemanticClass.GROUND, ROUGH_GROUND, SemanticClass.TRUNK]
    assert labels.tolist() == [int(kind) for kind in expected]
    assert files == {}
    with pytest.raises(ValueError, match="expected a labelled cloud"):
        scan_files(8, PointCloud(cloud.points, "base_footprint"), 0.75)


def test_poses_are_those_of_the_sensor(tmp_path):
    """A line is the sensor's pose in the map, row by row: turned by the yaw alone, lifted."""
    pose = Pose.from_euler(np.array([1.0, 2.0, 3.0]), 0.1, -0.2, np.pi / 2)
    end_sequence(tmp_path, [pose], 0.5)
    matrix = np.loadtxt(tmp_path / "poses.txt").reshape(3, 4)
    expected = [[0, -1, 0, 1], [1, 0, 0, 2], [0, 0, 1, 3.5]]
    np.testing.assert_allclose(matrix, expected, atol=1e-9)


def test_the_labels_are_explained(tmp_path):
    """The list of traversable labels agrees with the learning map: 1 traversable, 2 not."""
    begin_sequence(tmp_path)
    good = {int(word) for word in (tmp_path / "traversable.txt").read_text().split()}
    lines = (tmp_path / "andabata.yaml").read_text().split("learning_map:\n")[1].splitlines()
    found = dict(map(int, line.split(":")) for line in lines)
    assert {number for number, state in found.items() if state == 1} == good
    assert found[int(SemanticClass.TRUNK)] == found[ROUGH_GROUND] == 2
    assert found[int(SemanticClass.GROUND)] == 1
