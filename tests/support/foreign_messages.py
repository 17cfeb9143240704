"""Messages of other robots, and their numbers as the decoder reads them."""

import numpy as np

from andabata.machine.robot import RobotModel
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.units import UnitFactors
from tests.support import computed_bags
from tests.support.computed_bags import new

ROBOT = RobotModel()


def header():
    """Return a header."""
    return computed_bags.drive(0.02)[0].content.header


def vector(x, y=0.0, z=0.0):
    """Return a vector."""
    return new("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=float(z))


def twist(speed, yaw_rate):
    """Return a twist of a forward speed and a yaw rate."""
    return new("geometry_msgs/msg/Twist", linear=vector(speed), angular=vector(0, 0, yaw_rate))


def odometry(speed, yaw_rate, x=0.0, y=0.0, yaw=0.0):
    """Return odometry of a twist and a planar pose."""
    level = new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=np.sin(yaw / 2), w=np.cos(yaw / 2))
    place = new("geometry_msgs/msg/Point", x=float(x), y=float(y), z=0.0)
    pose = new("geometry_msgs/msg/Pose", position=place, orientation=level)
    zeros = np.zeros(36)
    return new(
        "nav_msgs/msg/Odometry",
        header=header(),
        child_frame_id="base_link",
        pose=new("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=zeros),
        twist=new(
            "geometry_msgs/msg/TwistWithCovariance", twist=twist(speed, yaw_rate), covariance=zeros
        ),
    )


def joints(names, positions=(), velocities=()):
    """Return a joint state."""
    return new(
        "sensor_msgs/msg/JointState",
        header=header(),
        name=list(names),
        position=np.array(positions, dtype=float),
        velocity=np.array(velocities, dtype=float),
        effort=np.zeros(0),
    )


def decoded(topic, *messages, step=0.1):
    """Return the numbers of messages in SI units, ``step`` seconds apart, and the remarks."""
    decoder = MessageDecoder(ROBOT, UnitFactors())
    found = [decoder.rows(topic, m, k * step) for k, m in enumerate(messages)]
    return [row[1:] for rows in found for row in rows], decoder.remarks.texts
