"""Tracks of movers: circles alone are found, known velocities, coasting, no false motion."""

import numpy as np
import pytest

from andabata.navigation.planar.circle_tracks import (
    CircleTracks,
    CircleTracksConfig,
    circles_of,
)
from andabata.navigation.planar.hit_layer import LaserPose
from tests.support.mover_scans import LASER, PERIOD, RADIUS, Scanner, straight

FINE = LASER.model_copy(update={"resolution_deg": 0.25})


def follow(places, poses=None, config=None, lidar=LASER, noise=0.0):
    """Return what moves after scans of a circle at some places, None for away."""
    tracks, rng = CircleTracks(lidar, PERIOD, config), np.random.default_rng(0)
    scan, found = Scanner(lidar), None
    for k, place in enumerate(places):
        pose = (0.0, 0.0, 0.0) if poses is None else poses[k]
        ranges = scan(place, pose)
        found = tracks.update(LaserPose(*pose), ranges + noise * rng.standard_normal(len(ranges)))
    return found


@pytest.mark.parametrize("start", [(2.0, 1.0), (-2.0, 0.0), (1.0, -2.0)])
def test_a_mover_is_followed_exactly(start):
    """Without noise place, velocity and radius are its own, across the end of the scan, too."""
    velocity = (-0.3, 0.4)
    found = follow(straight(8, start, velocity))
    np.testing.assert_allclose(found.places, [straight(8, start, velocity)[-1]], atol=1e-4)
    np.testing.assert_allclose(found.velocities, [velocity], atol=1e-3)
    np.testing.assert_allclose(found.radii, [RADIUS], atol=1e-4)


def test_a_robot_that_moves_sees_the_same_motion():
    """Velocities are those in the frame of the poses, however the robot turns and drives."""
    poses = [(0.1 * k, 0.02 * k, 0.1 * k) for k in range(8)]
    found = follow(straight(8, (2.0, 1.0), (0.0, -0.5)), poses)
    np.testing.assert_allclose(found.velocities, [(0.0, -0.5)], atol=1e-3)


def test_what_stands_does_not_move_for_a_robot_that_does():
    """Neither walls, corners nor a post that stands become movers."""
    poses = [(0.1 * k, 0.0, 0.1 * k) for k in range(15)]
    assert not len(follow([(2.0, 1.5)] * 15, poses).radii)


def test_a_mover_counts_after_some_scans_and_coasts_for_a_few():
    """Hidden behind something it goes on as before; long unseen it is forgotten."""
    seen, config = (
        straight(6, (2.0, 0.0), (0.0, 0.5)),
        CircleTracksConfig(confirmation_scans=4, coasting_scans=3, passes=0.0, min_travel=0.0),
    )
    assert not len(follow(seen[:3], config=config).radii)
    assert len(follow(seen[:4], config=config).radii) == 1
    hidden = follow([*seen, None, None, None], config=config)
    np.testing.assert_allclose(hidden.places, [(2.0, 0.5 * PERIOD * 8)], atol=1e-3)
    assert not len(follow([*seen, None, None, None, None], config=config).radii)


@pytest.mark.parametrize("velocity", [(0.0, 0.5), (-0.5, 0.0), (0.5, 0.0), (0.0, -0.25)])
def test_a_mover_is_shown_by_the_beams_that_pass_it(velocity):
    """Across, towards and away: after 0.2 to 0.5 m, not before."""
    places = straight(20, (2.0, 0.0), velocity)
    first = next(k for k in range(1, 21) if len(follow(places[:k]).radii))
    assert 0.2 < (first - 1) * PERIOD * np.hypot(*velocity) < 0.5


