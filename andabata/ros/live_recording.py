"""Recording of a live drive, by a navigator: what it took in, period by period, and put out.

Another node that records the graph hears the same messages at other times, so that some of them
fall into the next control period. This one writes down in which period each was used.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.decoding.accepted_types import message_type
from andabata.records.messages import MessageBuilder
from andabata.records.topics import Ros, RosMessage, Topic
from andabata.ros.graph import RosError

Received = tuple[Topic, RosMessage]

_OURS = (("map", "odom"), ("odom", "base_footprint"))
"""Transforms that the navigator publishes, as parent and child."""


class LiveRecording:
    """Recording that a replay divides into the control periods of the drive."""

    def __init__(self, path: Path, ros: Ros) -> None:
        """Create a file.

        Args:
            path: Path in ``.bag`` (ROS 1), ``.mcap`` or ``.db3`` (ROS 2).
            ros: Version of the graph.

        Raises:
            RosError: If the format is that of another version.
            BagError: If there is no such format, or the path exists already.
        """
        if (path.suffix == ".bag") != (ros == 1):
            expected = ".bag in a ROS 1 graph" if ros == 1 else ".mcap or .db3 in a ROS 2 graph"
            raise RosError(f"--record {path}: expected a name in {expected}, got {path.suffix!r}")
        self._writer = open_writer(path)
        self._goal: NDArray[np.float64] | None = None

    def begin(self, pose: Pose, builder: MessageBuilder) -> None:
        """Record the start.

        Args:
            pose: Pose in the map.
            builder: Builder of the messages, whose epoch is the time of the start.
        """
        self.builder = builder
        self._write(0.0, topics.INITIAL_POSE, builder.stamped_pose(0.0, pose))
        self._write(0.0, topics.FILTERED_ODOMETRY, builder.odometry(0.0, pose))

    def add_readings(self, now: float, readings: SensorReadings, received: list[Received]) -> None:
        """Record readings at the time at which the navigator uses them.

        Rows are those that are used, in SI units and the robot's axes; lasers' messages and
        transforms are as they came.

        Args:
            now: Time [s].
            readings: Readings that are used.
            received: Messages of lasers, and transforms, since the last call.
        """
        builder = self.builder
        for topic, message in received:
            typed = replace(topic, kind=message_type(message), kind1=None)
            self._write(now, typed, _without_ours(message) if topic is topics.TF else message)
        for row in _rows(readings.imu):
            self._write(now, topics.IMU, builder.imu(row))
        for row in _rows(readings.encoders):
            wheels = builder.wheels("Wheels_speed", float(row[0]), row[1], row[2])
            self._write(now, topics.ENCODERS, wheels)
        for row in _rows(readings.mag):
            self._write(now, topics.MAG, builder.field(row))
        for row in _rows(readings.gnss):
            self._write(now, topics.FIX, builder.fix(row))

    def add_update(self, now: float) -> None:
        """Record that the readings up to a time [s] are taken in, before the period's end."""
        self._write(now, topics.UPDATE, self.builder.new(topics.UPDATE.kind, data=now))

    def add_goal(self, now: float, goal: NDArray[np.float64]) -> None:
        """Record a goal [m], shape (2,), at a time [s], unless it is the one before."""
        if self._goal is None or not np.array_equal(goal, self._goal):
            self._goal = goal.copy()
            self._write(now, topics.GOAL, self.builder.goal(now, goal))

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Record a published message at its time [ns]."""
        self._writer.write(topic, stamp_ns, message)

    def _write(self, now: float, topic: Topic, message: RosMessage) -> None:
        """Record a message at a time [s]."""
        self._writer.write(topic, self.builder.stamp_ns(now), message)

    def close(self) -> None:
        """Finish the file."""
        self._writer.close()


def _without_ours(message: RosMessage) -> RosMessage:
    """Return transforms without those that we publish: in a recording they would contradict."""
    foreign = [
        each
        for each in message.transforms
        if (each.header.frame_id.lstrip("/"), each.child_frame_id.lstrip("/")) not in _OURS
    ]
    return replace(message, transforms=foreign)


def _rows(rows: NDArray[np.float64] | None) -> NDArray[np.float64]:
    """Return a sensor's rows; none if it sent nothing."""
    return np.empty((0, 1)) if rows is None else rows
