"""Labelled clouds in SemanticKITTI's layout come back with the labels they had."""

import numpy as np

from andabata.app.cli import main
from traversability.files import read_cloud


def test_both_layouts_hold_the_same_clouds(tmp_path, capsys):
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
    counts = ["--train", "1", "--validation", "0", "--workers", "1"]
    assert main(["clouds", "generate", "--out", str(tmp_path), *counts, "--quiet"]) == 0
    source, ply = tmp_path / "cloud_00000.npz", tmp_path / "cloud.ply"
    assert main(["clouds", "convert", str(source), str(ply)]) == 0
    ours, theirs = read_cloud(source), read_cloud(ply)
    np.testing.assert_array_equal(theirs.points, ours.points)
    np.testing.assert_array_equal(theirs.severity, ours.severity)
    assert main(["clouds", "convert", str(source), str(tmp_path / "cloud.docx")]) == 1
    assert "expected npz, ply, pcd, las, laz or bin" in capsys.readouterr().err
