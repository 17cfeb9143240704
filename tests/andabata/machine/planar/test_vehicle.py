"""Dynamics of a robot on flat ground: delay, limits, lag, arcs, noise."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import Obstacles
from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.vehicle import (
    PLANAR_VEHICLES,
    DynamicsRanges,
    PlanarVehicle,
    PlanarVehicleConfig,
)

NOTHING = Obstacles(np.zeros((0, 4)), np.zeros((0, 3)), np.zeros((0, 4)))
EXACT = PlanarVehicleConfig(
    delay=0.0,
    lag=0.0,
    acceleration=100,
    yaw_acceleration=1000,
    gain_spread=0,
    slip=0,
    odometry_scale=0,
    odometry_turn=0,
)


def vehicle(config=EXACT, around=NOTHING, seed=0, start=(0.0, 0.0, 0.0), **settings):
    """Return a vehicle at rest."""
    config = config.model_copy(update=settings)
    return PlanarVehicle(config, PlanarPose(*start), around, np.random.default_rng(seed))


def speeds(robot, command, steps):
    """Return the body's speed after each step of one command."""
    found = []
    for _ in range(steps):
        robot.step(command)
        found.append(robot.velocity.linear)
    return found


@pytest.mark.parametrize(("delay", "steps"), [(0.0, 0), (0.05, 1), (0.10, 2), (0.15, 3)])
def test_commands_act_after_their_delay(delay, steps):
    """The robot stands for as many periods, then has its speed at once; it stops as late."""
    robot = vehicle(delay=delay)
    assert speeds(robot, Twist(1.0, 0.0), 5) == [0.0] * steps + [1.0] * (5 - steps)
    assert speeds(robot, Twist(0.0, 0.0), 5) == [1.0] * steps + [0.0] * (5 - steps)


@pytest.mark.parametrize(("delay", "way"), [(0.02, 0.03), (0.06, 0.04), (0.055, 0.04)])
def test_a_delay_may_end_within_a_period(delay, way):
    """The command acts for the rest of its period, by steps of a hundredth of a second."""
    robot = vehicle(delay=delay)
    speeds(robot, Twist(1.0, 0.0), 1 if delay < 0.05 else 2)
    assert robot.pose.x == pytest.approx(way)


def test_speed_grows_and_falls_with_the_acceleration():
    """3 m/s2 are 0.15 m/s a period, both ways; yaw rates have a limit of their own."""
    robot = vehicle(acceleration=3.0, yaw_acceleration=8.0)
    np.testing.assert_allclose(speeds(robot, Twist(0.4, 1.0), 3), [0.15, 0.3, 0.4])
    assert robot.velocity.angular == pytest.approx(1.0)
    np.testing.assert_allclose(speeds(robot, Twist(-0.1, 0.0), 4), [0.25, 0.1, -0.05, -0.1])
    robot = vehicle(acceleration=3.0, yaw_acceleration=8.0)
    robot.step(Twist(0.0, 3.0))
    assert robot.velocity.angular == pytest.approx(0.4)


def test_the_lag_is_of_first_order():
    """After one time constant 63 % of a step are there, after two 86 %."""
    found = speeds(vehicle(lag=0.25), Twist(1.0, 0.0), 10)
    np.testing.assert_allclose(found[4], 1 - np.exp(-1), rtol=1e-9)
    np.testing.assert_allclose(found[9], 1 - np.exp(-2), rtol=1e-9)


def test_the_wheels_limit_keeps_the_curvature():
    """|v| + 0.28 |w| stays below 2 m/s; within it nothing changes."""
    config = PlanarVehicleConfig()
    assert config.limited(Twist(1.0, 3.0)) == Twist(1.0, 3.0)
    limited = config.limited(Twist(2.0, -2.0))
    assert abs(limited.linear) + 0.28 * abs(limited.angular) == pytest.approx(2.0)
    assert limited.angular / limited.linear == pytest.approx(-1.0)
    assert config.limited(Twist(-9.0, 0.0)) == Twist(-2.0, 0.0)
    with pytest.raises(ValueError, match="finite twist"):
        config.limited(Twist(np.nan, 0.0))


