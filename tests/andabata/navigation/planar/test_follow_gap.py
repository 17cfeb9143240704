"""Follow the gap: which gap, how much of it, and how fast."""

import math

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.follow_gap import FollowGapConfig, FollowGapNavigator

LIDAR = PlanarLidarConfig(fov_deg=360, resolution_deg=1.0, max_range=30)
DEGREES = np.round(np.degrees(LIDAR.bearings)).astype(int)
WIDE = {"gain": 1.0, "max_yaw_rate": 9.0}


def navigator(goal, **settings):
    found = FollowGapNavigator(PLANAR_VEHICLES["barn"], FollowGapConfig(**settings))
    found.reset(LIDAR, goal)
    return found


def scan(ranges):
    """Return readings at the origin with ranges of some bearings in degrees."""
    found = np.full(LIDAR.count, np.inf, dtype=np.float32)
    for (low, high), value in ranges.items():
        found[(low <= DEGREES) & (high >= DEGREES)] = value
    return PlanarReadings(0.0, PlanarPose(0.0, 0.0, 0.0), Twist(0.0, 0.0), found)


def test_the_heading_is_the_mean_of_gap_and_goal_by_the_nearest_distance():
    """Equation 16: alpha over the distance weighs the gap, 1 the goal."""
    # A wall from straight ahead to the right, a post of it 1 m away.
    near = scan({(-90, 10): 1.0})
    goal = (20.0, 0.0)
    gap = navigator(goal, alpha=1e9, **WIDE).act(near).angular
    mixed = navigator(goal, alpha=3.0, **WIDE).act(near).angular
    assert gap > 0.5
    assert mixed == pytest.approx(3.0 / 4.0 * gap, rel=1e-3)
    far = scan({(-90, 10): 1.4})
    gap = navigator(goal, alpha=1e9, **WIDE).act(far).angular
    weight = 3.0 / 1.4
    expected = weight / (weight + 1.0) * gap
    assert navigator(goal, alpha=3.0, **WIDE).act(far).angular == pytest.approx(expected, rel=1e-3)


def test_the_widest_gap_counts_or_one_nearer_to_the_goal():
    """A wide gap to the right, a narrow one to the left, where the goal is."""
    two = scan({(-20, 20): 1.0, (70, 90): 1.0})
    goal = (5.0, 5.0)
    assert navigator(goal, to_goal=0.0, alpha=1e9, **WIDE).act(two).angular < 0.0
    assert navigator(goal, to_goal=2.0, alpha=1e9, **WIDE).act(two).angular > 0.0


def test_obstacles_are_widened():
    """Between posts 0.8 m apart there is a gap for a radius of 0.3 m, for 0.45 m there is none."""
    half = round(math.degrees(math.asin(0.4 / 1.0)))
    posts = scan({(-90, -half): 1.0, (half, 90): 1.0})
    assert navigator((9.0, 0.0), radius=0.3, **WIDE).act(posts).linear > 0.0
    assert navigator((9.0, 0.0), radius=0.45, **WIDE).act(posts).linear == 0.0


def test_closed_in_it_turns_one_way_until_there_is_a_gap():
    """The goal may pass behind the robot meanwhile: the side of the first turn stays."""
    closed = scan({(-180, 180): 0.8})
    robot = navigator((-1.0, 5.0), max_yaw_rate=2.0)
    first = robot.act(closed)
    assert (first.linear, first.angular) == (0.0, 1.0)
    turned = PlanarReadings(0.1, PlanarPose(0.0, 0.0, 3.0), Twist(0.0, 1.0), closed.ranges)
    assert robot.act(turned).angular == 1.0
    robot.reset(LIDAR, (-1.0, -5.0))
    assert robot.act(closed).angular == -1.0


@pytest.mark.parametrize(
    ("distance", "speed"), [(0.3, 0.15), (0.35, 0.15), (0.925, 0.5), (1.49, 0.99)]
)
def test_the_speed_grows_with_the_free_way_ahead(distance, speed):
    """From ``creep`` where it is short to the largest where it is long, along its heading."""
    robot = navigator((9.0, 0.0), max_speed=1.0, creep=0.15, stop=0.35, slow=1.5)
    free = robot._free_way(np.array([[distance, 0.1]]), 0.0)
    assert free == pytest.approx(distance)
    assert robot._steer(0.0, free).linear == pytest.approx(speed, abs=0.01)


def test_the_free_way_is_of_a_strip_as_wide_as_the_robot():
    """What is beside it or behind it does not count; along a turned heading other things do."""
    robot = navigator((9.0, 0.0))
    side = max(y for _, y in PLANAR_VEHICLES["barn"].footprint) + 0.05
    hits = np.array([[1.0, side + 0.01], [0.5, -side - 0.01], [-0.4, 0.0]])
    assert robot._free_way(hits, 0.0) == math.inf
    assert robot._free_way(hits, math.atan2(side, 1.0)) == pytest.approx(
        math.hypot(1.0, side), abs=0.02
    )


def test_it_turns_by_the_gain_within_its_limit_and_slows_for_the_turn():
    """Twice the gain beyond the limit; the cosine of the heading, never backwards."""
    robot = navigator((9.0, 0.0), gain=2.0, max_yaw_rate=1.5, max_speed=1.0)
    assert robot._steer(0.5, math.inf).angular == 1.0
    assert robot._steer(-2.0, math.inf) == Twist(0.0, -1.5)
    assert robot._steer(0.5, math.inf).linear == pytest.approx(math.cos(0.5))


def test_what_stands_behind_the_goal_is_in_nobodys_way():
    """A wall 1 m ahead, the goal 0.5 m ahead of it or behind it."""
    wall = scan({(-40, 40): 1.0})
    assert navigator((0.5, 0.0), **WIDE).act(wall).angular == pytest.approx(0.0)
    assert abs(navigator((1.5, 0.0), **WIDE).act(wall).angular) > 0.1
