"""A live ROS 1 graph: the topics of a recording, on a real master."""

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from andabata.records.bags import MessageWriter
from andabata.records.topics import Ros, RosMessage, Topic, message_types

DEBIAN = Path("/usr/lib/python3/dist-packages")
"""Where Debian and Ubuntu put ROS's Python packages; other places come by ``PYTHONPATH``."""

PACKAGES = "ros-core python3-rospy python3-rosbag"
"""Debian's packages that hold what a graph needs."""


class RosError(ValueError):
    """A ROS graph that is not there."""


class RosGraph(MessageWriter):
    """This process as a node: it publishes what is written and hands on what it hears.

    Messages are ours, made and read by rosbags; rospy only carries their bytes. That is why no
    message package of ROS has to be built, and why a recording and a graph can't differ.
    """

    ros: Ros = 1

    def __init__(self, name: str) -> None:
        """Become a node.

        Args:
            name: Of the node.

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
        self._publishers: dict[str, Any] = {}
        self._subscribers: list[Any] = []

    def now_ns(self) -> int:
        """Return the graph's time [ns]: the wall clock's, or what ``/clock`` says."""
        return int(self._rospy.get_rostime().to_nsec())

    def wait_for_clock(self) -> None:
        """Wait until the graph has a time."""
        while not self.now_ns():
            time.sleep(0.01)

    def sleep_until(self, stamp_ns: int) -> None:
        """Wait for a time of the graph [ns].

        Raises:
            RosError: If the graph's time runs back, as when a player begins again.
        """
        rest = stamp_ns - self.now_ns()
        if rest > 0:
            try:
                self._rospy.sleep(self._rospy.Duration(0, rest))
            except self._rospy.ROSTimeMovedBackwardsException as error:
                raise RosError(
                    "/clock: expected time that goes on, got some that runs back; start again"
                ) from error

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Publish a message."""
        if topic.ros1 not in self._publishers:
            self._publishers[topic.ros1] = self.advertise(topic)
        publisher = self._publishers[topic.ros1]
        publisher.publish(publisher.data_class(message))

    def advertise(self, topic: Topic, latch: bool = False) -> Any:  # noqa: ANN401 - rospy's.
        """Say that a topic will be published; ``latch`` keeps the last one for those who come."""
        publisher = self._rospy.Publisher(
            topic.ros1, _wire(topic), queue_size=_QUEUE, latch=latch, tcp_nodelay=True
        )
        self._publishers[topic.ros1] = publisher
        return publisher

    def subscribe(self, topic: Topic, take: Callable[[Topic, RosMessage], None]) -> None:
        """Hand on each message of a topic, in a thread of its own."""
        self._subscribers.append(
            self._rospy.Subscriber(
                topic.ros1,
                _wire(topic),
                lambda wire: take(topic, wire.content),
                queue_size=_QUEUE,
                buff_size=1 << 22,
                tcp_nodelay=True,
            )
        )

    @property
    def is_shutdown(self) -> bool:
        """Whether someone has shut this node down."""
        return bool(self._rospy.is_shutdown())

    def close(self) -> None:
        """Leave the graph."""
        self._rospy.signal_shutdown("done")


_QUEUE = 200
"""Messages that wait for a slow listener: two seconds of the fastest topic."""


def _rospy() -> Any:  # noqa: ANN401 - a module that is not there at check time.
    """Return ROS 1's Python client.

    Raises:
        RosError: If it is not installed.
    """
    try:
        import rospy
    except ImportError:
        # Behind everything else: the system's numpy must not take the place of ours.
        if str(DEBIAN) not in sys.path:
            sys.path.append(str(DEBIAN))
        try:
            import rospy
        except ImportError as error:
            raise RosError(
                f"rospy: expected ROS 1's Python packages, got {error}; on Debian: "
                f"apt-get install {PACKAGES}"
            ) from error
    return rospy


def _wire(topic: Topic) -> Any:  # noqa: ANN401 - a class made at run time.
    """Return the class by which rospy carries a topic's messages."""
    import genpy

    store, kind = message_types(1), topic.type_name(1)
    text, digest = store.generate_msgdef(kind, ros_version=1)

    class Wire(genpy.Message):
        """Bytes for rospy, a message of rosbags for us."""

        __slots__ = ("content",)
        _slot_types = ("uint8[]",)
        _type = kind.replace("/msg/", "/")
        _md5sum = digest
        _has_header = False
        _full_text = text

        def __init__(self, content: RosMessage = None) -> None:
            self.content = content

        def serialize(self, buffer: Any) -> None:  # noqa: ANN401 - io.BytesIO.
            """Write the message's bytes."""
            buffer.write(store.serialize_ros1(self.content, kind))

        def deserialize(self, data: bytes) -> "Wire":
            """Read the message from its bytes."""
            self.content = store.deserialize_ros1(data, kind)
            return self

    return Wire
