"""Copies of our recordings, edited as another robot would have made them."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.bags import Bag
from andabata.records.messages import NS, MessageBuilder
from andabata.records.topics import RosMessage

KEPT = {
    t.ros1: t for t in (topics.IMU, topics.ENCODERS, topics.MAG, topics.FIX, topics.LASER_CLOUD)
}
"""Topics of another robot's sensors: no commands, no start, no settings."""

Placed = tuple[str, str, Sequence[float], Sequence[float]]
"""Parent, child, x, y, z [m], roll, pitch, yaw [deg]."""


def turn(degrees: Sequence[float]) -> Rotation:
    """Return the rotation of roll, pitch and yaw [deg]."""
    return Rotation.from_euler("ZYX", list(degrees)[::-1], degrees=True)


def stamped(
    builder: MessageBuilder,
    placed: Placed,
    stamp_ns: int = 0,
    quaternion: Sequence[float] | None = None,
) -> RosMessage:
    """Return a TransformStamped."""
    parent, child, xyz, degrees = placed
    header = builder.header((stamp_ns - builder.epoch_ns) / NS, parent)
    if stamp_ns:  # Floating seconds lose nanoseconds.
        stamp = replace(header.stamp, sec=stamp_ns // NS, nanosec=stamp_ns % NS)
        header = replace(header, stamp=stamp)
    quat = np.array(turn(degrees).as_quat() if quaternion is None else quaternion, dtype=float)
    transform = builder.new(
        "geometry_msgs/msg/Transform",
        translation=builder.vector(np.array(xyz, dtype=float)),
        rotation=builder.quaternion(quat),
    )
    return builder.new(
        "geometry_msgs/msg/TransformStamped",
        header=header,
        child_frame_id=child,
        transform=transform,
    )


def transforms(builder: MessageBuilder, kind: str, *placed: Placed) -> RosMessage:
    """Return a message with transforms."""
    return builder.new(kind, transforms=[stamped(builder, each) for each in placed])


def copy_bag(
    source: Path,
    target: Path,
    edit: Callable[[str, RosMessage], RosMessage] = lambda topic, message: message,
    static: Sequence[Placed] = (),
    moving: Callable[[int], Sequence[RosMessage]] | None = None,
    static_after: float = 0.0,
) -> Path:
    """Copy the sensors' messages of a recording, edited, with transforms.

    Args:
        source: Our recording.
        target: New ROS 1 bag.
        edit: Function of topic and message that returns the message to write.
        static: Transforms for /tf_static, each in a message of its own.
        moving: Function of a stamp [ns] that returns transforms for /tf; called for each inertial
            message.
        static_after: Time from the begin to the static transforms [s].
    """
    target.unlink(missing_ok=True)
    writer, builder, sent = open_writer(target), MessageBuilder(1), False
    with Bag(source) as bag:
        begin = None
        for message in bag.messages(tuple(KEPT)):
            begin = begin or message.stamp_ns
            if not sent and message.stamp_ns >= begin + static_after * NS:
                for each in static:
                    content = transforms(builder, "tf2_msgs/msg/TFMessage", each)
                    writer.write(topics.TF_STATIC, message.stamp_ns, content)
                sent = True
            if moving is not None and message.topic == topics.IMU.ros1:
                content = builder.new("tf/msg/tfMessage", transforms=list(moving(message.stamp_ns)))
                writer.write(topics.TF, message.stamp_ns, content)
            content = edit(message.topic, message.content)
            writer.write(KEPT[message.topic], message.stamp_ns, content)
    writer.close()
    return target


def reframed(message: RosMessage, frame: str) -> RosMessage:
    """Return a message with another frame in its header."""
    return replace(message, header=replace(message.header, frame_id=frame))


def moved_cloud(
    message: RosMessage, move: Callable[[np.ndarray, np.ndarray], np.ndarray], frame: str
) -> RosMessage:
    """Return one of our laser's clouds with other points.

    Args:
        message: Cloud with the fields x, y, z and t.
        move: Function of points, shape (n, 3), and their stamps [ns] that returns points.
        frame: Name of the new frame.
    """
    rows = message.data.view([("xyz", "<f4", 3), ("t", "<u4")]).copy()
    stamp = message.header.stamp
    stamps = stamp.sec * NS + stamp.nanosec + rows["t"].astype(np.int64)
    rows["xyz"] = move(rows["xyz"].astype(float), stamps)
    return replace(reframed(message, frame), data=rows.view(np.uint8).ravel())


def turned(vector: Any, rotation: Rotation) -> RosMessage:
    """Return a vector message turned."""
    x, y, z = rotation.apply([vector.x, vector.y, vector.z]).tolist()
    return replace(vector, x=x, y=y, z=z)


def turned_imu(message: RosMessage, rotation: Rotation, frame: str) -> RosMessage:
    """Return an inertial message as of an IMU whose axes are turned."""
    return replace(
        reframed(message, frame),
        angular_velocity=turned(message.angular_velocity, rotation),
        linear_acceleration=turned(message.linear_acceleration, rotation),
    )


def plain(frame: str = "", **fields: object) -> RosMessage:
    """Return a stand-in for a message with a header."""
    stamp = SimpleNamespace(sec=0, nanosec=0)
    return SimpleNamespace(header=SimpleNamespace(frame_id=frame, stamp=stamp), **fields)
