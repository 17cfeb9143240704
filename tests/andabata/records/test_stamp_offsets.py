"""Constant offsets between the stamps of gyro, compass and wheels."""

import re

import numpy as np
import pytest

from andabata.records import topics
from andabata.records.stamp_offsets import offset_remark, yaw_lag

FIELD = np.array([0.0, 26.0, -35.0])


def yaw(t):
    """Return the yaw of a winding drive [rad]."""
    return 0.7 * np.sin(0.6 * t) + 0.2 * np.sin(1.7 * t)


def drive(late=(0.0, 0.0, 0.0), seconds=30.0, noise=0.01, response=0.0, seed=0):
    """Return rows of IMU, compass and wheels with stamps that are late [s].

    The robot turns later than its wheels by its response [s]; the wheels' unit is not the gyro's.
    """
    rng, t = np.random.default_rng(seed), np.arange(0.0, seconds, 0.01)
    rates = np.gradient(yaw(t), 0.01)
    imu = np.zeros((len(t), 7))
    imu[:, 3], imu[:, 6] = rates + noise * rng.standard_normal(len(t)), 9.81
    angles = yaw(t) + noise * rng.standard_normal(len(t))
    sine, cosine = np.sin(angles), np.cos(angles)
    field = [cosine * FIELD[0] + sine * FIELD[1], cosine * FIELD[1] - sine * FIELD[0]]
    compass = np.column_stack([t, *field, np.full(len(t), FIELD[2])])
    turn = 3.0 * np.gradient(yaw(t + response), 0.01)
    wheels = np.column_stack([t, 2.0 - turn, 2.0 + turn])
    imu[:, 0] = t
    for rows, shift in zip((imu, compass, wheels), late, strict=True):
        rows[:, 0] += shift
    return imu, compass, wheels


def angles_of(shift=0.0, seconds=20.0, noise=0.0):
    """Return stamps and yaw angles."""
    t = np.arange(0.0, seconds, 0.02)
    extra = noise * np.random.default_rng(1).standard_normal(len(t))
    return np.column_stack([t + shift, yaw(t) + extra])


@pytest.mark.parametrize("shift", [-0.3, -0.089, 0.0, 0.013, 0.25])
def test_a_lag_is_found_between_the_steps(shift):
    """It is that of the stamps, positive where the first comes later, whatever the units."""
    lag = yaw_lag(angles_of(shift) * (1, -57.3), angles_of())
    assert lag.seconds == pytest.approx(shift, abs=0.002)
    assert lag.sigma < 0.002


def test_the_standard_deviation_is_that_of_the_lags():
    """Over drives with another noise of the compass each, lags spread by as much as it says."""
    lags = []
    for seed in range(20):
        _, compass, wheels = drive(seed=seed, noise=0.05)
        heading = np.unwrap(np.arctan2(compass[:, 1], compass[:, 2]))
        turned = np.column_stack([wheels[:, 0], np.cumsum(wheels[:, 2] - wheels[:, 1])])
        lags.append(yaw_lag(turned, np.column_stack([compass[:, 0], heading])))
    sigma = np.mean([lag.sigma for lag in lags])
    assert 0.6 * sigma < np.std([lag.seconds for lag in lags]) < 1.7 * sigma


def test_too_little_gives_no_lag():
    """No turn, a short drive, other turns, or a lag beyond those that are sought."""
    still = angles_of() * (1, 0)
    assert yaw_lag(still, angles_of()) is None
    assert yaw_lag(angles_of(seconds=6.0), angles_of(seconds=6.0)) is None
    other = np.column_stack([angles_of()[:, 0], np.cos(2.9 * angles_of()[:, 0])])
    assert yaw_lag(other, angles_of()) is None
    assert yaw_lag(angles_of(0.6), angles_of()) is None


def test_a_silence_is_left_out():
    """Angles are not interpolated over it."""
    rows, other = angles_of(0.1, seconds=40.0), angles_of(seconds=40.0)
    gone = (rows[:, 0] > 15) & (rows[:, 0] < 22)
    rows[rows[:, 0] > 15, 1] += 3.0
    assert yaw_lag(rows[~gone], other).seconds == pytest.approx(0.1, abs=0.002)
    for each in (rows, other):
        each[each[:, 0] > 15, 0] += 8 * 365 * 86400.0  # A clock that was set needs no memory.
    assert yaw_lag(rows[~gone], other).seconds == pytest.approx(0.1, abs=0.002)


@pytest.mark.parametrize(
    ("late", "response", "topic", "words"),
    [
        ((0.2, 0, 0), 0.0, topics.IMU, "stamps are 0.20 s late by the turns of compass and wheels"),
        ((-0.2, 0, 0), 0.1, topics.IMU, "stamps are 0.20 s early by the turns of compass and"),
        ((0, 0.2, 0), 0.0, topics.MAG, "stamps are 0.20 s late by the turns of gyro and wheels"),
        ((0, 0, 0.15), 0.0, topics.ENCODERS, "stamps are 0.15 s late by the turns of gyro and"),
        ((0, 0, -0.2), 0.0, topics.ENCODERS, "stamps are 0.20 s early by the turns of gyro and"),
        ((0.089, 0, 0), 0.0, topics.IMU, "turns come 0.09 s after those of /mag_orientation"),
        ((0.089, 0, 0), 0.08, topics.IMU, "stamps are 0.09 s late by the turns of compass and"),
        ((0, 0.3, -0.3), 0.0, topics.IMU, "each of the three has stamps of its own"),
    ],
)
def test_the_sensor_that_differs_from_both_others_is_named(late, response, topic, words):
    """Where the gyro is as late as a robot may be behind its wheels, two are named."""
    found = offset_remark(*drive(late, response=response))
    assert found is not None
    assert found[0] is topic
    assert words in found[1]


@pytest.mark.parametrize("late", [(0.2, 0, 0), (0, 0.2, 0), (0, 0, 0.2), (0.089, 0, 0)])
def test_the_advised_time_mends_it(late):
    """Each of the options that a remark names leads to stamps without a remark."""
    _, text = offset_remark(*drive(late))
    options = re.findall(r"--time-offset (\S+)=(\S+)", text)
    assert options
    for name, seconds in options:
        rows = dict(zip(("/imu", "/mag_orientation", "/encoder_data"), drive(late), strict=True))
        rows[name][:, 0] += float(seconds)
        assert offset_remark(*rows.values()) is None


@pytest.mark.parametrize("response", [0.0, 0.06, 0.1])
def test_a_robot_that_follows_its_wheels_is_sound(response):
    """It turns up to a tenth of a second later; so does a robot without turns or without noise."""
    assert offset_remark(*drive(response=response)) is None
    assert offset_remark(*drive((0.04, 0, 0))) is None
    assert offset_remark(*drive((0.2, 0, 0), seconds=5.0)) is None


def test_without_a_third_sensor_two_are_named():
    """Nothing says which of the two is late."""
    imu, compass, wheels = drive((0.2, 0, 0))
    for others, name in (((compass, None), "/mag_orientation"), ((None, wheels), "/encoder_data")):
        topic, text = offset_remark(imu, *others)
        assert topic is topics.IMU
        assert f"0.20 s after those of {name}: --time-offset /imu=-0.20 or" in text
        assert f"--time-offset {name}=0.20 shifts one" in text