def test_a_post_that_seems_to_move_is_no_mover():
    """Poses that slip by 0.3 m/s move the post in the map, but by no more than its hits lie deep.

    Without the memory of scans it would be followed as a mover.
    """
    wobble = [0.015 * (-1) ** (k // 3) for k in range(20)]
    poses = [(0.05 * k + slip, 0.0, 0.0) for k, slip in enumerate(wobble)]
    true = [(0.05 * k, 0.0, 0.0) for k in range(20)]

    def tracks(config):
        """Return how many tracks count in one of the scans."""
        following, scan = CircleTracks(LASER, PERIOD, config), Scanner()
        return sum(
            len(following.update(LaserPose(*believed), scan((2.0, 0.8), pose)).radii)
            for believed, pose in zip(poses, true, strict=True)
        )

    assert tracks(CircleTracksConfig(passes=0.0, min_travel=0.0)) > 0
    assert tracks(CircleTracksConfig(min_travel=0.0)) == 0


def test_a_mover_counts_once_it_has_gone_its_way():
    """From 0.19 m on, and at the place where it was first seen when it comes back."""
    config = CircleTracksConfig(confirmation_scans=4, passes=0.0, min_travel=0.19)
    there = straight(8, (2.0, 0.0), (0.0, 0.5))
    counts = [len(follow(there[:k], config=config).radii) for k in range(1, 9)]
    assert counts == [0, 0, 0, 0, 1, 1, 1, 1]
    back = straight(8, there[-1], (0.0, -0.5))[1:]
    assert len(follow(there + back, config=config).radii) == 1


def test_two_things_close_together_are_two():
    """A mover 12 cm before a wall keeps its circle."""
    near_wall = straight(10, (4.55, -1.0), (0.0, 0.5))
    assert len(follow(near_wall, lidar=FINE).radii) == 1


def test_a_mover_that_was_shown_is_believed_for_a_while():
    """Once it stands its speed falls, and it is none; on the way it need not be shown again."""
    config = CircleTracksConfig(memory=1.0, passes=0.2)
    moving = straight(8, (2.0, 0.0), (0.0, 0.5))
    assert len(follow([*moving, None, None], config=config).radii) == 1
    assert not len(follow([*moving, *[moving[-1]] * 8], config=config).radii)


def test_a_mover_that_turns_back_is_followed():
    """0.7 s after a bounce the velocity is the new one, within 0.05 m/s."""
    there = straight(8, (2.0, 0.0), (0.0, 0.5))
    found = follow(there + straight(8, there[-1], (0.0, -0.5))[1:])
    np.testing.assert_allclose(found.velocities, [(0.0, -0.5)], atol=0.05)


def test_noise_is_borne():
    """With 2 cm on each range the velocity is right within 0.15 m/s."""
    found = follow(straight(20, (1.5, -0.5), (0.0, 0.5)), noise=0.02)
    np.testing.assert_allclose(found.velocities, [(0.0, 0.5)], atol=0.15)


def test_the_pose_of_the_laser_counts():
    """A laser before the middle that looks back gives places in the robot's frame."""
    lidar = LASER.model_copy(update={"x": 0.5, "yaw_deg": 180.0})
    tracks, places = CircleTracks(lidar, PERIOD), straight(8, (2.0, 0.0), (0.0, 0.5))
    scan = Scanner(lidar)
    for place in places:
        found = tracks.update(LaserPose(), scan(place))
    np.testing.assert_allclose(found.places, [places[-1]], atol=1e-3)
    tracks.reset()
    assert not len(tracks.update(LaserPose(), scan(places[-1])).radii)


def test_a_scan_that_returned_nothing_has_no_circles():
    """Neither have beams without a number."""
    for silent in (10.0, np.nan, np.inf):
        assert not len(CircleTracks(LASER, PERIOD).update(LaserPose(), np.full(360, silent)).radii)


@pytest.mark.parametrize("second", [(2.0, 0.2), (1.85, 0.3), (2.15, 0.3)])
def test_two_round_things_that_meet_are_two_circles(second):
    """One in the other, side by side, the nearer one hiding a part of the other: cut there."""
    discs = np.array([(2.0, -0.2, 0.3), (*second, 0.3)])
    lidar = FINE
    ranges = np.full(lidar.count, 9.0)
    for x, y, radius in discs:
        along = np.cos(lidar.bearings) * x + np.sin(lidar.bearings) * y
        beside = radius**2 - (x * x + y * y - along**2)
        hit = (beside > 0) & (along > 0)
        ranges[hit] = np.minimum(ranges[hit], along[hit] - np.sqrt(beside[hit]))
    tracks = CircleTracks(lidar, PERIOD)
    found = circles_of(ranges, lidar.bearings, LaserPose(), tracks._fit)[:, :3]
    np.testing.assert_allclose(found[np.argsort(found[:, 1])], discs, atol=0.02)
