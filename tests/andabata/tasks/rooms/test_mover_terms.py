"""Tracked movers as observations: frame, order, mask; the tracker and not the truth fills them."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.navigation.mover_tracks import TrackedMovers
from andabata.navigation.planar.hit_layer import LaserPose
from andabata.navigation.planar.mover_shield import MoverShield
from andabata.tasks.rooms.mover_terms import SeenMovers, nearest_movers
from tests.support.mover_scans import LASER, PERIOD, RADIUS, Scanner, straight


def tracked(*movers):
    """Return movers of x, y, velocity in x and y, and radius."""
    rows = np.array(movers, dtype=np.float64).reshape(-1, 5)
    rest = np.zeros(len(rows))
    return TrackedMovers(rows[:, :2], rows[:, 2:4], rows[:, 4], rest, rest, rest)


def test_a_mover_is_in_the_frame_of_the_robot():
    """2 m to the left of a robot that heads north, going north, it is to the left, going ahead."""
    (row,) = nearest_movers(
        tracked((-1.0, 3.0, 0.0, 0.7, 0.3)), LaserPose(1.0, 3.0, np.pi / 2), count=1
    )
    assert row.dtype == np.float32
    np.testing.assert_allclose(row, [0.0, 0.5, 0.7, 0.0, 0.3, 1.0], atol=1e-7)


def test_velocities_are_over_ground():
    """Turned alone, a robot sees the same velocity from elsewhere, at the same distance."""
    mover = tracked((2.0, 1.0, 0.3, -0.4, 0.25))
    for yaw in (-2.0, 0.4, 3.0):
        (row,) = nearest_movers(mover, LaserPose(0.5, -1.0, yaw), count=1)
        turned = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        np.testing.assert_allclose(turned @ row[2:4], [0.3, -0.4], atol=1e-6)
        np.testing.assert_allclose(turned @ row[:2] * 2.5**2, [1.5, 2.0], rtol=1e-6)


def test_the_nearest_come_first_and_none_is_zero():
    """Edges count, not centres; more are left out, and rows without one are 0, mask included."""
    three = (
        (3.0, 0.0, 0.0, 0.0, 0.1),
        (0.0, 3.1, 0.0, 0.0, 0.5),
        (0.0, -2.0, 0.0, 0.0, 0.2),
    )
    rows = nearest_movers(tracked(*three), LaserPose(), count=2)
    np.testing.assert_allclose(rows[:, 4:], [[0.2, 1.0], [0.5, 1.0]])
    rows = nearest_movers(tracked(*three), LaserPose(), count=5)
    assert rows[:, 5].tolist() == [1.0, 1.0, 1.0, 0.0, 0.0]
    assert not rows[3:].any()
    assert not nearest_movers(TrackedMovers.none(), LaserPose(), count=3).any()
    # What the robot stands on has a finite place.
    assert np.isfinite(nearest_movers(tracked((0.0, 0.0, 0.0, 0.0, 0.2)), LaserPose(), 1)).all()


def seen_after(steps, seen, shields=(), number=1):
    """Let a robot of two that stands take scans of a mover that comes from ahead."""
    scan, pose = Scanner(), np.zeros(3)
    poses = np.zeros((2, 3))
    for place in straight(steps, (2.5, 0.1), (-0.8, 0.0)):
        reciprocals = (1.0 / scan(place, pose)).astype(np.float32)
        for shield in shields:
            shield.update(LaserPose(), 1.0 / reciprocals)
        seen.update([number], poses, reciprocals[None])
    return seen.rows.copy()


def test_movers_are_seen_once_they_are_tracked():
    """After one scan nothing is believed; after 1.5 s place, velocity and radius are near."""
    seen = SeenMovers(2, 3, LASER, PERIOD, ())
    assert not seen_after(1, seen).any()
    seen.restart(1)
    rows = seen_after(16, seen)
    assert not rows[0].any()
    assert rows[1, :, 5].tolist() == [1.0, 0.0, 0.0]
    ahead, _, vx, vy, radius, _ = rows[1, 0].tolist()
    assert 1.0 / ahead == pytest.approx(2.5 - 0.8 * 1.5, abs=0.05)
    assert (vx, vy) == pytest.approx((-0.8, 0.0), abs=0.1)
    assert radius == pytest.approx(RADIUS, abs=0.03)
    # Forgotten, the same mover has to be believed anew.
    seen.restart(1)
    assert not seen_after(1, seen)[1].any()


def test_a_shields_tracks_are_taken():
    """With shields there is no second tracker: the rows are the same as those of their movers."""
    shields = [MoverShield(LASER, 0.2, Twist(1.0, 1.0), PERIOD) for _ in range(2)]
    seen = SeenMovers(2, 3, LASER, PERIOD, shields)
    rows = seen_after(16, seen, shields)
    np.testing.assert_array_equal(rows[1], nearest_movers(shields[1].movers, LaserPose(), 3))
    np.testing.assert_array_equal(rows, seen_after(16, SeenMovers(2, 3, LASER, PERIOD, ())))
    assert rows[1].any()


def test_no_movers_are_tracked_where_none_are_observed():
    """Without the term nothing is kept of a scan."""
    assert seen_after(16, SeenMovers(2, 0, LASER, PERIOD, ())).shape == (2, 0, 6)
