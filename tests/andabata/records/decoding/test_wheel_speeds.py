"""Wheel speeds from joint states, and twists from odometry."""

import numpy as np
import pytest

from andabata.records import topics
from andabata.records.decoding.unusable_message import UnusableMessageError
from andabata.records.decoding.wheel_speeds import OdometryTwist
from andabata.records.remarks import Remarks
from tests.support.foreign_messages import decoded, joints, odometry

FOUR = ("fl_wheel", "fr_wheel", "rl_wheel", "rr_wheel")


def test_odometry_without_a_twist_is_differentiated():
    """A twist of zero is replaced by changes of the pose, with a remark."""
    messages = [odometry(0.0, 0.0, 0.05 * k) for k in range(20)]
    rows, remarks = decoded(topics.ENCODERS, *messages)
    np.testing.assert_allclose(rows[-1], [5.0, 5.0])
    assert "twist stays zero" in remarks[0]


def test_a_wheel_without_a_number_leaves_the_other_of_its_side():
    """A side is the mean of its wheels with a number."""
    rows, _ = decoded(topics.ENCODERS, joints(FOUR, velocities=[1.0, 2.0, np.nan, 4.0]))
    assert rows == [[1.0, 3.0]]


@pytest.mark.parametrize("velocities", [(), [0.0] * 4, [np.nan] * 4])
@pytest.mark.parametrize("wrapped", [False, True])
def test_positions_are_differentiated(velocities, wrapped):
    """Positions alone give speeds, wrapped or not."""
    angles = np.arange(40) * 0.1
    turn = (lambda a: (a + np.pi) % (2 * np.pi) - np.pi) if wrapped else (lambda a: a)
    messages = [joints(FOUR, [turn(a), turn(2 * a)] * 2, velocities) for a in angles]
    rows, remarks = decoded(topics.ENCODERS, *messages)
    np.testing.assert_allclose(rows[-20:], np.tile([1.0, 2.0], (20, 1)), rtol=1e-9)
    assert "differences of positions" in remarks[0]


def test_joints_without_numbers_are_refused():
    """A message with neither velocities nor positions is an error."""
    with pytest.raises(UnusableMessageError, match="neither velocities nor positions"):
        decoded(topics.ENCODERS, joints(FOUR))


def test_joints_without_a_wheel_give_no_row():
    """The joint state of an arm is no reading of the wheels."""
    assert decoded(topics.ENCODERS, joints(("elbow",), [0.0], [1.0]))[0] == []


def test_left_comes_before_right_whatever_the_order_of_the_joints():
    """Rows are left, right."""
    rows, _ = decoded(topics.ENCODERS, joints(("r_wheel", "l_wheel"), velocities=[2.0, 1.0]))
    assert rows == [[1.0, 2.0]]


def test_positions_after_a_pause_give_no_speed():
    """Half a second apart is too long."""
    moved = [joints(FOUR[:2], [angle, angle]) for angle in (0.0, 1.0)]
    assert decoded(topics.ENCODERS, *moved, step=0.5)[0] == []
    assert decoded(topics.ENCODERS, *moved, step=0.4)[0] == [[2.5, 2.5]]


def test_a_turn_on_the_spot_is_read_from_poses():
    """A yaw over half a turn wraps, and gives the yaw rate without a speed."""
    reader = OdometryTwist(Remarks(), "/odom")
    yaws = np.deg2rad([150.0, 170.0, -170.0])
    twists = [reader.twist(odometry(0.0, 0.0, yaw=yaw), 0.1 * k) for k, yaw in enumerate(yaws)]
    np.testing.assert_allclose(twists[-1], [0.0, np.deg2rad(20) / 0.1], atol=1e-9)


def test_an_arc_is_read_from_poses():
    """The chord of a left turn is driven forwards at the mean heading."""
    reader = OdometryTwist(Remarks(), "/odom")
    reader.twist(odometry(0.0, 0.0), 0.0)
    side = odometry(0.0, 0.0, x=0.3, y=0.3, yaw=np.pi / 2)
    speed, yaw_rate = reader.twist(side, 0.2)
    assert speed == pytest.approx(0.3 * np.sqrt(2) / 0.2)
    assert yaw_rate == pytest.approx(np.pi / 2 / 0.2)


def test_wheels_that_stand_have_speeds_of_zero():
    """Velocities of zero count as long as no position has changed."""
    assert decoded(topics.ENCODERS, joints(FOUR, velocities=[0.0] * 4))[0] == [[0.0, 0.0]]
    still = [joints(FOUR, [1.0] * 4, [0.0] * 4)] * 3
    assert decoded(topics.ENCODERS, *still)[0] == [[0.0, 0.0]] * 3


def test_a_message_without_a_number_for_the_last_wheel_is_refused():
    """One value too few is no value of that side."""
    with pytest.raises(UnusableMessageError, match="neither velocities nor positions"):
        decoded(topics.ENCODERS, joints(FOUR, velocities=[1.0] * 3))


def test_a_twist_is_used_as_soon_as_there_is_one():
    """A yaw rate alone is a twist, and poses are not differentiated after it."""
    reader = OdometryTwist(Remarks(), "/odom")
    assert reader.twist(odometry(0.0, 0.5), 0.0) == (0.0, 0.5)
    assert reader.twist(odometry(0.0, 0.0, x=1.0), 0.1) == (0.0, 0.0)


def test_small_changes_of_a_pose_are_no_motion():
    """Up to 0.2 m a twist of zero is trusted."""
    reader = OdometryTwist(Remarks(), "/odom")
    twists = [reader.twist(odometry(0.0, 0.0, x=x), x) for x in (0.0, 0.1, 0.2, 0.3)]
    assert twists[:3] == [(0.0, 0.0)] * 3
    assert twists[3] == pytest.approx((1.0, 0.0))
