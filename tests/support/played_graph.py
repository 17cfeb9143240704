"""Stand-in for a live graph: its time passes while a node sleeps, and brings messages."""

from collections.abc import Callable, Iterable
from pathlib import Path

from andabata.records.bags import Bag
from andabata.records.topics import RosMessage, Topic


class MemoryWriter:
    """Writer that keeps stamp [ns], topic and message of all that is written."""

    ros = 1

    def __init__(self) -> None:
        self.messages: list[tuple[int, Topic, RosMessage]] = []

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Keep a message."""
        self.messages.append((stamp_ns, topic, message))


class PlayedGraph(MemoryWriter):
    """Graph that plays messages at their stamps."""

    def __init__(
        self, messages: Iterable[tuple[int, str, RosMessage]], begin_ns: int, end_ns: int
    ) -> None:
        """Begin at ``begin_ns``; the graph shuts down at ``end_ns``.

        Args:
            messages: Stamp [ns], topic's name of ROS 1, and message.
            begin_ns: First time [ns].
            end_ns: Time from which the graph is shut down [ns].
        """
        super().__init__()
        self._waiting = sorted(messages, key=lambda entry: entry[0])
        self.begin_ns, self._end_ns, self._now_ns = begin_ns, end_ns, begin_ns
        self._subscribers: dict[str, tuple[Topic, Callable[[Topic, RosMessage], None]]] = {}

    @classmethod
    def of_bag(cls, path: Path) -> "PlayedGraph":
        """Return a graph that plays a recording and shuts down with its last message."""
        with Bag(path) as bag:
            messages = [(m.stamp_ns, m.topic, m.content) for m in bag.messages()]
        return cls(messages, messages[0][0], messages[-1][0])

    @property
    def is_shutdown(self) -> bool:
        """True from the end on."""
        return self._now_ns >= self._end_ns

    def now_ns(self) -> int:
        """Return the time [ns]."""
        return self._now_ns

    def wait_for_clock(self) -> None:
        """Return at once."""

    def sleep_until(self, stamp_ns: int) -> None:
        """Let the time pass and deliver the messages up to it."""
        self._now_ns = max(self._now_ns, stamp_ns)
        while self._waiting and self._waiting[0][0] <= self._now_ns:
            _, name, message = self._waiting.pop(0)
            if name in self._subscribers:
                topic, take = self._subscribers[name]
                take(topic, message)

    def subscribe(self, topic: Topic, take: Callable[[Topic, RosMessage], None]) -> None:
        """Deliver messages of a topic to a function."""
        self._subscribers[topic.ros1] = topic, take

    def advertise(self, topic: Topic, latch: bool = False) -> None:
        """Do nothing."""

    def close(self) -> None:
        """Do nothing."""
