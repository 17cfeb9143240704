"""Messages hold what they are built from, in the axes and units of their types."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import WheelSpeeds
from andabata.records.messages import (
    NS,
    MessageBuilder,
    fix_of,
    header_ns,
    pose_of,
    sweep_angles,
    wheel_speeds_of,
)
from traversability.cloud import PointCloud
from traversability.virtual_scan import VirtualScan

BUILDER = MessageBuilder(1, 5 * NS)


def test_stamps_count_from_the_epoch():
    """A header's stamp is the epoch and the rounded time, also before the epoch."""
    assert header_ns(BUILDER.goal(0.25, np.zeros(2))) == 5_250_000_000
    assert BUILDER.stamp_ns(-0.5) == 4_500_000_000
    assert BUILDER.stamp_ns(1e-9 * 0.6) == 5 * NS + 1


def test_a_sequence_number_is_ros_1_only():
    """Headers of ROS 1 have the field seq, those of ROS 2 don't."""
    assert BUILDER.header(0.0, "map").seq == 0
    assert not hasattr(MessageBuilder(2).header(0.0, "map"), "seq")


def test_poses_and_wheel_speeds_come_back():
    """Position, quaternion and both wheels are kept in their order."""
    pose = Pose(np.array([1.0, 2.0, 3.0]), np.array([0.1, 0.2, 0.3, 0.9]))
    found = pose_of(BUILDER.pose(pose))
    np.testing.assert_array_equal(found.position, pose.position)
    np.testing.assert_array_equal(found.quaternion, pose.quaternion)
    wheels = wheel_speeds_of(BUILDER.wheels("Wheels_cmd", 0.0, 1.5, -2.5))
    assert wheels == WheelSpeeds(1.5, -2.5)


def test_a_twist_drives_forward_and_turns_about_up():
    """The speed is linear x, the yaw rate angular z; all else is zero."""
    twist = BUILDER.twist(0.3, -0.2)
    assert [twist.linear.x, twist.linear.y, twist.linear.z] == [0.3, 0.0, 0.0]
    assert [twist.angular.x, twist.angular.y, twist.angular.z] == [0.0, 0.0, -0.2]


def test_a_covariance_is_written_row_by_row():
    """x, y, z, then turns about them; without one it is zeros, in odometry and pose alike."""
    six = np.arange(36.0).reshape(6, 6)
    pose = Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    for made in (BUILDER.odometry, BUILDER.stamped_pose):
        message = made(0.0, pose, six)
        np.testing.assert_array_equal(message.pose.covariance, six.ravel())
        assert message.header.frame_id == "map"
        np.testing.assert_array_equal(made(0.0, pose).pose.covariance, np.zeros(36))


def test_the_angles_of_a_virtual_scan_are_its_bearings():
    """First angle, last angle and increment give the bearings; ranges stay unknown or free."""
    bearings = np.linspace(-3.0, 3.0, 4)
    ranges = np.array([1.0, np.nan, np.inf, 4.0], dtype=np.float32)
    message = BUILDER.virtual_scan(0.0, VirtualScan(ranges, 10.0), bearings)
    np.testing.assert_allclose(sweep_angles(message), bearings, rtol=1e-6)
    assert message.angle_increment == pytest.approx(2.0)
    np.testing.assert_array_equal(message.ranges, ranges)


def test_a_cloud_lists_its_fields_one_after_the_other():
    """Fields have offsets of four bytes, and the size is that of all points."""
    message = BUILDER.cloud(0.0, PointCloud(np.ones((5, 3), dtype=np.float32), "odom"))
    assert [(f.name, f.offset, f.datatype) for f in message.fields] == [
        ("x", 0, 7),
        ("y", 4, 7),
        ("z", 8, 7),
    ]
    assert (message.point_step, message.width, message.row_step) == (12, 5, 60)
    assert message.header.frame_id == "odom"


def test_point_times_count_from_the_header():
    """The header has the first point's stamp; ``t`` counts nanoseconds from it."""
    stamps = np.array([2.5, 2.25, 2.75])
    message = BUILDER.frame(PointCloud(np.ones((3, 3), dtype=np.float32), "sensor", stamps))
    assert header_ns(message) == 5 * NS + 2_250_000_000
    rows = message.data.view([("xyz", "<f4", 3), ("t", "<u4")])
    assert rows["t"].tolist() == [250_000_000, 0, 500_000_000]
    with pytest.raises(ValueError, match="expected a time of each point"):
        BUILDER.frame(PointCloud(np.ones((3, 3), dtype=np.float32), "sensor"))


def test_an_inertial_message_leaves_the_orientation_unknown():
    """Rates and specific force are kept in order; -1 marks the orientation as unknown."""
    message = BUILDER.imu(np.arange(7.0))
    w, a = message.angular_velocity, message.linear_acceleration
    assert [w.x, w.y, w.z, a.x, a.y, a.z] == [1, 2, 3, 4, 5, 6]
    assert message.orientation_covariance[0] == -1
    assert header_ns(message) == 5 * NS


def test_the_vertical_variance_of_a_fix_is_four_times_the_horizontal_one():
    """The covariance of a fix is diagonal, and its type is known."""
    fix = BUILDER.fix(np.array([0.0, 36.7, -4.4, 60.0, 0.5]))
    np.testing.assert_array_equal(fix.position_covariance.reshape(3, 3), np.diag([0.5, 0.5, 2.0]))
    assert (fix.position_covariance_type, fix.status.status) == (2, 0)


def test_a_missing_fix_survives_writing_and_reading():
    """A row without a fix has status -1 and comes back; a known one comes back, too."""
    row = np.array([3.0, np.nan, np.nan, np.nan, np.inf])
    message = MessageBuilder(1).fix(row)
    assert message.status.status == -1
    np.testing.assert_array_equal(fix_of(message), row[1:])
    known = np.array([3.0, 36.7, -4.4, 60.0, 0.5])
    np.testing.assert_allclose(fix_of(MessageBuilder(2).fix(known)), known[1:])


@pytest.mark.parametrize(
    ("kind", "east", "north", "expected"),
    [
        (2, 1.0, 4.0, 4.0),
        (2, 4.0, 1.0, 4.0),
        (0, 1.0, 1.0, np.nan),
        (2, 0.0, 0.0, np.nan),
        (1, np.nan, np.nan, np.nan),
        (2, np.inf, 1.0, np.nan),
        (2, -1.0, 2.0, -1.0),
    ],
)
def test_the_variance_of_a_fix_is_the_larger_one_or_unknown(kind, east, north, expected):
    """The variance is the larger of two; NaN for every form of unknown; negative if stated so."""
    fix = MessageBuilder(1).fix(np.array([3.0, 36.7, -4.4, 60.0, 0.5]))
    covariance = np.diag([east, north, 9.0]).ravel()
    fix = replace(fix, position_covariance=covariance, position_covariance_type=kind)
    np.testing.assert_array_equal(fix_of(fix), [36.7, -4.4, 60.0, expected])
