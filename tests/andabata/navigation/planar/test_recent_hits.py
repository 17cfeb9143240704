"""Hits around the robot: places, and memory where the laser is blind."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.navigation.planar.recent_hits import RecentHits, RecentHitsConfig

LIDAR = PlanarLidarConfig(fov_deg=270, resolution_deg=0.5, max_range=30, x=0.12)


def scan(pose, *places):
    """Return readings of a robot at a pose that sees some places in the frame of the odometry."""
    ranges = np.full(LIDAR.count, np.inf)
    x, y, yaw = pose
    for place in places:
        seen = (complex(*place) - complex(x, y)) * np.exp(-1j * yaw) - LIDAR.x
        beam = np.abs(LIDAR.bearings - np.angle(seen)).argmin()
        if np.abs(LIDAR.bearings[beam] - np.angle(seen)) < 0.01:
            ranges[beam] = abs(seen)
    return PlanarReadings(0.0, PlanarPose(*pose), Twist(0, 0), ranges.astype(np.float32))


def hits_after(config, *poses):
    """Return the hits after some poses beside a post at (0.4, 0.6)."""
    recent = RecentHits(config)
    recent.reset(LIDAR)
    for pose in poses:
        found = recent.update(scan(pose, (0.4, 0.6)))
    return found


def test_a_hit_is_where_it_was_measured():
    """In the robot's frame, once."""
    np.testing.assert_allclose(hits_after(None, (0, 0, 0)), [(0.4, 0.6)], atol=0.01)
    np.testing.assert_allclose(hits_after(None, (0, 0, 0), (0.2, 0, 0)), [(0.2, 0.6)], atol=0.01)


def test_what_was_driven_past_is_remembered():
    """Behind the robot, where the laser sees nothing, and after a turn as well."""
    found = hits_after(RecentHitsConfig(keyframe_stride=1), (0, 0, 0), (1.4, 0, 0))
    np.testing.assert_allclose(found, [(-1.0, 0.6)], atol=0.01)
    found = hits_after(RecentHitsConfig(keyframe_stride=1), (0, 0, 0), (0.9, 0.6, np.pi / 4))
    half = 0.5 / np.sqrt(2)
    np.testing.assert_allclose(found, [(-half, half)], atol=0.01)
    assert not len(hits_after(RecentHitsConfig(keyframes=0), (0, 0, 0), (1.4, 0, 0)))


def test_old_and_far_hits_are_forgotten():
    """Only so many scans, and only what was near."""
    config = RecentHitsConfig(keyframe_stride=1, keyframes=1)
    assert not len(hits_after(config, (0, 0, 0), (1.4, 0, 0), (1.6, 0, 0)))
    assert not len(hits_after(RecentHitsConfig(keyframe_range=0.5), (0, 0, 0), (1.4, 0, 0)))


@pytest.mark.parametrize("forget", [True, False])
def test_a_reset_forgets(forget):
    """A new drive begins without the last one's hits."""
    recent = RecentHits(RecentHitsConfig(keyframe_stride=1))
    recent.reset(LIDAR)
    recent.update(scan((0, 0, 0), (0.4, 0.6)))
    if forget:
        recent.reset(LIDAR)
    assert len(recent.update(scan((1.4, 0, 0)))) == (0 if forget else 1)
