"""Wheels and their sides by the names of joints."""

import pytest

from andabata.records.decoding.unusable_message import UnusableMessageError
from andabata.records.decoding.wheel_joints import wheel_sides


@pytest.mark.parametrize(
    ("left", "right"),
    [
        ("front_left_wheel", "front_right_wheel"),
        ("left_front_wheel_joint", "right_front_wheel_joint"),
        ("wheel_left_joint", "wheel_right_joint"),
        ("fl_wheel", "fr_wheel"),
        ("wheel_rl", "wheel_rr"),
        ("FrontLeftWheel", "FrontRightWheel"),
        ("wheelFL", "wheelFR"),
        ("leftwheel", "rightwheel"),
        ("drivewhl_l_joint", "drivewhl_r_joint"),
        ("rear_left", "rear_right"),
        ("lf", "rf"),
        ("left_track", "right_track"),
        ("joint_wheel_1_left", "joint_wheel_1_right"),
    ],
)
def test_wheels_are_found_in_every_spelling(left, right):
    """The index of each side is found among other joints."""
    assert wheel_sides((right, "arm_left_shoulder", "caster_left_wheel", left)) == ((3,), (0,))


def test_joints_without_wheels_and_wheels_without_sides():
    """Other joints give None; wheels without a side are an error."""
    assert wheel_sides(("left_shoulder", "right_gripper", "head_pan")) is None
    with pytest.raises(UnusableMessageError, match="left and right wheels, got wheel_0, wheel_1"):
        wheel_sides(("wheel_0", "wheel_1"))


def test_two_letters_are_end_and_side():
    """``rl`` is rear left, ``lr`` left rear, and ``rr`` rear right."""
    assert wheel_sides(("wheel_rl", "wheel_rr", "wheel_lf", "wheel_rf")) == ((0, 2), (1, 3))
    assert wheel_sides(("wheel_lr", "wheel_rr")) == ((0,), (1,))
