"""Simulator: stamps, periods and reproducibility."""

import numpy as np
import pytest

from andabata.machine.clock import CONTROL_PERIOD, TICK_HZ, TICKS_PER_STEP
from andabata.machine.reality import LEVELS, TrueConstants
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.machine.simulator import SensingConfig, Simulator
from worlds.world import Start

FORWARD = WheelSpeeds(3.0, 3.0)


def simulator(scene, seed=0, **sensing):
    """Return a simulator with the kinematic plant."""
    rng = np.random.default_rng(seed)
    config = SensingConfig(**sensing)
    return Simulator(scene.world, scene.rays, RobotModel(), "kinematic", config, rng)


def test_stamps_are_ticks_divided_by_their_rate(make_scene):
    """Every row carries tick / TICK_HZ, from one tick after the last period to its end."""
    robot = simulator(make_scene(), scanner="horizontal")
    first = robot.reset(Start(0.0, 0.0, 0.0))
    assert first.stamp == 0.0
    assert first.imu is None
    for step in range(1, 4):
        readings = robot.step(FORWARD)
        ticks = np.arange((step - 1) * TICKS_PER_STEP + 1, step * TICKS_PER_STEP + 1)
        assert readings.stamp == step * TICKS_PER_STEP / TICK_HZ
        for rows in (readings.imu, readings.encoders, readings.mag, readings.true_track):
            np.testing.assert_array_equal(rows[:, 0], ticks / TICK_HZ)


def test_the_truth_is_the_last_row_of_the_true_track(make_scene):
    """The state at the end of the period and the track agree."""
    robot = simulator(make_scene(), scanner="horizontal")
    robot.reset(Start(0.0, 0.0, 0.3))
    readings = robot.step(FORWARD)
    assert readings.truth.stamp == readings.stamp
    np.testing.assert_array_equal(readings.true_track[-1, 1:4], readings.truth.pose.position)


def test_past_sweeps_equal_those_of_the_period_but_for_noise(make_scene):
    """Sweeps of a skipped period can be computed later, with the same stamps."""
    scene = make_scene()
    robot = simulator(scene)
    robot.reset(Start(0.0, 0.0, 0.0))
    scanned = robot.step(FORWARD).sweeps
    skipped = robot.step(FORWARD, skip_scan=True)
    assert skipped.sweeps is None
    again = robot.sweeps(0.0, CONTROL_PERIOD)
    np.testing.assert_array_equal(scanned.stamps, again.stamps)
    np.testing.assert_array_equal(scanned.head_angles, again.head_angles)
    assert len(again.stamps) == 4


def test_the_same_seed_gives_the_same_readings_and_another_reset_others(make_scene):
    """Readings are a function of the seed and of the number of resets."""
    scene = make_scene()
    one, two = (simulator(scene, seed=3, scanner="horizontal") for _ in range(2))
    drives = []
    for robot in (one, two, one):
        robot.reset(Start(0.0, 0.0, 0.0))
        drives.append(np.concatenate([robot.step(FORWARD).imu for _ in range(3)]))
    np.testing.assert_array_equal(drives[0], drives[1])
    assert not np.array_equal(drives[0], drives[2])


def test_sweeps_of_the_horizontal_scanner_are_an_error(make_scene):
    """Only the rotating laser has vertical sweeps."""
    robot = simulator(make_scene(), scanner="horizontal")
    with pytest.raises(ValueError, match="expected rotating, got horizontal"):
        robot.sweeps(0.0, 1.0)


def test_without_proprioception_there_is_none(make_scene):
    """A robot without proprioceptive sensors has readings of the scanner alone."""
    robot = simulator(make_scene(), scanner="horizontal", proprioception=None)
    robot.reset(Start(0.0, 0.0, 0.0))
    readings = robot.step(FORWARD)
    assert readings.imu is None
    assert readings.gnss is None
    assert readings.horizontal is not None


def mean_speeds(make_scene, **constants):
    """Return the body's true mean speed [m/s] and the encoders' [rad/s] in the second second."""
    robot = simulator(make_scene(), scanner="horizontal")
    robot.reset(Start(0.0, 0.0, 0.0), TrueConstants(**constants))
    readings = [robot.step(FORWARD) for _ in range(20)][10:]
    track = np.concatenate([one.true_track for one in readings])
    way = float(np.hypot(*(track[-1] - track[0])[1:3])) / (track[-1, 0] - track[0, 0])
    return way, np.concatenate([one.encoders for one in readings])[:, 1:].mean()


def test_larger_wheels_drive_further_than_the_encoders_say(make_scene):
    """With a radius 3 % larger the body is 3 % faster at the same speed of the wheels."""
    (true, turned), (faster, same) = (
        mean_speeds(make_scene),
        mean_speeds(make_scene, wheel_radius=0.03),
    )
    assert faster / true == pytest.approx(1.03, abs=1e-3)
    assert same == pytest.approx(turned, abs=2e-3)


def test_commands_act_late(make_scene):
    """With 200 ms of latency the wheels stand for two periods."""
    robot = simulator(make_scene(), scanner="horizontal")
    robot.reset(Start(0.0, 0.0, 0.0), TrueConstants(latency=0.2))
    speeds = [robot.step(FORWARD).encoders[:, 1].mean() for _ in range(4)]
    np.testing.assert_allclose(speeds, [0, 0, 3, 3], atol=0.1)


def test_a_leaning_mast_leans_the_cloud(make_scene):
    """A laser that is pitched down by 0.05 rad sees the ground ahead nearer, behind further."""
    level, leaning = (simulator(make_scene()) for _ in range(2))
    level.reset(Start(0.0, 0.0, 0.0))
    leaning.reset(Start(0.0, 0.0, 0.0), TrueConstants(laser_tilt=(0.0, 0.05)))
    one, two = (robot.step(WheelSpeeds(0.0, 0.0)).sweeps for robot in (level, leaning))
    both = np.isfinite(one.ranges[0]) & np.isfinite(two.ranges[0])
    ahead, behind = both & (one.elevations > 1.8), both & (one.elevations < -1.8)
    assert (one.ranges[0, ahead] - two.ranges[0, ahead]).mean() > 0.05
    assert (one.ranges[0, behind] - two.ranges[0, behind]).mean() < -0.05


def test_the_horizontal_scanner_and_the_truth_have_no_mounting_errors(make_scene):
    """True poses are the body's, not those of its laser."""
    constants = LEVELS["harsh"].draw(np.random.default_rng(0))
    robot = simulator(make_scene(), scanner="horizontal")
    robot.reset(Start(0.0, 0.0, 0.3), constants)
    readings = robot.step(FORWARD)
    np.testing.assert_array_equal(readings.true_track[-1, 4:], readings.truth.pose.quaternion)
    assert np.abs(readings.true_track[:, 4:6]).max() < 1e-9
