"""The ground in the first clouds against the mounting of the laser."""

import numpy as np
import pytest

from andabata.records.frames.ground_check import GroundCheck
from andabata.records.frames.names import FrameError
from tests.support.edited_bags import turn


def ground(height=0.0, tilt=(0, 0, 0), seed=0):
    """Flat ground around the robot with some posts, in the base frame."""
    rng = np.random.default_rng(seed)
    flat = np.column_stack([rng.uniform(-6, 6, (5000, 2)), rng.normal(0, 0.01, 5000)])
    posts = np.column_stack([rng.uniform(3, 3.2, (300, 2)), rng.uniform(0, 1.5, 300)])
    points = turn(tilt).apply(np.concatenate([flat, posts])) + np.array([0, 0, height])
    return points.astype(np.float32)


def checked(points, count=5, **options):
    """Return a check that has seen the same cloud several times."""
    check = GroundCheck(0.72, **options)
    for _ in range(count):
        check.add(points)
    return check


def test_ground_at_its_height_passes():
    """Small heights and tilts are no remark, and no cloud is none."""
    check = checked(ground(0.05, (0, 5, 0)))
    check.verify()
    assert check.remarks == []
    assert GroundCheck(0.72).remarks == []


def test_ground_below_and_above_is_remarked_on():
    """The remark has the side, the difference and the real height."""
    check = checked(ground(-0.4))
    check.verify()
    (text,) = check.remarks
    assert "the ground lies 0.4 m below where robot.lidar_height puts it" in text
    assert "m above it, not 0.72 m" in text
    (text,) = checked(ground(0.3)).remarks
    assert "0.3 m above where" in text


def test_ground_above_the_laser_is_refused():
    """A laser that hangs upside down, taken as upright, is an error after enough clouds."""
    points = ground()
    hanging = (points - [0, 0, 0.72]) * [1, -1, -1] + [0, 0, 0.72]
    check = checked(hanging.astype(np.float32))
    with pytest.raises(FrameError, match=r"the ground is above the laser.*laser=0,0,0\.72,180,0,0"):
        check.verify()
    assert "above the laser" in check.remarks[0]
    checked(hanging.astype(np.float32), 2).verify()  # Too few to say so.


def test_a_pitched_laser_differs_from_a_slope():
    """Only a tilt against the body is remarked on."""
    (text,) = checked(ground(0.0, (0, 16, 0))).remarks
    assert "leans 16 degrees against the robot" in text
    slope, check = turn((0, 16, 0)), GroundCheck(0.72)
    for _ in range(5):
        check.add(ground(0.0, (0, 16, 0)), slope)
    assert check.remarks == []