def test_a_constant_command_drives_an_arc():
    """A quarter of a circle of 2 m, and straight on without a turn; odometry says the same."""
    robot = vehicle(period=0.1, start=(1.0, 2.0, np.pi / 4))
    speeds(robot, Twist(np.pi / 3, np.pi / 6), 30)
    np.testing.assert_allclose(robot.pose, [1.0, 2.0 + np.sqrt(8.0), 3 * np.pi / 4], atol=1e-9)
    np.testing.assert_allclose(robot.odometry, [2.0, 2.0, np.pi / 2], atol=1e-9)
    straight = vehicle()
    speeds(straight, Twist(1.0, 0.0), 20)
    np.testing.assert_allclose(straight.pose, [1.0, 0.0, 0.0], atol=1e-12)


def test_it_stays_where_it_first_touches():
    """The front of the box meets a circle 0.671 m ahead: within a step of integration."""
    around = NOTHING._replace(circles=np.array([[1.0, 0.0, 0.075]]))
    robot = vehicle(around=around)
    speeds(robot, Twist(1.0, 0.0), 20)
    assert robot.has_contact
    assert 0.671 <= robot.pose.x <= 0.671 + 0.01 + 1e-9
    inside = vehicle(around=around, start=(0.9, 0.0, 0.0))
    assert inside.has_contact


def test_gains_slip_and_odometry_spread_as_stated():
    """Means and spreads over drives: gains +-3 %, slip, odometry 1 % and 0.005 rad a root metre."""
    gains, ways, headings = [], [], []
    for seed in range(300):
        settings = {"gain_spread": 0.03, "odometry_scale": 0.01, "odometry_turn": 0.005}
        robot = vehicle(seed=seed, **settings)
        speeds(robot, Twist(1.0, 0.0), 80)
        gains.append(robot.velocity.linear)
        ways.append(np.hypot(*robot.odometry[:2]) / robot.pose.x)
        headings.append(robot.odometry.yaw)
    assert 0.97 <= min(gains) < 0.972
    assert 1.028 < max(gains) <= 1.03
    assert np.std(ways) == pytest.approx(0.01, rel=0.15)
    assert np.std(headings) == pytest.approx(0.005 * 2, rel=0.15)
    robot = vehicle(slip=0.03)
    seen = []
    for _ in range(400):
        before = robot.pose.x
        robot.step(Twist(1.0, 0.0))
        seen.append(robot.pose.x - before)
    assert np.std(seen) / 0.05 == pytest.approx(0.03, rel=0.15)
    assert robot.odometry.x == pytest.approx(20.0)


def test_the_same_seed_drives_the_same():
    """Every draw comes from the generator."""
    poses = []
    for _ in range(2):
        robot = vehicle(PLANAR_VEHICLES["barn-drawn"], seed=3)
        speeds(robot, Twist(1.0, 0.5), 30)
        poses.append(robot.pose)
    assert poses[0] == poses[1]


def test_dynamics_are_drawn_from_their_ranges():
    """Each drive has its own, within the ranges; a vehicle without ranges is itself."""
    config = PLANAR_VEHICLES["barn-drawn"]
    drawn = [config.drawn(np.random.default_rng(seed)) for seed in range(200)]
    for name in DynamicsRanges.model_fields:
        low, high = getattr(config.ranges, name)
        values = [getattr(each, name) for each in drawn]
        assert low <= min(values) < low + 0.05 * (high - low)
        assert high - 0.05 * (high - low) < max(values) <= high
    plain = PLANAR_VEHICLES["barn"]
    assert plain.drawn(np.random.default_rng(0)) is plain
    with pytest.raises(ValueError, match="lag: expected 0 <= least <= largest"):
        DynamicsRanges(delay=(0, 1), lag=(1, 0), acceleration=(1, 2), yaw_acceleration=(1, 2))


def test_the_presets_are_the_stated_ones():
    """Slow dynamics, and the outlines."""
    slow, plain = PLANAR_VEHICLES["barn-slow"], PLANAR_VEHICLES["barn"]
    assert (slow.acceleration, slow.lag, slow.delay_steps) == (1.5, 0.25, 15)
    assert plain.footprint[1] == (0.254, 0.215)
    assert PLANAR_VEHICLES["barn-hull"].footprint[1] == (0.229, 0.208)
    with pytest.raises(ValueError, match="convex outline"):
        PlanarVehicleConfig(footprint=plain.footprint[::-1])
