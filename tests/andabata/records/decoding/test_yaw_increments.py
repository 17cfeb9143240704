"""Yaw increments: known turns by gyro, compass and wheels, and the slope between two of them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.robot import RobotModel
from andabata.records.decoding.yaw_increments import YawIncrements, fitted_slope

ROBOT = RobotModel()
RATE = 0.3
TIMES = np.arange(601) / 100


def turning(rotation=None, times=TIMES):
    """Return rows of IMU, compass and wheels of a constant left turn on level ground.

    Args:
        rotation: Mounting of IMU and compass, None for the robot's axes.
        times: Stamps [s].
    """
    ones = np.ones(len(times))
    gyro, force = np.outer(ones, [0, 0, RATE]), np.outer(ones, [0, 0, 9.81])
    yaw = RATE * times
    north = np.column_stack([20 * np.sin(yaw), 20 * np.cos(yaw), -40 * ones]) * 1e-6
    if rotation is not None:
        gyro, force, north = (rotation.apply(part) for part in (gyro, force, north))
    half = RATE * ROBOT.effective_track / 2 / ROBOT.wheel_radius
    wheels = np.column_stack([times, (3 - half) * ones, (3 + half) * ones])
    stamp = times[:, None]
    return np.hstack([stamp, gyro, force]), np.hstack([stamp, north]), wheels


@pytest.mark.parametrize(
    "rotation",
    [
        None,
        Rotation.from_euler("XY", [170, 60], degrees=True),
        Rotation.from_euler("Y", 90, degrees=True),
        Rotation.from_euler("X", -90, degrees=True),
    ],
)
def test_all_sensors_measure_the_same_turn(rotation):
    """A left turn is positive for all three, however IMU and compass are mounted together."""
    found = YawIncrements.from_rows(*turning(rotation), ROBOT)
    for increments in (found.gyro, found.compass, found.wheels):
        np.testing.assert_allclose(increments, np.full(5, RATE), atol=1e-9)


def test_missing_sensors_measure_zero():
    """Without compass and wheels the gyro's increments remain."""
    imu, _, _ = turning()
    found = YawIncrements.from_rows(imu, None, None, ROBOT)
    assert found.gyro == pytest.approx(RATE)
    assert not found.compass.any()
    assert not found.wheels.any()
    assert len(YawIncrements.from_rows(imu[:50], None, None, ROBOT).gyro) == 0


def test_without_gravity_the_vertical_is_the_z_axis():
    """A gyro along z still measures the turn."""
    imu, _, _ = turning()
    imu[:, 4:7] = np.nan
    assert YawIncrements.from_rows(imu, None, None, ROBOT).gyro == pytest.approx(RATE)


def test_windows_with_a_silence_are_left_out():
    """A sensor that is silent for over half a second ends a window before and begins one after."""
    imu, compass, wheels = turning()
    late = wheels[(wheels[:, 0] < 2.0) | (wheels[:, 0] > 2.8)]
    found = YawIncrements.from_rows(imu, compass, late, ROBOT)
    np.testing.assert_allclose(found.wheels, np.full(len(found.wheels), RATE), atol=1e-9)
    assert len(found.wheels) == 1 + 3


def test_factors_scale_gyro_and_wheels_alone():
    """The compass measures an angle and has no unit to scale."""
    found = YawIncrements(np.ones(2), np.ones(2), np.ones(2)).scaled(2.0, 3.0)
    assert (found.gyro[0], found.compass[0], found.wheels[0]) == (2.0, 1.0, 3.0)


def test_the_slope_is_that_of_the_second_over_the_first():
    """Half the turn is a slope of a half; too little, or too unlike, is none."""
    a = np.array([1.0, -2.0, 3.0])
    assert fitted_slope(a, a / 2, 0.3, 0.8) == pytest.approx(0.5)
    assert fitted_slope(a, -2 * a, 0.3, 0.8) == pytest.approx(-2.0)
    assert fitted_slope(a, a / 100, 0.3, 0.8) is None
    assert fitted_slope(a, np.array([3.0, 2.0, 1.0]), 0.3, 0.8) is None
    assert fitted_slope(np.zeros(3), a, 0.3, 0.8) is None
