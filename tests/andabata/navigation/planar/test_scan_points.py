"""Points of a planar scan: the laser's mounting, ranges that met nothing, the robot's frame."""

import math

import numpy as np
import pytest

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose
from andabata.navigation.planar.scan_points import ScanPoints, in_robot_frame


def test_hits_are_where_beams_end_on_the_robot():
    """A laser 0.2 m ahead and 0.1 m aside that looks to the left."""
    lidar = PlanarLidarConfig(fov_deg=180, resolution_deg=90, max_range=5, x=0.2, y=0.1, yaw_deg=90)
    assert np.degrees(lidar.bearings).tolist() == pytest.approx([-90, 0, 90])
    hits = ScanPoints(lidar).hits(np.array([1.0, 2.0, 3.0], dtype=np.float32), 9.0)
    np.testing.assert_allclose(hits, [(1.2, 0.1), (0.2, 2.1), (-2.8, 0.1)], atol=1e-9)


def test_what_met_nothing_or_is_too_far_is_no_hit():
    """NaN, infinity, 0, less, the laser's largest range, and what lies beyond what counts."""
    lidar = PlanarLidarConfig(fov_deg=180, resolution_deg=30, max_range=4)
    ranges = np.array([np.nan, np.inf, 0.0, -1.0, 4.0, 3.0, 1.0], dtype=np.float32)
    points = ScanPoints(lidar)
    assert np.hypot(*points.hits(ranges, 9.0).T).tolist() == pytest.approx([3.0, 1.0])
    assert np.hypot(*points.hits(ranges, 3.0).T).tolist() == pytest.approx([1.0])
    assert points.hits(ranges, 0.5).shape == (0, 2)


def test_a_place_in_the_robots_frame():
    """Ahead of a robot that faces north is +x, to the east of it is its right."""
    robot = PlanarPose(1.0, 2.0, math.pi / 2)
    assert in_robot_frame((1.0, 5.0), robot) == pytest.approx((3.0, 0.0))
    assert in_robot_frame((2.0, 2.0), robot) == pytest.approx((0.0, -1.0))
