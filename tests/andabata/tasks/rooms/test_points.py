"""From beams to points: bearings and distances from the robot's centre, and windows."""

import numpy as np
import pytest

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.tasks.rooms.batch import DiscRobotConfig, RoomBatch, laser_arrays
from andabata.tasks.rooms.kernel import MIN_RANGE
from andabata.tasks.rooms.points import (
    SECTORS,
    bearing_windows,
    take_earlier_windows,
    take_points,
    window_of,
)
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import free_places
from worlds.world import Start

MOUNTED = [
    PlanarLidarConfig(resolution_deg=1.0, max_range=6.0),
    PlanarLidarConfig(fov_deg=180, resolution_deg=0.5, max_range=10.0),
    PlanarLidarConfig(fov_deg=270, resolution_deg=1, max_range=8, x=0.1, y=-0.05, yaw_deg=20),
]


def observed(found, lidar, capacity):
    """Return points, mask and windows of one scan."""
    rows = np.full((1, 3 * capacity + SECTORS + 4), 7.0, dtype=np.float32)
    zeros = np.zeros(1, dtype=np.int64)
    lasers = laser_arrays([lidar])
    windows = bearing_windows(lasers)
    take_points(found, np.ones(1, bool), lasers, zeros, capacity, windows, rows)
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


def window_rows(found, lidar, size, fov_deg):
    """Return the windows of scans without any points, shape (n, size)."""
    rows = np.full((len(found), size), 7.0, dtype=np.float32)
    lasers, zeros = laser_arrays([lidar]), np.zeros(len(found), dtype=np.int64)
    windows = bearing_windows(lasers, size, np.radians(fov_deg))
    take_points(found, np.ones(len(found), bool), lasers, zeros, 0, windows, rows)
    return rows


@pytest.mark.parametrize(
    ("bearing", "size", "fov", "expected"),
    [
        (-180, 36, 360, 0),
        (-170.001, 36, 360, 0),
        (-170, 36, 360, 1),
        (179.9, 36, 360, 35),
        (180, 36, 360, 0),
        (190, 36, 360, 1),
        (-190, 36, 360, 35),
        (0, 20, 180, 10),
        (-90, 20, 180, 0),
        (90, 20, 180, 19),
        (90.01, 20, 180, -1),
        (-90.01, 20, 180, -1),
        (180, 20, 180, -1),
        (-271, 20, 180, 19),
        (269, 20, 180, -1),
        (275, 20, 180, 0),
    ],
)
def test_windows_lie_around_straight_ahead(bearing, size, fov, expected):
    """The first begins at the right, the last holds its upper edge, and there may be gaps."""
    assert window_of(np.radians(bearing), size, np.radians(fov), 1e-9) == expected


@pytest.mark.parametrize("lidar", MOUNTED, ids=lambda lidar: lidar.label)
def test_without_points_all_beams_count(lidar):
    """Windows alone are those beside as many points as beams; pooled beams would lose some."""
    found = np.random.default_rng(3).uniform(0.2, 4.0, (1, lidar.count)).astype(np.float32)
    windows = observed(found, lidar, lidar.count)[2]
    np.testing.assert_array_equal(window_rows(found, lidar, SECTORS, 360)[0], windows)


def test_front_windows_leave_out_what_is_behind():
    """Of beams all around twenty windows hold those of the front half, nine degrees each."""
    lidar = PlanarLidarConfig(resolution_deg=1.0)
    found = (1 / np.linspace(1.0, 4.0, 360, dtype=np.float32))[None]
    rows = window_rows(found, lidar, 20, 180)
    beams = found[0, 90:271]  # From -90 to 90 degrees.
    expected = [beams[9 * k : 9 * k + 9 + (k == 19)].max() for k in range(20)]
    np.testing.assert_array_equal(rows[0], np.maximum(expected, np.float32(0.2)))


