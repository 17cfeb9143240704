"""Poses of a sensor in the coordinates of its cloud."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.scanned_scenes import scene
from traversability.cloud import PointCloud
from traversability.viewpoint import Viewpoint

POSE = Viewpoint(np.array([700_005.0, 4e6, 300.0]), Rotation.from_euler("z", 90, degrees=True))


def test_points_are_seen_from_the_pose():
    """The inverse of the pose takes a map's points to the sensor's frame, far ones as well."""
    points = scene()
    far = POSE.rotation.apply(points) + POSE.position
    seen = POSE.seen_from(PointCloud.from_coordinates(far, "sensor"))
    np.testing.assert_allclose(seen.points, points, atol=2e-3)
    assert not seen.origin.any()


def test_the_numbers_are_pcds():
    """Position and quaternion stand in PCD's order."""
    assert POSE.numbers == pytest.approx((700_005, 4e6, 300, 0.5**0.5, 0, 0, 0.5**0.5))


def test_the_sensors_own_frame_is_no_pose():
    """Only a pose at the origin that turns nothing is the sensor's own frame."""
    here, straight = np.zeros(3), Rotation.identity()
    assert Viewpoint(here, straight).is_origin
    assert not Viewpoint(here, POSE.rotation).is_origin
    assert not Viewpoint(np.array([0, 0, 0.1]), straight).is_origin


def test_points_around_their_origin_contradict_a_pose_elsewhere():
    """A laser's returns are densest around it: that decides between two origins."""
    points = scene()
    pose = Viewpoint(np.array([5.0, 3.0, 0.7]), POSE.rotation)
    own = PointCloud(points.astype(np.float32), "sensor")
    there = PointCloud((pose.rotation.apply(points) + pose.position).astype(np.float32), "sensor")
    assert pose.contradicts(own)
    assert not pose.contradicts(there)
    assert not Viewpoint(np.array([0.2, 0, 0.7]), POSE.rotation).contradicts(own)


def test_a_map_whose_origin_is_among_its_points_is_seen_from_the_pose():
    """Points lie at a map's origin, but never at a sensor."""
    ahead = scene()[np.abs(scene()[:, 1]) < 2] * [0.5, 0.5, 0]
    camera = Viewpoint(np.array([9.0, 0.0, 1.0]), POSE.rotation)
    near = PointCloud(ahead.astype(np.float32) - ahead[0].astype(np.float32), "sensor")
    assert not camera.contradicts(near)
