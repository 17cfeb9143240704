"""Dead reckoning: exact without errors, off as stated with them, alike for both kinds of robots."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import Obstacles
from andabata.machine.planar.odometry import DeadReckoning, OdometryErrors, as_believed
from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.vehicle import PlanarVehicle, PlanarVehicleConfig

NOTHING = Obstacles(np.zeros((0, 4)), np.zeros((0, 3)), np.zeros((0, 4)))


def reckoned(errors, twist, steps, count=1, period=0.1, seed=0):
    """Return the poses of robots from (1, 2, 0) after periods of one twist."""
    robots, chosen = DeadReckoning(count, errors, period), np.ones(count, dtype=np.bool_)
    for k in range(count):
        robots.restart(k, np.array([1.0, 2.0, 0.0]), np.random.default_rng([seed, k]))
    for _ in range(steps):
        robots.step(np.tile(twist, (count, 1)), chosen)
    return robots.poses - [1.0, 2.0, 0.0]


def test_without_errors_it_is_the_truth():
    """A quarter of a circle of 2 m to the left, and 3 m straight on."""
    quarter = reckoned(OdometryErrors(), (np.pi / 2, np.pi / 4), 20)
    np.testing.assert_allclose(quarter, [[2.0, 2.0, np.pi / 2]], atol=1e-9)
    np.testing.assert_allclose(reckoned(OdometryErrors(), (1.0, 0.0), 30), [[3.0, 0.0, 0.0]])


def test_scale_is_one_of_the_drive_and_the_heading_walks():
    """After 10 m: 1 % of the way along, 0.005 rad a root metre of heading, and no bias."""
    poses = reckoned(OdometryErrors(0.01, 0.005, 0.0), (1.0, 0.0), 100, 1000)
    assert poses[:, 0].std() == pytest.approx(0.1, rel=0.1)
    assert poses[:, 2].std() == pytest.approx(0.005 * np.sqrt(10.0), rel=0.1)
    # Across it is the integral of the walk: the root of L^3 / 3.
    assert poses[:, 1].std() == pytest.approx(0.005 * np.sqrt(1000.0 / 3.0), rel=0.1)
    np.testing.assert_allclose(poses.mean(axis=0), [10.0, 0.0, 0.0], atol=0.012)


def test_slip_is_drawn_for_each_period():
    """Of 100 periods of 0.1 m with 5 % the root of the sum is 0.05 m, and of turns as many."""
    poses = reckoned(OdometryErrors(0.0, 0.0, 0.05), (1.0, 0.0), 100, 1000)
    assert poses[:, 0].std() == pytest.approx(0.05, rel=0.1)
    np.testing.assert_array_equal(poses[:, 1:], 0.0)
    turned = reckoned(OdometryErrors(0.0, 0.0, 0.05), (0.0, 0.2), 100, 1000)
    assert turned[:, 2].std() == pytest.approx(0.01, rel=0.1)
    np.testing.assert_array_equal(turned[:, :2], 0.0)


def test_errors_grow_by_their_factor_and_slip_averages():
    """Three times are three times; a period of four has half of the slip."""
    errors = OdometryErrors(0.01, 0.005, 0.03)
    np.testing.assert_allclose(errors.times(3.0), (0.03, 0.015, 0.09))
    np.testing.assert_allclose(errors.over(4.0), (0.01, 0.005, 0.015))


def test_both_kinds_of_robots_drift_alike():
    """Where a vehicle slips and where a robot's wheels do, odometry is off by as much."""
    config = PlanarVehicleConfig(
        delay=0.0, lag=0.0, acceleration=100, yaw_acceleration=1000, gain_spread=0.0
    )
    twist, off = Twist(1.0, 0.5), []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        robot = PlanarVehicle(config, PlanarPose(0.0, 0.0, 0.0), NOTHING, rng)
        for _ in range(100):
            robot.step(twist)
        off.append(np.subtract(robot.odometry, robot.pose))
    errors, motion = config.odometry_errors.over(0.1 / config.period), (twist.linear, twist.angular)
    others = reckoned(errors, motion, 50, 1000) - reckoned(OdometryErrors(), motion, 50)
    np.testing.assert_allclose(np.std(off, axis=0), others.std(axis=0), rtol=0.2)


def test_the_same_source_gives_the_same_bytes_and_others_stand():
    """Draws are those of each robot; what is not chosen keeps its pose and draws nothing."""
    errors = OdometryErrors(0.01, 0.005, 0.03)
    one, two = (reckoned(errors, (1.0, 0.3), 20, 3).tobytes() for _ in range(2))
    assert one == two
    robots = DeadReckoning(2, errors, 0.1)
    rngs = [np.random.default_rng(k) for k in range(2)]
    for k, rng in enumerate(rngs):
        robots.restart(k, np.zeros(3), rng)
    state = rngs[1].bit_generator.state
    robots.step(np.ones((2, 2)), np.array([True, False]))
    assert robots.poses[0, 0] > 0.05
    np.testing.assert_array_equal(robots.poses[1], 0.0)
    assert rngs[1].bit_generator.state == state


def test_places_are_seen_from_the_true_pose_as_believed():
    """What is 2 m ahead and 1 m to the left by belief is so by the truth; no turn, no change."""
    poses, believed = np.array([[1.0, 1.0, np.pi / 2]]), np.array([[5.0, 5.0, 0.0]])
    place = as_believed(np.array([[7.0, 6.0]]), poses, believed)
    np.testing.assert_allclose(place, [[0.0, 3.0]], atol=1e-12)
    np.testing.assert_allclose(as_believed(place, poses, poses), place)
