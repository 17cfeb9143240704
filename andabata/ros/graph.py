"""Live graph that nodes publish to and receive from, whichever version of ROS carries it."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

from andabata.records import topics
from andabata.records.bag_writers import MessageWriter
from andabata.records.topics import Ros, RosMessage, Topic

_OURS = frozenset(
    {
        *topics.TOPICS,
        *topics.PLANNER_TOPICS,
        topics.GOAL_REACHED,
        topics.LASER_CLOUD,
        topics.TF_STATIC,
        topics.WALKERS,
    }
)
"""Topics whose names are ours, and move with a namespace."""

_ROS2_NAME = re.compile(r"(/[A-Za-z_][A-Za-z0-9_]*)+")


class RosError(ValueError):
    """Missing ROS, master or peer, or an unusable clock or name of the graph."""


@dataclass(frozen=True)
class TopicNames:
    """Names of the topics in a graph.

    Attributes:
        ros: Version of ROS.
        namespace: Prefix of our own names, as ``/robot1``; empty for none. ``/tf`` and
            ``/tf_static`` move with it, too, as Nav2 has it.
        remapping: Names in the graph by ours, of either version of ROS; absolute.
    """

    ros: Ros
    namespace: str = ""
    remapping: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the names.

        Raises:
            RosError: If the namespace is no name, or no topic of ours has a remapped name.
        """
        if self.namespace and not _ROS2_NAME.fullmatch(self.namespace):
            raise RosError(
                "--namespace: expected a slash and letters, digits or _, as /robot1, got "
                f"{self.namespace!r}"
            )
        known = {name for topic in _OURS for name in (topic.ros1, topic.ros2)}
        unknown = sorted(set(self.remapping) - known)
        if unknown:
            listed = ", ".join(sorted({topic.name(self.ros) for topic in _OURS}))
            raise RosError(f"--remap: expected one of {listed} before the sign, got {unknown[0]}")

    def of(self, topic: Topic) -> str:
        """Return the name of a topic in the graph.

        Raises:
            RosError: If the version of ROS does not allow it.
        """
        name = own = topic.name(self.ros)
        if topic in _OURS:  # A topic that the user names is somebody else's, and stays as it is.
            name = self.remapping.get(topic.ros1) or self.remapping.get(topic.ros2, "")
            name = name or f"{self.namespace}{own}"
        if self.ros == 2 and not _ROS2_NAME.fullmatch(name):
            raise RosError(
                f"{name}: expected a name of ROS 2, of /, letters, digits and _, no part of which "
                "begins with a digit; choose another"
            )
        return name


class Graph(MessageWriter, Protocol):
    """Graph as one node sees it.

    Messages are built and read by rosbags, and the graph only transports their bytes. So no message
    package of ROS has to be built, and messages of a recording and of a graph are the same.
    """

    def now_ns(self) -> int:
        """Return the graph's time [ns]: the wall clock, or ``/clock`` in simulated time."""

    def wait_for_clock(self) -> None:
        """Wait until the graph has a time: in simulated time, for the first ``/clock``."""

    def sleep_until(self, stamp_ns: int) -> None:
        """Wait for a time of the graph.

        Args:
            stamp_ns: Time to wait for [ns]; a past one returns at once.

        Raises:
            RosError: If the graph's time runs back, as when a player starts again.
        """

    def advertise(self, topic: Topic, latch: bool = False) -> None:
        """Announce a topic that is written to later.

        Args:
            topic: The topic.
            latch: True to send the last message to later subscribers, too.
        """

    def subscribe(self, topic: Topic, take: Callable[[Topic, RosMessage], None]) -> None:
        """Call a function with each message of a topic, in a thread of the subscriber.

        Args:
            topic: The topic.
            take: Function of the topic and the message.
        """

    @property
    def is_shutdown(self) -> bool:
        """True if the node was shut down."""
