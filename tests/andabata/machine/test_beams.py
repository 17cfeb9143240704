"""Geometry of beams: rays, motion compensation, mountings and levelled clouds."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.beams import (
    BeamLimits,
    BeamTables,
    beam_bearings,
    beam_rays,
    place_beams,
    place_points,
    sweeps_to_cloud,
)
from andabata.machine.pose import Pose, PoseTrack
from andabata.machine.sensor_readings import Sweeps
from traversability.cloud import PointCloud

HEIGHT = 0.7


def track(speed=0.5, rate=0.4):
    """Return two seconds of a turning, leaning drive."""
    poses = PoseTrack()
    for k in range(201):
        pose = Pose.from_euler(np.array([speed * k / 100, 0.2, 0.1]), 0.1, -0.2, rate * k / 100)
        poses.append(k / 100, pose.position, pose.quaternion)
    return poses


def sweeps(**fields):
    """Return two sweeps of three beams with ranges."""
    given = {
        "stamps": np.array([0.5, 1.0]),
        "head_angles": np.array([0.3, 1.1]),
        "head_rate": 1.5,
        "beam_period": 0.02,
        "elevations": np.array([-0.4, 0.9, 1.9], dtype=np.float32),
        "ranges": np.array([[2.0, np.inf, 5.0], [1.0, 3.0, 4.0]], dtype=np.float32),
    }
    return Sweeps(**(given | fields))


def expected_rays(poses):
    """Return origin and direction of every beam by rotations of scipy."""
    found = []
    for stamp, head in ((0.5, 0.3), (1.0, 1.1)):
        for j, tilt in enumerate((-0.4, 0.9, 1.9)):
            row = poses.at(np.array([stamp + 0.02 * j]))[0]
            angle = head + 1.5 * 0.02 * j
            # Zenith tilted towards the head's front, then turned with the head.
            beam = Rotation.from_euler("ZY", [angle, tilt]).apply([0, 0, 1])
            turn = Rotation.from_quat(row[3:])
            found.append([*(row[:3] + turn.apply([0, 0, HEIGHT])), *turn.apply(beam)])
    return np.array(found)


@pytest.mark.parametrize("table", [[-0.4, 0.9, 1.9], [[-0.4, 0.9, 1.9], [0.2, -1.5, 0.1]]])
def test_bearings_are_those_of_the_rays_of_a_level_robot(table):
    """Each beam's bearing is the direction of its ray, for one table of elevations or one each."""
    poses = PoseTrack()
    for stamp in (0.0, 2.0):
        poses.append(stamp, np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    given = sweeps(elevations=np.array(table, dtype=np.float32))
    rays, rows = beam_rays(given, poses, HEIGHT, BeamTables()), np.array([5, 0, 1, 3, 4])
    differences = beam_bearings(given, rows) - np.arctan2(rays[rows, 4], rays[rows, 3])
    np.testing.assert_allclose(np.exp(1j * differences), 1.0, atol=1e-5)


def test_each_ray_has_the_pose_and_head_angle_of_its_own_instant():
    """Rays equal those of scipy's rotations, beam by beam."""
    rays = beam_rays(sweeps(), track(), HEIGHT, BeamTables())
    np.testing.assert_allclose(rays, expected_rays(track()), atol=2e-6)


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


def test_tables_follow_the_beams_that_they_are_given():
    """A cache that served other beams gives the same rays as a new one."""
    tables = BeamTables()
    beam_rays(sweeps(elevations=np.zeros(3, dtype=np.float32)), track(), HEIGHT, tables)
    rays = beam_rays(sweeps(), track(), HEIGHT, tables).copy()
    np.testing.assert_array_equal(rays, beam_rays(sweeps(), track(), HEIGHT, BeamTables()))
    other = beam_rays(sweeps(head_rate=-1.5), track(), HEIGHT, tables)
    assert not np.array_equal(rays, other)


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
