"""Live graph of ROS 1: publishers and subscribers of our topics on a real master."""

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from andabata.distribution import install_ros
from andabata.records.topics import Ros, RosMessage, Topic, message_types
from andabata.ros.graph import RosError, TopicNames

DEBIAN = Path("/usr/lib/python3/dist-packages")
"""Folder of ROS's Python packages on Debian and Ubuntu; others come by ``PYTHONPATH``."""


_QUEUE_SIZE = 200
"""Number of messages that wait for a slow subscriber: two seconds of the fastest topic."""

_BUFFER_BYTES = 1 << 22
"""Size of a subscriber's receive buffer [bytes]: a whole cloud has to fit."""


class Ros1Graph:
    """Node of this process: publishes written messages and passes received ones on, by rospy."""

    ros: Ros = 1

    def __init__(self, name: str, names: TopicNames | None = None) -> None:
        """Register the node.

        Args:
            name: Name of the node.
            names: Names of the topics; None for our own.

        Raises:
            RosError: If ROS 1 is not installed or there is no master.
        """
        self._rospy: Any = _rospy()
        import rosgraph

        if not rosgraph.is_master_online():
            uri = os.environ.get("ROS_MASTER_URI", "http://localhost:11311")
            raise RosError(
                f"ROS_MASTER_URI: expected a master at {uri}, got no answer; start one with "
                "`roscore`"
            )
        self._rospy.init_node(name, disable_signals=True)
        self._names = names or TopicNames(1)
        self._publishers: dict[Topic, Any] = {}
        self._subscribers: list[Any] = []

    def now_ns(self) -> int:
        """Return the graph's time [ns]: the wall clock, or ``/clock`` in simulated time."""
        return int(self._rospy.get_rostime().to_nsec())

    def wait_for_clock(self) -> None:
        """Wait until the graph has a time: in simulated time, for the first ``/clock``."""
        while not self.now_ns():
            time.sleep(0.01)

    def sleep_until(self, stamp_ns: int) -> None:
        """Wait for a time of the graph.

        Args:
            stamp_ns: Time to wait for [ns]; a past one returns at once.

        Raises:
            RosError: If the graph's time runs back, as when a player starts again.
        """
        rest = stamp_ns - self.now_ns()
        if rest > 0:
            try:
                self._rospy.sleep(self._rospy.Duration(0, rest))
            except self._rospy.ROSTimeMovedBackwardsException as error:
                raise RosError(
                    "/clock: expected time that increases, got a jump back; start again"
                ) from error

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Publish a message."""
        if topic not in self._publishers:
            self.advertise(topic)
        publisher = self._publishers[topic]
        publisher.publish(publisher.data_class(message))

    def advertise(self, topic: Topic, latch: bool = False) -> None:
        """Create the publisher of a topic; see ``Graph``."""
        self._publishers[topic] = self._rospy.Publisher(
            self._names.of(topic),
            _wire(topic),
            queue_size=_QUEUE_SIZE,
            latch=latch,
            tcp_nodelay=True,
        )

    def subscribe(self, topic: Topic, take: Callable[[Topic, RosMessage], None]) -> None:
        """Call a function with each message of a topic; see ``Graph``."""
        self._subscribers.append(
            self._rospy.Subscriber(
                self._names.of(topic),
                _wire(topic),
                lambda wire: take(topic, wire.content),
                queue_size=_QUEUE_SIZE,
                buff_size=_BUFFER_BYTES,
                tcp_nodelay=True,
            )
        )

    @property
    def is_shutdown(self) -> bool:
        """True if the node was shut down."""
        return bool(self._rospy.is_shutdown())

    def close(self) -> None:
        """Leave the graph."""
        self._rospy.signal_shutdown("done")


def _rospy() -> Any:  # noqa: ANN401 - a module that is not there at check time.
    """Return ROS 1's Python client.

    Raises:
        RosError: If it is not installed.
    """
    try:
        import rospy
    except ImportError:
        # Last in the path: the system's numpy must not shadow ours.
        if str(DEBIAN) not in sys.path:
            sys.path.append(str(DEBIAN))
        try:
            import rospy
        except ImportError as error:
            raise RosError(
                f"rospy: expected ROS 1's Python packages, got {error}; on Debian: {install_ros()}"
            ) from error
    return rospy


def _wire(topic: Topic) -> Any:  # noqa: ANN401 - a class made at run time.
    """Return the message class with which rospy transports a topic's messages."""
    import genpy

    store, kind = message_types(1), topic.type_name(1)
    text, digest = store.generate_msgdef(kind, ros_version=1)

    class Wire(genpy.Message):
        """Message of rosbags that rospy serialises as bytes."""

        __slots__ = ("content",)
        _slot_types = ("uint8[]",)
        _type = kind.replace("/msg/", "/")
        _md5sum = digest
        _has_header = False
        _full_text = text

        def __init__(self, content: RosMessage = None) -> None:
            self.content = content

        def serialize(self, buffer: Any) -> None:  # noqa: ANN401 - io.BytesIO.
            """Write the message's bytes to a buffer."""
            buffer.write(store.serialize_ros1(self.content, kind))

        def deserialize(self, data: bytes) -> "Wire":
            """Read the message from its bytes."""
            self.content = store.deserialize_ros1(data, kind)
            return self

    return Wire
