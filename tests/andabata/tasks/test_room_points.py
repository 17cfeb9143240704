"""From beams to points: bearings and distances from the robot's centre, and windows."""

import numpy as np
import pytest

from andabata.machine.planar_lidar import PlanarLidarConfig
from andabata.tasks.room_batch import laser_arrays
from andabata.tasks.room_kernel import MIN_RANGE
from andabata.tasks.room_points import SECTORS, take_points


def observed(found, lidar, capacity):
    """Return points, mask and windows of one scan."""
    rows = np.full((1, 3 * capacity + SECTORS + 4), 7.0, dtype=np.float32)
    zeros = np.zeros(1, dtype=np.int64)
    take_points(found, np.ones(1, bool), laser_arrays([lidar]), zeros, capacity, rows)
    points = rows[0, : 2 * capacity].reshape(capacity, 2)
    mask, windows = np.split(rows[0, 2 * capacity : 3 * capacity + SECTORS], [capacity])
    assert (rows[0, 3 * capacity + SECTORS :] == 7.0).all()
    return points, mask, windows


@pytest.mark.parametrize(
    "label", ["360|0.5|5", "180|20|10|0.1|-0.08|35", "90|0.7|4|0|0.1|-170", "360|7.5|3|0|0|-340"]
)
def test_points_are_bearing_and_distance_from_the_robots_centre(label):
    """Each beam's end, seen from the robot's centre and heading, gives its point and window."""
    lidar, rng = PlanarLidarConfig.parse(label), np.random.default_rng(13)
    ranges = rng.uniform(0.3, lidar.max_range, (1, lidar.count))
    found = (1 / ranges).astype(np.float32)
    points, mask, windows = observed(found, lidar, lidar.count + 3)
    bearings = np.radians(lidar.yaw_deg) + lidar.bearings
    ends = np.stack([np.cos(bearings), np.sin(bearings)], axis=1) / found[0][:, None]
    ends += lidar.x, lidar.y
    distances, bearings = np.hypot(*ends.T), np.arctan2(ends[:, 1], ends[:, 0])
    expected = np.stack([np.sin(bearings), np.cos(bearings)], axis=1) / distances[:, None]
    np.testing.assert_allclose(points[:-3], expected, atol=2e-6)
    np.testing.assert_array_equal(points[-3:], 0.0)
    np.testing.assert_array_equal(mask, [1.0] * lidar.count + [0.0] * 3)
    nearest = np.full(SECTORS, 1.0 / lidar.max_range)
    # A bearing between two windows belongs to the second.
    sectors = np.floor((bearings + np.pi) * SECTORS / (2 * np.pi) + 1e-6).astype(int) % SECTORS
    np.maximum.at(nearest, sectors, 1.0 / distances)
    np.testing.assert_allclose(windows, nearest, rtol=1e-5)


def test_pooling_keeps_the_nearest_of_each_window_of_beams():
    """Nine beams of 1080 become one point: the nearest; a rest of a window counts as one."""
    found = np.random.default_rng(14).uniform(0.2, 4.0, (1, 1080)).astype(np.float32)
    points, mask, _ = observed(found, PlanarLidarConfig(), 120)
    near = np.hypot(*points.T)
    np.testing.assert_allclose(near, found.reshape(120, 9).max(axis=1), rtol=1e-6)
    beams = 9 * np.arange(120) + found.reshape(120, 9).argmax(axis=1)
    bearings = np.arctan2(*points.T)
    np.testing.assert_allclose(bearings, PlanarLidarConfig().bearings[beams], atol=1e-6)
    assert mask.all()
    points, mask, _ = observed(found, PlanarLidarConfig(), 100)
    assert mask.sum() == 99
    np.testing.assert_allclose(np.hypot(*points[98]), found[0, 98 * 11 :].max(), rtol=1e-6)


def test_windows_are_the_nearest_of_ten_degrees_from_behind_on():
    """A near beam shows in the window of its bearing alone; windows without beams are empty."""
    lidar = PlanarLidarConfig()
    for bearing in (-179.9, -95.0, 0.5, 44.0, 179.0):
        found = np.full((1, 1080), 0.2, dtype=np.float32)
        found[0, int((bearing + 180.0) * 3)] = 3.0
        windows = observed(found, lidar, 1080)[2]
        expected = np.full(SECTORS, 0.2)
        expected[int((bearing + 180.0) // 10)] = 3.0
        np.testing.assert_allclose(windows, expected, rtol=1e-6)
    ahead = PlanarLidarConfig(fov_deg=180, resolution_deg=1, max_range=10)
    windows = observed(np.full((1, 181), 2.0, dtype=np.float32), ahead, 181)[2]
    np.testing.assert_allclose(windows[9:27], 2.0, rtol=1e-6)
    np.testing.assert_allclose(np.delete(windows, slice(8, 28)), 0.1, rtol=1e-6)


def test_points_do_not_pass_the_smallest_range():
    """A laser before the robot's centre that sees backwards has no point inside the limit."""
    lidar = PlanarLidarConfig(fov_deg=360, resolution_deg=90, x=0.05)
    found = np.full((1, 4), 20.0, dtype=np.float32)
    points = observed(found, lidar, 4)[0]
    assert np.isfinite(points).all()
    assert np.hypot(*points.T).max() <= 1.0 / MIN_RANGE + 1e-3
