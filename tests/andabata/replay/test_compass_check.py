"""Advice on a compass that contradicts gyro and fixes: right when followed, none on sound ones."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.geo_reference import GeoReference
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.replay.compass_check import CompassCheck

PLACE = GeoReference(declination_deg=4.0)
RADIUS, SPEED = 0.1, 0.5
NONE = Rotation.identity()


def turned(*angles):
    """Return a function that turns fields by roll, pitch, yaw [deg]."""
    return Rotation.from_euler("ZYX", angles[::-1], degrees=True).apply


def advice(change=lambda m: m, seconds=120, winding=2.0, fixes=True, mounting=NONE, unit=1.0):
    """Return the advice on a winding drive over hills whose fields are changed [uT]."""
    check, rng = CompassCheck(PLACE, RADIUS), np.random.default_rng(1)
    place, yaw = np.zeros(3), 0.4
    for k in range(10 * seconds):
        t = 0.1 * (k + 1)
        rate = winding * (0.06 * np.cos(0.06 * t) + 0.15 * np.sin(0.5 * t))
        yaw += 0.1 * rate
        pitch, roll = 0.1 * np.sin(0.3 * t), 0.1 * np.cos(0.2 * t)
        pose = Pose.from_euler(place.copy(), roll, pitch, yaw)
        place += 0.1 * SPEED * np.cos(pitch) * np.array([np.cos(yaw), np.sin(yaw), 0.0])
        # A rate about the vertical, seen from the tilted body; pitch and roll change slowly.
        gyro = Rotation.from_quat(pose.quaternion).apply([0.0, 0.0, rate], inverse=True)
        field = Rotation.from_quat(pose.quaternion).apply(PLACE.flux, inverse=True)
        field = change(field + rng.normal(0.0, 0.4, 3))
        geodetic = PLACE.to_geodetic(place[None])[0]
        readings = SensorReadings(
            t,
            imu=np.array([[t, *gyro, 0.0, 0.0, 9.81]]),
            mag=np.array([[t, *(1e-6 * np.asarray(field))]]),
            encoders=np.array([[t, SPEED / RADIUS, SPEED / RADIUS]]),
            gnss=np.array([[t, *geodetic, 0.25]]) if fixes and not k % 10 else None,
        )
        check.add(readings, pose)
    return check.advice(unit, mounting)


AXES = {
    "all signs": lambda m: -m,
    "upside down": turned(180, 0, 0),
    "on its side": turned(90, 0, 0),
    "on its nose, turned": turned(0, 90, 90),
    "one sign": lambda m: m * [1, -1, 1],
    "swapped axes": lambda m: m[[1, 0, 2]],
    "a quarter to the left": turned(0, 0, 90),
    "40 degrees to the right": turned(0, 0, -40),
}


def options(text):
    """Return the function of fields that the options of an advice stand for."""
    angles = re.search(r"--mounting compass=0,0,0,(\S+),(\S+),(\S+)", text)
    factor = re.search(r"--unit magnetic_field=(\S+)", text)
    turn = turned(*map(float, angles.groups())) if angles else (lambda m: m)
    return lambda m: turn(m * (float(factor.group(1)) if factor else 1.0))


@pytest.mark.parametrize("name", AXES)
def test_the_step_that_is_advised_makes_the_compass_sound(name):
    """Options of the advice, followed, give the robot's own field, and no advice any more."""
    spoil = AXES[name]
    text = advice(spoil)
    undo = options(text)
    field = np.array([20.0, 3.0, -34.0])
    assert undo(spoil(field)) == pytest.approx(field, abs=2.5)
    assert advice(lambda m: undo(spoil(m))) is None


def test_the_advice_counts_from_what_the_user_has_given():
    """A mounting and a unit that are given are in the options, which replace them."""
    text = advice(AXES["all signs"], mounting=Rotation.from_euler("Z", 30, degrees=True), unit=1e-6)
    assert "--mounting compass=0,0,0,0,0,30 --unit magnetic_field=-1e-06" in text


def test_without_fixes_the_yaw_of_a_mounting_is_the_users():
    """Gyro and gravity tell which side is up, not which is ahead."""
    text = advice(AXES["upside down"], fixes=False)
    assert "--mounting compass=0,0,0,180,0,0, with the YAW of your robot" in text
    assert advice(AXES["a quarter to the left"], fixes=False) is None


@pytest.mark.parametrize(
    "change",
    [
        lambda m: m,
        lambda m: m + np.array([3.0, -3.0, 5.0]),
        lambda m: m * np.array([1.08, 0.95, 1.0]),
        turned(2, -2, 8),
    ],
)
def test_there_is_no_advice_on_what_the_filter_copes_with(change):
    """A sound compass; iron of ten degrees; a mounting that is a little off."""
    assert advice(change) is None


def test_hard_iron_is_named_with_what_to_subtract():
    """Subtracted, it is gone."""
    text = advice(lambda m: m + np.array([12.0, -5.0, 0.0]))
    x, y = map(float, re.search(r"hard iron of \((\S+), (\S+)\) uT", text).groups())
    assert (x, y) == pytest.approx((12.0, -5.0), abs=1.0)
    assert advice(lambda m: m + np.array([12.0 - x, -5.0 - y, 0.0])) is None


def test_soft_iron_is_named():
    """Twice a turn."""
    assert "twice a turn" in advice(lambda m: m * np.array([1.3, 0.75, 1.0]))


def test_one_reading_over_a_turn_is_a_stuck_compass():
    """From the middle of the drive on."""
    seen = []

    def stick(field):
        seen.append(field)
        return seen[min(len(seen), 600) - 1]

    assert "repeats one reading" in advice(stick)


def test_a_short_or_straight_drive_is_no_ground_for_advice():
    """Whatever the compass says."""
    assert advice(AXES["all signs"], seconds=15) is None
    assert advice(AXES["one sign"], winding=0.0) is None


def test_periods_without_readings_are_passed_over():
    """And a recording without a compass has no advice."""
    check = CompassCheck(PLACE, RADIUS)
    for k in range(300):
        imu = np.array([[0.1 * k, 0.0, 0.0, 0.5, 0.0, 0.0, 9.81]]) if k % 2 else None
        readings = SimpleNamespace(imu=imu, mag=None, encoders=None, gnss=None)
        check.add(readings, Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0))
    assert check.advice(1.0, NONE) is None
