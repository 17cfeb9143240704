"""Message types by topic."""

import pytest

from andabata.records import topics
from andabata.records.decoding.accepted_types import accepted_types, full_type, message_type
from tests.support.foreign_messages import vector


@pytest.mark.parametrize("topic", topics.TOPICS)
def test_our_own_types_are_accepted(topic):
    """Every topic accepts its type of ROS 1 and of ROS 2."""
    assert {topic.type_name(1), topic.type_name(2)} <= set(accepted_types(topic))


def test_other_types_are_accepted_for_their_topics_alone():
    """Odometry is a reading of the wheels, and the older cloud one of a laser."""
    assert "nav_msgs/msg/Odometry" in accepted_types(topics.ENCODERS)
    assert "nav_msgs/msg/Odometry" not in accepted_types(topics.IMU)
    assert "sensor_msgs/msg/PointCloud" in accepted_types(topics.LASER_CLOUD)
    assert "sensor_msgs/msg/PointCloud" not in accepted_types(topics.SCAN)


def test_types_are_written_as_in_ros_2():
    """Names of ROS 1 get their middle part."""
    assert full_type("sensor_msgs/Imu") == full_type("sensor_msgs/msg/Imu") == "sensor_msgs/msg/Imu"
    assert message_type(vector(1)) == "geometry_msgs/msg/Vector3"
