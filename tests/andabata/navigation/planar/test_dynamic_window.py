"""Dynamic window: arcs, admissible speeds, and the three parts of the objective."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.clearance_field import body_discs, clearance_field
from andabata.navigation.planar.dynamic_window import (
    DynamicWindowConfig,
    DynamicWindowNavigator,
    _best,
    _pose,
    _way,
    _Weights,
    _window,
)

DISCS = body_discs(PLANAR_VEHICLES["barn"].footprint)
FRONT = max(x for x, _ in PLANAR_VEHICLES["barn"].footprint)
WEIGHTS = _Weights(
    heading=0.0,
    distance=0.0,
    speed=0.0,
    look=2.5,
    margin=0.0,
    margin_time=0.0,
    predict=0.5,
    max_speed=2.0,
    acceleration=1e6,
    yaw_acceleration=1e6,
)


def around(points=()):
    """Return the distances from points on the robot."""
    return clearance_field(np.array(points, dtype=float).reshape(-1, 2), (0.0, 0.0), 4.0, 0.02)


def wall(x):
    return [(x, y) for y in np.arange(-2.0, 2.0, 0.02)]


def best(speeds, turns, target=(5.0, 0.0), points=(), **changes):
    """Return the best pair of some speeds and yaw rates."""
    weights = WEIGHTS._replace(**changes)
    arrays = (np.array(each, dtype=float) for each in (speeds, turns, target))
    return _best(*arrays, DISCS, around(points), weights)


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (0.5, (0.25, 0.75)),
        (0.1, (0.0, 0.35)),
        (1.9, (1.65, 2.0)),
        (-1.0, (0.0, 0.0)),
        (3.0, (2, 2)),
    ],
)
def test_the_window_is_what_can_be_reached_within_the_limits(value, expected):
    """A reach of 0.25 to both sides, within 0 and 2; the nearest limit if nothing is in it."""
    assert _window(value, 0.25, 0.0, 2.0) == pytest.approx(expected)


def test_an_arc_of_a_quarter_circle():
    """At 1 m/s and a quarter turn a second: radius 2 / pi to the left, the chord in between."""
    radius = 2 / np.pi
    assert _pose(1.0, np.pi / 2, 1.0) == pytest.approx((radius, radius, np.pi / 2))
    assert _pose(1.0, -np.pi / 2, 1.0) == pytest.approx((radius, -radius, -np.pi / 2))
    assert _pose(0.7, 0.0, 2.0) == pytest.approx((1.4, 0.0, 0.0))


def test_the_way_ends_before_the_margin():
    """A wall 1 m before the bumper, with a margin of 0.2 m and more with speed."""
    field = around(wall(FRONT + 1.0))
    assert _way(0.5, 0.0, DISCS, field, WEIGHTS) == pytest.approx(1.0, abs=0.06)
    fast = WEIGHTS._replace(margin=0.2, margin_time=0.1)
    assert _way(1.0, 0.0, DISCS, field, fast) == pytest.approx(0.7, abs=0.06)
    assert _way(1.0, 0.0, DISCS, around(), WEIGHTS) == WEIGHTS.look


def test_a_turn_on_the_spot_sweeps_the_corners():
    """Something beside the nose stops a turn towards it; standing still is always free."""
    field, weights = around([(FRONT - 0.04, 0.25)]), WEIGHTS._replace(margin=0.03)
    assert _way(0.0, 1.0, DISCS, field, weights) < 0.2
    assert _way(0.0, 1.0, DISCS, around(), weights) == weights.look
    assert _way(0.0, 0.0, DISCS, field, weights) == weights.look


def test_speeds_from_which_it_could_not_stop_are_left_out():
    """v <= sqrt(2 a d): with 0.5 m of way and 1 m/s2, 1 m/s at most; without any pair (-1, 0)."""
    speeds, points = [0.0, 0.8, 1.2], wall(FRONT + 0.5)
    found = best(speeds, [0.0], points=points, speed=1.0, acceleration=1.0)
    assert found == (0.8, 0.0)
    assert best([1.2], [0.0], points=points, speed=1.0, acceleration=1.0) == (-1.0, 0.0)


def test_turns_from_which_it_could_not_stop_are_left_out():
    """w <= sqrt(2 a angle): the angle that is left of an arc is its way over its radius."""
    points = wall(FRONT + 0.25)
    common = {"points": points, "target": (0.0, 5.0), "heading": 1.0, "margin": 0.03}
    assert best([0.5], [0.2, 1.0], **common)[1] == 1.0
    assert best([0.5], [0.2, 1.0], yaw_acceleration=0.4, **common)[1] == 0.2


def test_each_weight_wants_its_own():
    """Heading: the turn to the target. Speed: the fastest. Distance: away from a wall."""
    turns = [-1.0, 0.0, 1.0]
    for target, turn in (((1.0, 2.0), 1.0), ((1.0, -2.0), -1.0), ((5.0, 0.0), 0.0)):
        assert best([0.5], turns, target, heading=1.0) == (0.5, turn)
    assert best([0.0, 0.5, 1.0], turns, speed=1.0)[0] == 1.0
    left = [(x, 0.8) for x in np.arange(0.0, 2.0, 0.02)]
    assert best([0.5], turns, points=left, distance=1.0)[1] <= 0.0
    assert best([0.5], [0.0, 1.0], points=left, distance=1.0)[1] == 0.0


def test_the_objective_weighs_shares():
    """A quarter turn off loses half of the heading, full speed wins all of the speed."""
    turn = np.pi / 2 / 0.5  # A quarter turn until the heading is judged.
    pairs = {"speeds": [0.0, 2.0], "turns": [turn]}
    # On the spot it faces the target behind its arc; driving, it is off by some angle.
    x, y, yaw = _pose(2.0, turn, 0.5)
    off = abs(np.arctan2(3.0 - y, -x) - yaw)
    assert 0.1 < off < np.pi / 2
    enough = off / np.pi  # What the heading loses is what the speed has to win.
    assert best(**pairs, target=(0.0, 3.0), heading=1.0, speed=0.95 * enough)[0] == 0.0
    assert best(**pairs, target=(0.0, 3.0), heading=1.0, speed=1.05 * enough)[0] == 2.0


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_without_an_admissible_pair_it_turns_on_the_spot_to_its_target(side):
    """Too fast before a wall: half of the fastest turn, to the side of the goal."""
    lidar = PlanarLidarConfig(fov_deg=180, resolution_deg=1, max_range=10)
    robot = DynamicWindowNavigator(
        PLANAR_VEHICLES["barn"], DynamicWindowConfig(map=None, max_yaw_rate=1.4)
    )
    robot.reset(lidar, (4.0, side))
    ranges = np.full(lidar.count, FRONT + 0.12, dtype=np.float32)
    at_speed = PlanarReadings(0.0, PlanarPose(0.0, 0.0, 0.0), Twist(2.0, 0.0), ranges)
    assert robot.act(at_speed) == Twist(0.0, side * 0.7)
