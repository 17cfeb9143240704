"""Skid-steer kinematics: known answers, limits and the dead zone."""

import numpy as np
import pytest

from andabata.machine.kinematics import SkidSteer, Twist, apply_dead_zone
from andabata.machine.robot import RobotModel

ROBOT = RobotModel()
KINEMATICS = SkidSteer(ROBOT)


def test_wheel_speeds_have_known_values():
    """Straight on, both wheels turn at v / r; a left turn makes the right one faster."""
    straight = KINEMATICS.wheel_speeds(0.3, 0.0)
    assert (straight.left, straight.right) == pytest.approx((3.0, 3.0))
    turning = KINEMATICS.wheel_speeds(0.0, 0.5)
    edge = 0.5 * ROBOT.slip_factor * ROBOT.track / 2 / ROBOT.wheel_radius
    assert (turning.left, turning.right) == pytest.approx((-edge, edge))


def test_direct_kinematics_inverts_the_inverse_one():
    """Twist to wheel speeds and back gives the same twist."""
    for speed, rate in ((0.3, 0.0), (0.3, 0.5), (0.0, -0.4), (-0.2, 0.1)):
        assert KINEMATICS.twist(KINEMATICS.wheel_speeds(speed, rate)) == pytest.approx(
            (speed, rate)
        )


@pytest.mark.parametrize(("speed", "rate"), [(10.0, 5.0), (2.0, -8.0), (-10.0, 3.0)])
def test_wheel_limits_keep_the_curvature(speed, rate):
    """Both sides are scaled down together: the faster wheel is at its limit, the arc the same."""
    wheels = KINEMATICS.wheel_speeds(speed, rate)
    assert max(abs(wheels.left), abs(wheels.right)) == pytest.approx(ROBOT.max_wheel_speed)
    driven, turned = KINEMATICS.twist(wheels)
    assert turned / driven == pytest.approx(rate / speed)
    assert driven * speed > 0


def test_within_the_limit_nothing_is_scaled():
    """Below the limit limited and unlimited speeds are the same; a measured twist has no limit."""
    assert KINEMATICS.wheel_speeds(0.5, 0.3) == KINEMATICS.unlimited_wheel_speeds(0.5, 0.3)
    assert KINEMATICS.unlimited_wheel_speeds(10.0, 0.0).left == pytest.approx(100.0)


@pytest.mark.parametrize("twist", [(np.nan, 0.0), (0.3, np.inf)])
def test_a_twist_that_is_not_finite_is_refused(twist):
    """A twist with a number that is not finite is an error."""
    with pytest.raises(ValueError, match="expected finite numbers"):
        KINEMATICS.wheel_speeds(*twist)


@pytest.mark.parametrize(
    ("action", "executed"),
    [(0.149, 0.0), (-0.149, 0.0), (0.15, 0.15), (-0.15, -0.15), (0.4, 0.4), (0.0, 0.0)],
)
def test_the_dead_zone_zeroes_small_commands_and_keeps_the_others(action, executed):
    """Commands smaller than the dead zone become zero, all others stay as they are."""
    assert apply_dead_zone(action, 0.15) == executed


def test_a_twist_is_a_value():
    """Twists of the same numbers are equal and cannot be changed."""
    assert Twist(0.3, 0.1) == Twist(linear=0.3, angular=0.1)
    with pytest.raises(AttributeError):
        Twist(0.3, 0.1).linear = 0.0
