"""Message types that each topic is accepted in.

| readings | types |
|---|---|
| IMU | ``Imu`` |
| wheels | ``Wheels_speed``, ``JointState``, ``Odometry``, ``Twist`` and its stamped kinds |
| magnetic field | ``MagneticField``, ``Vector3Stamped``, ``Vector3`` |
| clouds | ``PointCloud2``, ``PointCloud`` |
"""

from collections.abc import Mapping

from andabata.records import topics
from andabata.records.topics import POINT_CLOUD, RosMessage, Topic

OLD_POINT_CLOUD = "sensor_msgs/msg/PointCloud"

JOINT_STATE = "sensor_msgs/msg/JointState"

ODOMETRY = "nav_msgs/msg/Odometry"

TWISTS = (
    ODOMETRY,
    "geometry_msgs/msg/TwistStamped",
    "geometry_msgs/msg/TwistWithCovarianceStamped",
    "geometry_msgs/msg/Twist",
)
"""Types that hold the body's forward speed and yaw rate."""

VECTOR_STAMPED = "geometry_msgs/msg/Vector3Stamped"

VECTOR = "geometry_msgs/msg/Vector3"

ALTERNATIVES: Mapping[Topic, tuple[str, ...]] = {
    topics.IMU: (topics.IMU.kind,),
    topics.ENCODERS: (topics.ENCODERS.kind, JOINT_STATE, *TWISTS),
    topics.MAG: (topics.MAG.kind, VECTOR_STAMPED, VECTOR),
}
"""Types of the readings whose unit is inferred, ours first."""


def accepted_types(topic: Topic) -> tuple[str, ...]:
    """Return the types that a topic is accepted in, as ``package/msg/Name``."""
    if topic in ALTERNATIVES:
        return ALTERNATIVES[topic]
    own = (topic.kind,) if topic.kind1 is None else (topic.kind, topic.kind1)
    return (*own, OLD_POINT_CLOUD) if topic.kind == POINT_CLOUD else own


def message_type(message: RosMessage) -> str:
    """Return the type of a message, as ``package/msg/Name``."""
    return str(getattr(message, "__msgtype__", type(message).__name__))


def full_type(name: str) -> str:
    """Return a type as ``package/msg/Name``, whether ROS 1 or ROS 2 wrote it."""
    return name if "/msg/" in name else name.replace("/", "/msg/", 1)
