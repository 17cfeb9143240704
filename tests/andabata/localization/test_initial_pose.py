"""Initial pose from gravity, the compass and a fix: known answers, and rows without a value."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.localization.initial_pose import initial_pose, levelled_field
from andabata.machine.geo_reference import GeoReference
from andabata.machine.sensor_readings import SensorReadings

REFERENCE = GeoReference(declination_deg=-9.5, inclination_deg=69.0, field=53.3)


def at_rest(roll=0.1, pitch=-0.2, yaw=1.0, place=(3.0, -2.0, 0.5), seconds=2.0, rate=50):
    """Return the noiseless readings of a robot at rest."""
    stamps = np.arange(1, int(seconds * rate) + 1) / rate
    turn = Rotation.from_euler("ZYX", [yaw, pitch, roll]).inv()
    force = np.tile(turn.apply([0, 0, 9.81]), (len(stamps), 1))
    field = np.tile(turn.apply(REFERENCE.flux) * 1e-6, (len(stamps), 1))
    fix = REFERENCE.to_geodetic(np.array([place]))[0]
    return SensorReadings(
        seconds,
        imu=np.column_stack([stamps, np.zeros((len(stamps), 3)), force]),
        mag=np.column_stack([stamps, field]),
        gnss=np.array([[seconds - 0.2, *fix, 0.5]]),
    )


@pytest.mark.parametrize("yaw", [-3.0, -0.7, 0.0, 1.0, 2.9])
def test_the_pose_at_rest_is_exact(yaw):
    """Position, tilt and heading of a robot at rest are those that its readings were made of."""
    pose = initial_pose(at_rest(yaw=yaw), REFERENCE)
    np.testing.assert_allclose(pose.position, [3.0, -2.0, 0.5], atol=1e-6)
    angles = Rotation.from_quat(pose.quaternion).as_euler("ZYX")
    np.testing.assert_allclose(angles, [yaw, -0.2, 0.1], atol=1e-6)


def test_a_declination_turns_the_heading():
    """Ten degrees more declination turn the heading by minus ten."""
    turned = REFERENCE.model_copy(update={"declination_deg": 0.5})
    first, second = (initial_pose(at_rest(), r) for r in (REFERENCE, turned))
    assert np.rad2deg(second.yaw - first.yaw) == pytest.approx(-10.0, abs=1e-6)


def test_readings_of_more_than_a_second_ago_do_not_count():
    """Only the last second of rows is averaged."""
    before, now = at_rest(yaw=-2.0, seconds=10.0), at_rest(yaw=1.0, seconds=2.0)
    readings = SensorReadings(
        12.0,
        imu=np.concatenate([before.imu, now.imu + np.array([10.0, *np.zeros(6)])]),
        mag=np.concatenate([before.mag, now.mag + np.array([10.0, *np.zeros(3)])]),
        gnss=now.gnss,
    )
    assert initial_pose(readings, REFERENCE).yaw == pytest.approx(1.0, abs=1e-6)


def test_a_fix_without_altitude_or_covariance_suffices():
    """Without an altitude the height is the datum's."""
    readings = at_rest()
    readings.gnss[0, 3:] = np.nan
    pose = initial_pose(readings, REFERENCE)
    np.testing.assert_allclose(pose.position, [3.0, -2.0, 0.0], atol=1e-3)


@pytest.mark.parametrize(
    ("name", "column", "value"),
    [("gnss", 4, np.inf), ("gnss", 1, 120.0), ("imu", 5, np.nan), ("mag", 2, np.nan)],
)
def test_a_sensor_without_valid_rows_gives_no_pose(name, column, value):
    """Without one of the three sensors there is no initial pose."""
    readings = at_rest()
    getattr(readings, name)[:, column] = value
    assert initial_pose(readings, REFERENCE) is None
    assert initial_pose(SensorReadings(1.0), REFERENCE) is None


def test_the_levelled_field_dips_as_at_the_place():
    """Turned level, the field has the horizontal and vertical parts of the place."""
    ahead, left, up = levelled_field(at_rest()) * 1e6
    assert np.hypot(ahead, left) == pytest.approx(np.hypot(*REFERENCE.flux[:2]))
    assert up == pytest.approx(REFERENCE.flux[2])


def test_the_lever_arm_of_the_antenna_is_removed():
    """A fix of an antenna ahead of the base gives the base's position behind it."""
    readings = at_rest(roll=0.0, pitch=0.0, yaw=np.pi / 2)
    moved = replace(readings, antenna=np.array([1.0, 0.2, 0.5]))
    plain, found = (initial_pose(r, REFERENCE).position for r in (readings, moved))
    np.testing.assert_allclose(found - plain, [0.2, -1.0, -0.5], atol=1e-6)
