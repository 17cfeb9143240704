"""Received messages of the sensors, kept until the navigator asks for them."""

import threading
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings
from andabata.records import topics
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.decoding.source_choice import is_chosen
from andabata.records.messages import pose_of
from andabata.records.remarks import Remarks
from andabata.records.topics import RosMessage, Topic
from andabata.ros.graph import Graph

_TRANSFORM_MEMORY = 30.0
"""Time for which transforms of moving frames are kept [s]."""


class SensorInbox:
    """Thread-safe store of received messages: the graph's threads write, the navigator reads.

    Attributes:
        keeps_messages: True to keep the messages of lasers, and transforms, for a recording.
    """

    def __init__(
        self, graph: Graph, decoder: SensorDecoder, sources: Mapping[str, str] | None = None
    ) -> None:
        """Create an empty store.

        Args:
            graph: Graph whose messages and time are used.
            decoder: Decoder of the sensors' messages; used by this object alone from now on.
            sources: Frame of the only source that is read, by topic; the others are dropped.
        """
        self._chosen = sources or {}
        self._graph, self._decoder = graph, decoder
        self._lock = threading.Lock()
        self._initial_pose: Pose | None = None
        self._received: list[tuple[Topic, RosMessage]] = []
        self._taken: list[tuple[Topic, RosMessage]] = []
        self._static: list[tuple[Topic, RosMessage]] = []
        self.keeps_messages = False

    def subscribe(self) -> None:
        """Subscribe to the sensors' topics, to goals, initial poses and transforms."""
        for topic in self._decoder.wanted:
            self._graph.subscribe(topic, self._add_message)
        self._graph.subscribe(topics.INITIAL_POSE, self._add_initial_pose)
        for topic in (topics.TF_STATIC, topics.TF):
            self._graph.subscribe(topic, self._add_transforms)

    def _add_message(self, topic: Topic, message: RosMessage) -> None:
        """Store the message of a sensor, or a goal."""
        if not is_chosen(topic.ros1, message, "", self._chosen):
            return
        with self._lock:
            self._decoder.add(topic, message, self._graph.now_ns())
            if self.keeps_messages and self._decoder.is_laser(topic):
                self._received.append((topic, message))

    def _add_initial_pose(self, _: Topic, message: RosMessage) -> None:
        """Store a pose to which the navigator is to be reset."""
        with self._lock:
            self._initial_pose = pose_of(message.pose.pose)

    def _add_transforms(self, topic: Topic, message: RosMessage) -> None:
        """Store transforms; those of static frames are sent once and kept."""
        with self._lock:
            tree = self._decoder.extrinsics.tree
            tree.add(message.transforms, topic is topics.TF_STATIC)
            tree.prune(_TRANSFORM_MEMORY)
            if self.keeps_messages:
                kept = self._static if topic is topics.TF_STATIC else self._received
                kept.append((topic, message))

    def restart(self, epoch_ns: int) -> None:
        """Discard the readings and the initial pose; count time from an epoch [ns] from now on."""
        static = self._static
        self.take_readings(0.0)
        with self._lock:
            self._static = static  # They are sent once, and count from the start on.
            self._decoder.epoch_ns = epoch_ns
            self._initial_pose = None

    def take_readings(self, stamp: float) -> SensorReadings:
        """Return the readings received since the last call.

        Args:
            stamp: Time of the readings' end [s].

        Raises:
            FrameError: If gravity contradicts the mounting of a sensor.
        """
        with self._lock:
            self._decoder.extrinsics.verify()
            self._taken, self._received = [*self._static, *self._received], []
            self._static = []
            return self._decoder.readings(stamp)

    @property
    def taken(self) -> list[tuple[Topic, RosMessage]]:
        """Messages of lasers, and transforms, that the last readings came with, if kept."""
        return self._taken

    def take_initial_pose(self) -> Pose | None:
        """Return the last initial pose received since the last call; None without one."""
        with self._lock:
            pose, self._initial_pose = self._initial_pose, None
        return pose

    @property
    def goal(self) -> NDArray[np.float64] | None:
        """Last goal in the map [m], shape (2,); None before the first."""
        with self._lock:
            return self._decoder.goal

    @goal.setter
    def goal(self, goal: NDArray[np.float64]) -> None:
        with self._lock:
            self._decoder.goal = goal

    @property
    def has_all_transforms(self) -> bool:
        """True if the mounting of every sensor is known."""
        with self._lock:
            return self._decoder.extrinsics.is_settled

    @property
    def mounting_remarks(self) -> list[str]:
        """What a user should know about the mountings."""
        with self._lock:
            return self._decoder.extrinsics.remarks

    @property
    def failures(self) -> list[str]:
        """Checks of the sensors against each other that failed so far, a line each."""
        with self._lock:
            return self._decoder.failures

    @property
    def remarks(self) -> Remarks:
        """What was noted about the messages; not guarded by the lock."""
        return self._decoder.remarks

    @property
    def refused(self) -> int:
        """Number of messages that could not be used."""
        return self._decoder.refused
