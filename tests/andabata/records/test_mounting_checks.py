"""Gravity, the field, the wheels and the ground tell a mounting that cannot be."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.records.frames import FrameError
from andabata.records.mounting_checks import GroundCheck, MountingChecks
from tests.edited_bags import turn

UP = np.array([0.0, 0.0, 9.81])
MALAGA = [36.7, -4.4, 60.0, 1.0]


def checks_of(force=UP, field=None, fix=None):
    checks = MountingChecks()
    for _ in range(100):
        checks.take("imu", [0, 0, 0, *force])
        if field is not None:
            checks.take("compass", field)
    if fix is not None:
        checks.take("gnss", fix)
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
def test_gravity_refuses_an_imu_that_hangs_otherwise(force, words, option):
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
    """An IMU that /tf_static turns wrongly: what is said turns what it measures itself."""
    raw, wrong = np.array([0.0, 0.0, -9.81]), turn((0, 90, 0))
    checks = checks_of(wrong.apply(raw))
    with pytest.raises(FrameError, match=r"mounted as /tf_static says.*imu=0,0,0,180,0,YAW"):
        checks.verify_gravity("imu_link", "tf_static", wrong)


def test_slopes_are_no_reason_and_steep_ones_are_said():
    gentle = checks_of(turn((0, 20, 0)).apply(UP))
    gentle.verify_gravity("base_link", "name", Rotation.identity())
    assert gentle.remarks == []
    steep = checks_of(turn((35, 0, 0)).apply(UP))
    steep.verify_gravity("base_link", "name", Rotation.identity())
    assert "gravity leans 35 degrees" in steep.remarks[0]
    few = MountingChecks()
    few.take("imu", [0, 0, 0, 0, 0, -9.81])
    few.verify_gravity("base_link", "name", Rotation.identity())


def test_without_gravity_nothing_is_refused_and_it_is_said():
    checks = checks_of(np.array([0.1, -0.2, -0.1]))
    checks.verify_gravity("imu_link", "assumed", Rotation.identity())
    assert "expected a specific force that holds gravity" in checks.remarks[0]


@pytest.mark.parametrize(("latitude", "dip"), [(36.7, 52.0), (-33.9, -64.0), (69.0, 78.0)])
def test_the_field_dips_as_the_latitude_says(latitude, dip):
    down = np.deg2rad(dip)
    field = np.array([30 * np.cos(down), 0, -30 * np.sin(down)]) * 1e-6
    fix = [latitude, *MALAGA[1:]]
    assert checks_of(UP, field, fix).remarks == []
    assert checks_of(UP, field).remarks == []  # Nobody knows where.
    (said,) = checks_of(UP, turn((180, 0, 0)).apply(field), fix).remarks
    assert said.startswith(f"compass: the field points {abs(dip):.0f} degrees")
    assert "--mounting compass=" in said


def rows(rate, left, right):
    times = np.arange(10.0)[:, None] / 100
    imu = np.hstack([times, np.tile([0, 0, rate, 0, 0, 9.8], (10, 1))])
    return imu, np.hstack([times, np.tile([left, right], (10, 1))])


@pytest.mark.parametrize(("rate", "said"), [(0.3, 0), (-0.3, 1)])
def test_the_gyro_turns_as_the_wheels_do(rate, said):
    checks = MountingChecks()
    for _ in range(30):
        checks.compare(*rows(rate, 2.0, 4.0))
        checks.compare(*rows(-rate, 4.0, 2.0))
        checks.compare(*rows(5.0, 3.0, 3.0))  # Straight on tells nothing.
    assert len(checks.remarks) == said
    checks.compare(None, None)


def ground(height=0.0, tilt=(0, 0, 0), seed=0):
    """Flat ground around the robot with some posts, in the base frame."""
    rng = np.random.default_rng(seed)
    flat = np.column_stack([rng.uniform(-6, 6, (5000, 2)), rng.normal(0, 0.01, 5000)])
    posts = np.column_stack([rng.uniform(3, 3.2, (300, 2)), rng.uniform(0, 1.5, 300)])
    points = turn(tilt).apply(np.concatenate([flat, posts])) + np.array([0, 0, height])
    return points.astype(np.float32)


def looked_at(points, count=5, **options):
    check = GroundCheck(0.72, **options)
    for _ in range(count):
        check.look(points)
    return check


def test_ground_where_it_should_be_says_nothing():
    check = looked_at(ground(0.05, (0, 5, 0)))
    check.verify()
    assert check.remarks == []
    assert GroundCheck(0.72).remarks == []


def test_the_ground_below_and_above_is_said():
    check = looked_at(ground(-0.4))
    check.verify()
    (said,) = check.remarks
    assert "the ground lies 0.4 m below where robot.lidar_height puts it" in said
    assert "m above it, not 0.72 m" in said
    (said,) = looked_at(ground(0.3)).remarks
    assert "0.3 m above where" in said


def test_ground_above_the_laser_is_refused():
    """A laser that hangs upside down, taken as one that stands."""
    points = ground()
    hanging = (points - [0, 0, 0.72]) * [1, -1, -1] + [0, 0, 0.72]
    check = looked_at(hanging.astype(np.float32))
    with pytest.raises(FrameError, match=r"the ground is above the laser.*laser=0,0,0\.72,180,0,0"):
        check.verify()
    assert "above the laser" in check.remarks[0]
    looked_at(hanging.astype(np.float32), 2).verify()  # Too few to say so.


def test_a_pitched_laser_is_said_and_a_slope_is_not():
    (said,) = looked_at(ground(0.0, (0, 16, 0))).remarks
    assert "leans 16 degrees against the robot" in said
    slope, check = turn((0, 16, 0)), GroundCheck(0.72)
    for _ in range(5):
        check.look(ground(0.0, (0, 16, 0)), slope)
    assert check.remarks == []
