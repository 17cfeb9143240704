"""Simulator: stamps, periods and reproducibility."""

import numpy as np
import pytest

from andabata.machine.clock import CONTROL_PERIOD, TICK_HZ, TICKS_PER_STEP
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
