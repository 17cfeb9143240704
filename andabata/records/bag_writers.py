"""Writes recordings: ROS 1 bags, MCAP files and ROS 2 folders, without ROS."""

import hashlib
from pathlib import Path
from typing import Any, Protocol

from andabata.records.containers.container import BagError
from andabata.records.topics import Ros, RosMessage, Topic, message_types
from andabata.runs import atomic_io
from andabata.runs.strict_json import dumps

_CHUNK_BYTES = 1 << 20
"""Size of an MCAP chunk [bytes]: a killed recorder loses at most the last one."""


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


class RosbagWriter:
    """Writer of a ROS 1 bag, or of a ROS 2 folder with an sqlite3 file, by rosbags."""

    def __init__(self, path: Path, ros: Ros) -> None:
        """Create a file that does not exist yet."""
        self.ros: Ros = ros
        self._types = message_types(ros)
        self._connections: dict[str, Any] = {}
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
        kind = topic.type_name(self.ros)
        if topic.ros1 not in self._connections:
            self._connections[topic.ros1] = self._writer.add_connection(
                topic.name(self.ros), kind, typestore=self._types
            )
        encode = self._types.serialize_ros1 if self.ros == 1 else self._types.serialize_cdr
        self._writer.write(self._connections[topic.ros1], stamp_ns, encode(message, kind))

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

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Write a message."""
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


def write_manifest(path: Path, about: dict[str, Any]) -> Path:
    """Write a manifest beside a recording: SHA-256 of its files, and other facts.

    Args:
        path: Path of the recording.
        about: Facts about the recording, ready for JSON.

    Returns:
        Path of the manifest.
    """
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    sums = {file.name: _sha256(file) for file in files if file.is_file()}
    manifest = path.with_name(f"{path.name}.json")
    text = dumps({"sha256": sums, **about}, indent=1, sort_keys=True)
    atomic_io.write(manifest, text.encode())
    return manifest


def _sha256(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
