"""Writes recordings: ROS 1 bags, MCAP files and ROS 2 folders, without ROS."""

from pathlib import Path
from typing import Any, Protocol

from andabata.records.containers.container import BagError
from andabata.records.topics import Ros, RosMessage, Topic, message_types

_CHUNK_BYTES = 1 << 20
"""Largest size of an MCAP chunk [bytes]."""

_FLUSH_PERIOD = 1_000_000_000
"""Time between messages after which a recorder writes all it has [ns]: a kill loses no more."""

_LIBRARY = "andabata"


class MessageWriter(Protocol):
    """Sink of messages: a file, or a live graph.

    Attributes:
        ros: Version of ROS of the messages.
    """

    ros: Ros

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Write a message; ``stamp_ns`` is the time at which the robot has it [ns]."""

    def close(self) -> None:
        """Finish the file, or leave the graph."""


class _FlushTimer:
    """Decides by the stamps of messages when to flush: the same messages give the same bytes."""

    def __init__(self) -> None:
        self._begin: int | None = None

    def is_due(self, stamp_ns: int) -> bool:
        """Return True if a message is a period away from the first one since the last flush."""
        if self._begin is not None and abs(stamp_ns - self._begin) < _FLUSH_PERIOD:
            return False
        due = self._begin is not None
        self._begin = stamp_ns
        return due


class RosbagWriter:
    """Writer of a ROS 1 bag, or of a ROS 2 folder with an sqlite3 file, by rosbags."""

    def __init__(self, path: Path, ros: Ros) -> None:
        """Create a file that does not exist yet."""
        self.ros: Ros = ros
        self._types = message_types(ros)
        self._connections: dict[str, Any] = {}
        self._timer = _FlushTimer()
        self._writer: Any
        if ros == 1:
            from rosbags.rosbag1 import Writer

            self._writer = Writer(path)
        else:
            from rosbags.rosbag2 import Writer as Writer2

            self._writer = Writer2(path, version=9)
        self._writer.open()

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Write a message."""
        if self._timer.is_due(stamp_ns):
            self._flush()
        kind = topic.type_name(self.ros)
        if topic.ros1 not in self._connections:
            self._connections[topic.ros1] = self._writer.add_connection(
                topic.name(self.ros), kind, typestore=self._types
            )
        encode = self._types.serialize_ros1 if self.ros == 1 else self._types.serialize_cdr
        self._writer.write(self._connections[topic.ros1], stamp_ns, encode(message, kind))

    def _flush(self) -> None:
        """Hand all messages to the system: the chunk of a bag, or the transaction of sqlite3."""
        if self.ros == 1:
            self._writer.write_chunk(self._writer.chunks[-1])
            self._writer.bio.flush()
        else:
            self._writer.storage.conn.commit()

    def close(self) -> None:
        """Finish the file."""
        self._writer.close()


class McapWriter:
    """Writer of an MCAP file with embedded checksums and definitions, readable after a kill."""

    ros: Ros = 2

    def __init__(self, path: Path) -> None:
        """Create a file."""
        from mcap.writer import CompressionType, Writer

        self._types = message_types(2)
        self._file = path.open("wb")
        self._writer = Writer(self._file, chunk_size=_CHUNK_BYTES, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library=_LIBRARY)
        self._channels: dict[str, tuple[int, str]] = {}
        self._count = 0
        self._timer = _FlushTimer()

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Write a message."""
        if self._timer.is_due(stamp_ns):
            self._writer.flush()
        if topic.ros2 not in self._channels:
            kind = topic.type_name(2)
            text, _ = self._types.generate_msgdef(kind, ros_version=2)
            schema = self._writer.register_schema(kind, "ros2msg", text.encode())
            channel = self._writer.register_channel(topic.ros2, "cdr", schema)
            self._channels[topic.ros2] = (channel, kind)
        channel, kind = self._channels[topic.ros2]
        data = bytes(self._types.serialize_cdr(message, kind))
        self._writer.add_message(channel, stamp_ns, data, stamp_ns, self._count)
        self._count += 1

    def close(self) -> None:
        """Finish the file."""
        self._writer.finish()
        self._file.close()


def open_writer(path: Path) -> MessageWriter:
    """Return a writer of a new recording; the suffix of its path chooses the format.

    Args:
        path: Path that ends in ``.bag`` (ROS 1), ``.mcap`` or ``.db3`` (ROS 2). A ``.db3`` path
            names the folder that holds the sqlite3 file, as ROS 2 has it.

    Raises:
        BagError: If the suffix is another, or the path exists already.
    """
    if path.exists():
        raise BagError(f"{path}: expected a new file, got an existing one; choose another name")
    match path.suffix:
        case ".bag":
            return RosbagWriter(path, 1)
        case ".mcap":
            return McapWriter(path)
        case ".db3":
            return RosbagWriter(path, 2)
    raise BagError(f"{path}: expected a name in .bag, .mcap or .db3, got {path.suffix!r}")
