"""Transform from odom to the map: the robot's own place first, and whatever turns with it."""

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.navigation.planning.map_transform import MapTransform, transform_of


def pose_of(x: float, y: float, yaw: float) -> Pose:
    """Return a level pose."""
    quaternion = np.array([0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)])
    return Pose(np.array([x, y, 0.0]), quaternion)


def place_of(pose: Pose, ahead: float, aside: float) -> np.ndarray:
    """Return a place that a robot sees ahead and to its left [m], shape (2,)."""
    c, s = np.cos(pose.yaw), np.sin(pose.yaw)
    return pose.position[:2] + np.array([c * ahead - s * aside, s * ahead + c * aside])


@pytest.mark.parametrize(("yaw", "drifted"), [(0.0, 0.0), (0.4, 0.1), (-3.0, 3.0)])
def test_what_the_robot_sees_ahead_is_ahead_in_both(yaw: float, drifted: float) -> None:
    """Its own place, and a place 2 m ahead and 1 m to the left of it."""
    pose, odometry = pose_of(10.0, -4.0, yaw), pose_of(3.0, 2.0, drifted)
    places = [
        place_of(each, ahead, aside)
        for each in (odometry, pose)
        for ahead, aside in ((0.0, 0.0), (2.0, 1.0))
    ]
    there = transform_of(pose, odometry).to_map(np.array(places[:2]))
    np.testing.assert_allclose(there, places[2:], atol=1e-9)


def test_without_drift_places_are_the_same() -> None:
    """The default, and the transform of two equal poses."""
    places = np.array([[1.0, 2.0], [-3.0, 0.5]])
    pose = pose_of(5.0, 6.0, 0.7)
    for transform in (MapTransform(), transform_of(pose, pose)):
        np.testing.assert_allclose(transform.to_map(places), places, atol=1e-12)
