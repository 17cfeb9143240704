"""Sources of frames: which of two poses holds, and what is said of them."""

import pytest

from andabata.records.frames.sources import FrameSource, FrameSources, returning_text
from tests.support.edited_bags import turn

STATIC, MOVING = FrameSource("/tf_static", ""), FrameSource("/tf", "/driver")


def pose(x=0.0, yaw=0.0):
    """Return a position and a quaternion."""
    return [x, 0.0, 0.0, *turn((0, 0, yaw)).as_quat()]


@pytest.mark.parametrize(
    ("x", "yaw", "differs"), [(0.04, 2, False), (0.06, 0, True), (0.0, 4, True)]
)
def test_poses_agree_within_five_centimetres_and_three_degrees(x, yaw, differs):
    """Beyond either bound the frame has no pose."""
    sources = FrameSources()
    assert sources.add("base_link", "imu", STATIC, pose()) is None
    fault = sources.add("base_link", "imu", MOVING, pose(x, yaw))
    assert (fault is not None) == differs
    (text,) = sources.remarks
    assert ("contradict each other" if differs else "agree within") in text
    assert "/tf of /driver and /tf_static" in text


def test_a_moving_frame_of_one_source_is_no_contradiction():
    """A joint may go anywhere."""
    sources = FrameSources()
    assert all(sources.add("base_link", "arm", MOVING, pose(k)) is None for k in range(9))
    assert sources.remarks == []


def test_two_poses_in_turn_are_both_named():
    """Both are written as the option takes them."""
    text = returning_text("base_link", pose(1.0), pose(0.0, 90))
    assert "1,0,0,0,0,0 and 0,0,0,0,0,90" in text
