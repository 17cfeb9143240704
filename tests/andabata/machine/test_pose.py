"""Poses and tracks of poses: interpolation, order, rotation."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.pose import Pose, PoseTrack, wrap


@pytest.mark.parametrize(
    ("angle", "expected"),
    [(0, 0), (np.pi, np.pi), (-np.pi, np.pi), (3 * np.pi / 2, -np.pi / 2), (7, 7 - 2 * np.pi)],
)
def test_wrap_stays_in_the_half_open_interval(angle, expected):
    """Angles are wrapped to (-pi, pi]."""
    assert wrap(angle) == pytest.approx(expected)


def test_pose_matrix_takes_base_coordinates_to_the_map():
    """The matrix rotates, then translates."""
    pose = Pose.from_euler(np.array([1.0, 2.0, 3.0]), 0.0, 0.0, np.pi / 2)
    assert pose.yaw == pytest.approx(np.pi / 2)
    np.testing.assert_allclose(pose.matrix @ [1, 0, 0, 1], [1, 3, 3, 1], atol=1e-12)


def test_track_interpolates_position_and_rotation():
    """Between two poses both are interpolated; outside they are clamped."""
    track = PoseTrack()
    quarter = Rotation.from_euler("z", 0.02).as_quat()
    track.append(0.0, np.zeros(3), np.array([0, 0, 0, 1.0]))
    track.append(0.1, np.array([1.0, 0, 0]), quarter)
    poses = track.at(np.array([-1.0, 0.05, 9.0]))
    np.testing.assert_allclose(poses[:, 0], [0.0, 0.5, 1.0])
    yaw = Rotation.from_quat(poses[:, 3:]).as_euler("ZYX")[:, 0]
    np.testing.assert_allclose(yaw, [0.0, 0.01, 0.02], atol=1e-7)


def test_track_takes_the_short_way_between_a_quaternion_and_its_negative():
    """A quaternion and its negative are the same rotation."""
    track = PoseTrack()
    track.append(0.0, np.zeros(3), np.array([0, 0, 0, 1.0]))
    track.append(1.0, np.zeros(3), np.array([0, 0, 0, -1.0]))
    np.testing.assert_allclose(np.abs(track.at(np.array([0.5]))[0, 6]), 1.0)


def test_track_keeps_the_newest_poses_when_it_is_full():
    """A full track drops the older half; each stamp of the other half keeps its own pose."""
    track = PoseTrack(capacity=8)
    for k in range(100):
        track.append(float(k), np.array([k, 0.0, 0.0]), np.array([0, 0, 0, 1.0]))
    assert (track.earliest, track.latest) == (92.0, 99.0)
    asked = np.array([92.0, 93.5, 95.5, 96.5, 98.0])
    np.testing.assert_allclose(track.at(asked)[:, 0], asked)


def test_track_refuses_a_stamp_that_does_not_increase():
    """A stamp that is not later than the last one is an error."""
    track = PoseTrack()
    track.append(1.0, np.zeros(3), np.array([0, 0, 0, 1.0]))
    with pytest.raises(ValueError, match=r"expected later than 1\.0 s"):
        track.append(1.0, np.zeros(3), np.array([0, 0, 0, 1.0]))


def test_a_rotated_track_is_that_of_a_mounted_sensor():
    """A rotated track has the same positions and turned orientations."""
    track = PoseTrack()
    for k in range(3):
        pose = Pose.from_euler(np.array([0.1 * k, 0.0, 0.0]), 0.0, 0.1, 0.2 * k)
        track.append(k / 10, pose.position, pose.quaternion)
    mount = Rotation.from_euler("ZYX", [0.5, 0.2, -0.1])
    rotated = track.rotated(mount).at(np.array([0.0, 0.1, 0.2]))
    poses = track.at(np.array([0.0, 0.1, 0.2]))
    np.testing.assert_allclose(rotated[:, :3], poses[:, :3])
    expected = Rotation.from_quat(poses[:, 3:]) * mount
    assert (Rotation.from_quat(rotated[:, 3:]) * expected.inv()).magnitude().max() < 1e-9


def test_extending_a_track_equals_appending_to_it():
    """Many poses at once give the same track as one at a time, beyond its capacity, too."""
    rng = np.random.default_rng(0)
    stamps = np.arange(1, 21) / 100
    positions, quaternions = rng.normal(size=(20, 3)), Rotation.random(20, rng=1).as_quat()
    one, many = PoseTrack(16), PoseTrack(16)
    for k in range(20):
        one.append(float(stamps[k]), positions[k], quaternions[k])
    for begin in range(0, 20, 5):
        rows = slice(begin, begin + 5)
        many.extend(np.column_stack([stamps, positions, quaternions])[rows])
    asked = np.array([0.155, 0.17, 0.2])
    np.testing.assert_array_equal(one.at(asked), many.at(asked))
    with pytest.raises(ValueError, match="expected increasing"):
        many.extend(np.column_stack([stamps, positions, quaternions])[:2])


def test_stamps_may_be_asked_in_any_order():
    """The search runs backwards as well: the order of the stamps changes nothing."""
    track = PoseTrack()
    for k in range(10):
        track.append(k / 10, np.array([k, 0.0, 0.0]), np.array([0, 0, 0, 1.0]))
    asked = np.array([0.85, 0.05, 0.45, 0.41, 0.9, 0.0])
    np.testing.assert_allclose(track.at(asked)[:, 0], asked * 10)


def test_an_empty_track_has_no_poses():
    """An empty track is an error to ask, and has no earliest or latest stamp."""
    track = PoseTrack()
    assert (track.earliest, track.latest) == (np.inf, -np.inf)
    with pytest.raises(ValueError, match="expected at least one pose"):
        track.at(np.zeros(1))


def test_euler_angles_are_scipys():
    """A pose from roll, pitch and yaw has scipy's quaternion and its own yaw."""
    pose = Pose.from_euler(np.zeros(3), 0.1, -0.2, 2.5)
    expected = Rotation.from_euler("ZYX", [2.5, -0.2, 0.1])
    assert (Rotation.from_quat(pose.quaternion) * expected.inv()).magnitude() < 1e-12
    assert pose.yaw == pytest.approx(2.5)
