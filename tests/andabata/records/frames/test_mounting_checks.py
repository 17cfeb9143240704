"""Mountings against gravity, the magnetic field and the wheels."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.records.frames.mounting_checks import MountingChecks
from andabata.records.frames.names import FrameError
from tests.support.edited_bags import turn

UP = np.array([0.0, 0.0, 9.81])
MALAGA = [36.7, -4.4, 60.0, 1.0]


def checks_of(force=UP, field=None, fix=None):
    """Return checks with a second of equal measurements."""
    checks = MountingChecks()
    for _ in range(100):
        checks.add("imu", [0, 0, 0, *force])
        if field is not None:
            checks.add("compass", field)
    if fix is not None:
        checks.add("gnss", fix)
    return checks


@pytest.mark.parametrize(
    ("force", "words", "option"),
    [
        ((0, 0, -9.81), "gravity points down", "0,0,0,180,0"),
        ((0.9, -2.6, -9.3), "gravity points down", "0,0,0,180,0"),  # On a slope.
        ((0, 0, -1.0), "gravity points down", "0,0,0,180,0"),  # In g.
        ((9.81, 0, 0), "gravity points along x", "0,0,0,0,-90"),
        ((-9.81, 0, 0), "gravity points along -x", "0,0,0,0,90"),
        ((0, 9.81, 0), "gravity points along y", "0,0,0,90,0"),
        ((0, -9.81, 0), "gravity points along -y", "0,0,0,-90,0"),
    ],
)
def test_gravity_refuses_an_imu_that_is_mounted_otherwise(force, words, option):
    """The error names an option that turns the specific force up."""
    checks = checks_of(np.array(force, dtype=float))
    with pytest.raises(
        FrameError, match=f"{words} in the IMU's frame.*--mounting imu={option},YAW"
    ):
        checks.verify_gravity("base_link", "name", Rotation.identity())
    # The option that it names turns the force up.
    degrees = [float(word) for word in option.split(",")[3:]]
    level = turn((*degrees, 0)).apply(force)
    assert np.arccos(level[2] / np.linalg.norm(level)) < np.deg2rad(30)


def test_the_option_counts_from_the_raw_axes():
    """The option of an IMU that /tf_static turns wrongly applies to its own axes."""
    raw, wrong = np.array([0.0, 0.0, -9.81]), turn((0, 90, 0))
    checks = checks_of(wrong.apply(raw))
    with pytest.raises(FrameError, match=r"mounted as /tf_static says.*imu=0,0,0,180,0,YAW"):
        checks.verify_gravity("imu_link", "tf_static", wrong)


def test_slopes_are_accepted_and_steep_ones_remarked_on():
    """Leans under 60 degrees pass, over 30 with a remark, and few rows decide nothing."""
    gentle = checks_of(turn((0, 20, 0)).apply(UP))
    gentle.verify_gravity("base_link", "name", Rotation.identity())
    assert gentle.remarks == []
    steep = checks_of(turn((35, 0, 0)).apply(UP))
    steep.verify_gravity("base_link", "name", Rotation.identity())
    assert "gravity leans 35 degrees" in steep.remarks[0]
    few = MountingChecks()
    few.add("imu", [0, 0, 0, 0, 0, -9.81])
    few.verify_gravity("base_link", "name", Rotation.identity())


def test_without_gravity_nothing_is_refused():
    """A specific force without gravity passes with a remark."""
    checks = checks_of(np.array([0.1, -0.2, -0.1]))
    checks.verify_gravity("imu_link", "assumed", Rotation.identity())
    assert "expected a specific force with gravity" in checks.remarks[0]


@pytest.mark.parametrize(("latitude", "dip"), [(36.7, 52.0), (-33.9, -64.0), (69.0, 78.0)])
def test_the_field_dips_as_the_latitude_implies(latitude, dip):
    """A dip of the wrong sign is remarked on where the latitude is known."""
    down = np.deg2rad(dip)
    field = np.array([30 * np.cos(down), 0, -30 * np.sin(down)]) * 1e-6
    fix = [latitude, *MALAGA[1:]]
    assert checks_of(UP, field, fix).remarks == []
    assert checks_of(UP, field).remarks == []  # Nobody knows where.
    (text,) = checks_of(UP, turn((180, 0, 0)).apply(field), fix).remarks
    assert text.startswith(f"compass: the field points {abs(dip):.0f} degrees")
    assert "--mounting compass=" in text


def rows(rate, left, right):
    """Return rows of a yaw rate and of wheel speeds."""
    times = np.arange(10.0)[:, None] / 100
    imu = np.hstack([times, np.tile([0, 0, rate, 0, 0, 9.8], (10, 1))])
    return imu, np.hstack([times, np.tile([left, right], (10, 1))])


@pytest.mark.parametrize(("rate", "count"), [(0.3, 0), (-0.3, 1)])
def test_the_gyro_turns_as_the_wheels_do(rate, count):
    """Opposite signs are remarked on; straight periods decide nothing."""
    checks = MountingChecks()
    for _ in range(30):
        checks.compare(*rows(rate, 2.0, 4.0))
        checks.compare(*rows(-rate, 4.0, 2.0))
        checks.compare(*rows(5.0, 3.0, 3.0))  # Straight on tells nothing.
    assert len(checks.failures) == count
    checks.compare(None, None)


def test_a_drive_that_begins_anew_keeps_what_failed_before():
    """Times count from another instant: fixes are compared within one drive, once each."""
    checks = MountingChecks()
    for _ in range(2):
        for k in range(100):
            place = [k / 10, 36.7 + k * 1e-6, -4.4, 0.0, 0.01]
            speeds = np.array([[k / 10, 0.0]])
            checks.driving.add(
                np.array([[k / 10, 0, 0, 0.0, 0, 0, 9.8]]), speeds, None, np.array([place])
            )
        checks.restart()
        assert checks.driving.fit is None
        (text,) = checks.failures
        assert text.startswith("wheels: the fixes move by ")
