"""Laws of poses and of the track of poses."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.pose import Pose, PoseTrack, wrap


@pytest.mark.parametrize(
    ("angle", "expected"),
    [(0, 0), (np.pi, np.pi), (-np.pi, np.pi), (3 * np.pi / 2, -np.pi / 2), (7, 7 - 2 * np.pi)],
)
def test_wrap_stays_in_the_half_open_interval(angle, expected):
    assert wrap(angle) == pytest.approx(expected)


def test_pose_matrix_takes_base_coordinates_to_the_map():
    pose = Pose.from_euler(np.array([1.0, 2.0, 3.0]), 0.0, 0.0, np.pi / 2)
    assert pose.yaw == pytest.approx(np.pi / 2)
    np.testing.assert_allclose(pose.matrix @ [1, 0, 0, 1], [1, 3, 3, 1], atol=1e-12)


def test_track_interpolates_position_and_rotation():
    track = PoseTrack()
    quarter = Rotation.from_euler("z", 0.02).as_quat()
    track.append(0.0, np.zeros(3), np.array([0, 0, 0, 1.0]))
    track.append(0.1, np.array([1.0, 0, 0]), quarter)
    poses = track.at(np.array([-1.0, 0.05, 9.0]))
    np.testing.assert_allclose(poses[:, 0], [0.0, 0.5, 1.0])
    yaw = Rotation.from_quat(poses[:, 3:]).as_euler("ZYX")[:, 0]
    np.testing.assert_allclose(yaw, [0.0, 0.01, 0.02], atol=1e-7)


def test_track_takes_the_short_way_between_a_quaternion_and_its_negative():
    track = PoseTrack()
    track.append(0.0, np.zeros(3), np.array([0, 0, 0, 1.0]))
    track.append(1.0, np.zeros(3), np.array([0, 0, 0, -1.0]))
    np.testing.assert_allclose(np.abs(track.at(np.array([0.5]))[0, 6]), 1.0)


def test_track_keeps_the_newest_poses_when_it_is_full():
    track = PoseTrack(capacity=8)
    for k in range(100):
        track.append(float(k), np.array([k, 0.0, 0.0]), np.array([0, 0, 0, 1.0]))
    assert track.latest == 99.0
    np.testing.assert_allclose(track.at(np.array([96.5, 98.0]))[:, 0], [96.5, 98.0])


def test_track_refuses_a_stamp_that_does_not_grow():
    track = PoseTrack()
    track.append(1.0, np.zeros(3), np.array([0, 0, 0, 1.0]))
    with pytest.raises(ValueError, match=r"expected later than 1\.0 s"):
        track.append(1.0, np.zeros(3), np.array([0, 0, 0, 1.0]))


def test_a_turned_track_is_that_of_something_mounted_on_the_body():
    track = PoseTrack()
    for k in range(3):
        pose = Pose.from_euler(np.array([0.1 * k, 0.0, 0.0]), 0.0, 0.1, 0.2 * k)
        track.append(k / 10, pose.position, pose.quaternion)
    mount = Rotation.from_euler("ZYX", [0.5, 0.2, -0.1])
    turned = track.turned(mount).at(np.array([0.0, 0.1, 0.2]))
    poses = track.at(np.array([0.0, 0.1, 0.2]))
    np.testing.assert_allclose(turned[:, :3], poses[:, :3])
    expected = Rotation.from_quat(poses[:, 3:]) * mount
    assert (Rotation.from_quat(turned[:, 3:]) * expected.inv()).magnitude().max() < 1e-9