def earlier_rows(found, then, now, lidar, size=SECTORS, fov_deg=360):
    """Return the windows of earlier scans from present poses, shape (n, size)."""
    rows = np.full((len(found), size), 7.0, dtype=np.float32)
    lasers, zeros = laser_arrays([lidar]), np.zeros(len(found), dtype=np.int64)
    windows = bearing_windows(lasers, size, np.radians(fov_deg))
    poses = np.array(then, dtype=np.float64), np.array(now, dtype=np.float64)
    take_earlier_windows(found, *poses, lasers, zeros, windows, rows)
    return rows


@pytest.mark.parametrize("lidar", MOUNTED, ids=lambda lidar: lidar.label)
@pytest.mark.parametrize(("size", "fov_deg"), [(36, 360), (40, 360), (20, 180)])
def test_a_robot_that_stands_sees_the_earlier_scan_as_the_present(lidar, size, fov_deg):
    """Wherever it stands, all windows are the same, those with beams at their edges too."""
    room, rng = make_room("spn-env3"), np.random.default_rng(4)
    places = rng.choice(free_places(room, 0.2, 0.3), 50)
    batch = RoomBatch(50, [room], DiscRobotConfig(), lidar)
    for k, (x, y) in enumerate(places):
        batch.place(k, 0, Start(x, y, rng.uniform(-np.pi, np.pi)))
    batch.observe(np.ones(50, bool))
    found, poses = batch.reciprocals, batch.poses
    rows = earlier_rows(found, poses, poses, lidar, size, fov_deg)
    np.testing.assert_allclose(rows, window_rows(found, lidar, size, fov_deg), rtol=2e-6)


def test_an_earlier_hit_is_seen_from_the_present_pose():
    """A post seen 2 m ahead is 1 m to the right, after 1 m ahead, 1 m left of it, turned by 30."""
    lidar = PlanarLidarConfig(resolution_deg=1.0, max_range=6.0)
    found = np.full((1, 360), 1 / 6, dtype=np.float32)
    found[0, 180] = 0.5
    then = [[1.0, 2.0, np.pi / 2]]  # The post is at (1, 4).
    now = [[0.0, 4.0, np.radians(30.0)]]
    expected = np.full(SECTORS, np.float32(1 / 6))
    expected[(180 - 30) // 10] = 1.0
    np.testing.assert_allclose(earlier_rows(found, then, now, lidar)[0], expected, rtol=1e-6)


def test_what_returned_nothing_is_left_out():
    """Beams at the largest range fill no window, however the robot has moved since."""
    lidar = PlanarLidarConfig(resolution_deg=1.0, max_range=6.0)
    found = np.full((1, 360), 1 / 6, dtype=np.float32)
    rows = earlier_rows(found, [[0.0, 0.0, 0.0]], [[3.0, 0.0, 1.0]], lidar)
    np.testing.assert_array_equal(rows, np.float32(1 / 6))


def test_what_stands_fills_earlier_and_present_windows_alike():
    """After a step of 0.1 m and 0.2 rad most windows agree to 2 %; without the motion they do not.

    The rest saw what only one of both poses sees, or another part of a wall.
    """
    lidar, room = PlanarLidarConfig(resolution_deg=0.25, max_range=10.0), make_room("spn-env2")
    rng = np.random.default_rng(5)
    batch = RoomBatch(60, [room], DiscRobotConfig(), lidar)
    for k, (x, y) in enumerate(rng.choice(free_places(room, 0.2, 0.5), 60)):
        batch.place(k, 0, Start(x, y, rng.uniform(-np.pi, np.pi)))
    everyone = np.ones(60, bool)
    batch.observe(everyone)
    found, then = batch.reciprocals.copy(), batch.poses.copy()
    batch.step(np.tile([0.5, 1.0], (60, 1)), everyone)
    present = window_rows(batch.reciprocals, lidar, 40, 360)
    moved = earlier_rows(found, then, batch.poses, lidar, 40)
    held = window_rows(found, lidar, 40, 360)
    agree, disagree = (np.mean(np.abs(rows / present - 1) < 0.02) for rows in (moved, held))
    assert agree > 0.9
    assert disagree < 0.6
