"""Placement: motion compensation, limits, mountings and clouds of a 3D laser."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.beam_placement import BeamLimits, place_beams, place_points, sweeps_to_cloud
from andabata.machine.beams import BeamTables
from andabata.machine.pose import PoseTrack
from tests.andabata.machine.beam_sweeps import HEIGHT, expected_rays, sweeps, track
from traversability.cloud import PointCloud


def test_returns_lie_on_their_rays_at_their_times():
    """A return is origin plus range times direction; beams without return are left out."""
    points, times, rows, newest = place_beams(sweeps(), track(), HEIGHT, BeamTables())
    rays = expected_rays(track())
    ranges = sweeps().ranges.ravel()
    kept = np.isfinite(ranges)
    np.testing.assert_array_equal(rows, np.flatnonzero(kept))
    expected = rays[kept, :3] + ranges[kept, None] * rays[kept, 3:]
    np.testing.assert_allclose(points, expected, atol=1e-5)
    np.testing.assert_allclose(times, [0.5, 0.54, 1.0, 1.02, 1.04])
    assert newest == times[-1]


def test_beams_within_limits_alone_are_placed():
    """A beam has the same point whichever others are placed, and its number among all."""
    limits = BeamLimits(max_range=4.0, dense_range=10.0, dense_stride=2)
    points, times, rows, _ = place_beams(sweeps(), track(), HEIGHT, BeamTables(), limits)
    whole = place_beams(sweeps(), track(), HEIGHT, BeamTables())
    ranges = sweeps().ranges.ravel()
    kept = (ranges < 4.0) & (np.arange(6) % 3 % 2 == 0)
    assert 0 < kept.sum() < len(whole.rows)
    np.testing.assert_array_equal(rows, np.flatnonzero(kept))
    np.testing.assert_array_equal(points, whole.points[np.isin(whole.rows, rows)])
    np.testing.assert_array_equal(times, whole.times[np.isin(whole.rows, rows)])


@pytest.mark.parametrize(("frame", "lift"), [("sensor", HEIGHT), ("base_link", 0.0)])
def test_a_mounting_moves_and_turns_the_head(frame, lift):
    """A mounted head's points are those of its own pose on the base."""
    turn = Rotation.from_euler("ZYX", [0.5, -0.3, 0.2])
    mounting = np.array([0.1, -0.2, 0.4, *turn.as_quat()])
    points, times, *_ = place_beams(
        sweeps(mounting=mounting, frame=frame), track(), HEIGHT, BeamTables()
    )
    still = PoseTrack(1)
    still.append(0.0, np.zeros(3), np.array([0, 0, 0, 1.0]))
    head = place_beams(sweeps(), still, 0.0, BeamTables()).points
    rows = track().at(times)
    inner = turn.apply(head) + np.array([0.1, -0.2, 0.4 + lift])
    expected = rows[:, :3] + Rotation.from_quat(rows[:, 3:]).apply(inner)
    np.testing.assert_allclose(points, expected, atol=2e-5)


def test_a_cloud_of_sweeps_is_placed_like_the_sweeps():
    """Points of a message, placed with their times, equal the beams' own points."""
    tables = BeamTables()
    cloud = sweeps_to_cloud(sweeps(classes=np.arange(6, dtype=np.uint8).reshape(2, 3)), tables)
    assert cloud.frame == "sensor"
    np.testing.assert_array_equal(cloud.classes, [0, 2, 3, 4, 5])
    placed = place_points(cloud, track(), HEIGHT)
    expected = place_beams(sweeps(), track(), HEIGHT, tables).points
    np.testing.assert_allclose(placed, expected, atol=2e-5)


def test_points_of_each_frame_are_placed_by_their_own_rule():
    """Sensor points are lifted, base_link points are not, levelled ones turn about z alone."""
    poses, points = track(), np.array([[1.0, 0.5, 0.2]], dtype=np.float32)
    stamps = np.array([1.0])
    row = poses.at(stamps)[0]
    turn = Rotation.from_quat(row[3:])
    twist = Rotation.from_euler("z", 2 * np.arctan2(row[5], row[6]))
    for frame, expected in (
        ("sensor", turn.apply([1.0, 0.5, 0.2 + HEIGHT])),
        ("base_link", turn.apply([1.0, 0.5, 0.2])),
        ("base_footprint", twist.apply([1.0, 0.5, 0.2])),
    ):
        placed = place_points(PointCloud(points, frame, stamps, None), poses, HEIGHT)
        np.testing.assert_allclose(placed[0], row[:3] + expected, atol=1e-5)


def test_points_without_times_or_in_another_frame_are_refused():
    """Motion compensation takes times, and one of three frames."""
    points = np.zeros((1, 3), dtype=np.float32)
    with pytest.raises(ValueError, match="expected a time of each point"):
        place_points(PointCloud(points, "sensor", None, None), track(), HEIGHT)
    with pytest.raises(ValueError, match="expected sensor, base_link or base_footprint"):
        place_points(PointCloud(points, "map", np.zeros(1), None), track(), HEIGHT)
