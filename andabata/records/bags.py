"""Recordings: ROS 1 bags, MCAP and ROS 2 folders, written and read without ROS."""

import hashlib
import json
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, Self

from andabata.records.storage import write_atomically
from andabata.records.topics import Ros, RosMessage, Topic, message_types

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

_CHUNK = 1 << 20
"""Bytes that a killed recorder may lose."""

_LIBRARY = "andabata"


class BagError(ValueError):
    """A recording that cannot be read or written."""


@dataclass(frozen=True)
class Message:
    """One recorded message.

    Attributes:
        topic: Its topic's name.
        kind: Its type, as ``package/msg/Name``.
        stamp_ns: When it was recorded [ns].
        content: The message, as rosbags makes it.
    """

    topic: str
    kind: str
    stamp_ns: int
    content: RosMessage


class MessageWriter(Protocol):
    """Whatever takes messages: a file, or a live graph."""

    ros: Ros

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Take a message; ``stamp_ns`` is when the robot has it [ns]."""

    def close(self) -> None:
        """Finish the file."""


class RosbagWriter:
    """A ROS 1 bag, or a ROS 2 folder with an sqlite3 file, by rosbags."""

    def __init__(self, path: Path, ros: Ros) -> None:
        """Begin a file that is not there yet."""
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
        """Record a message."""
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
    """One MCAP file with checksums and definitions embedded; most of it outlives a kill."""

    ros: Ros = 2

    def __init__(self, path: Path) -> None:
        """Begin a file."""
        from mcap.writer import CompressionType, Writer

        self._types = message_types(2)
        self._file = path.open("wb")
        self._writer = Writer(self._file, chunk_size=_CHUNK, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library=_LIBRARY)
        self._channels: dict[str, tuple[int, str]] = {}
        self._count = 0

    def write(self, topic: Topic, stamp_ns: int, message: RosMessage) -> None:
        """Record a message."""
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
    """Return a writer for a path that ends in ``.bag`` (ROS 1), ``.mcap`` or ``.db3`` (ROS 2).

    A ``.db3`` path names the folder that holds the sqlite3 file, as ROS 2 wants it.

    Raises:
        BagError: If the suffix is another, or something is there already.
    """
    if path.exists():
        raise BagError(f"{path}: expected a new file, got one that is there; choose another name")
    match path.suffix:
        case ".bag":
            return RosbagWriter(path, 1)
        case ".mcap":
            return McapWriter(path)
        case ".db3":
            return RosbagWriter(path, 2)
    raise BagError(f"{path}: expected a name in .bag, .mcap or .db3, got {path.suffix!r}")


def write_manifest(path: Path, about: dict[str, Any]) -> Path:
    """Write a recording's SHA-256 beside it, with what is known about it; return where."""
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    sums = {file.name: _sha256(file) for file in files if file.is_file()}
    where = path.with_name(f"{path.name}.json")
    text = json.dumps({"sha256": sums, **about}, indent=1, sort_keys=True)
    write_atomically(where, text.encode())
    return where


def _sha256(path: Path) -> str:
    """Return a file's digest."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


class Bag:
    """A recording to read; use it in a ``with`` statement.

    Attributes:
        path: Where it lies.
    """

    def __init__(self, path: Path) -> None:
        """Name a recording.

        Raises:
            BagError: If there is none.
        """
        if not path.exists():
            raise BagError(f"{path}: expected a .bag, an .mcap or a ROS 2 folder, got nothing")
        self.path = path
        self._reader: Any = None

    def __enter__(self) -> Self:
        """Open it.

        Raises:
            BagError: If it cannot be read.
        """
        with _readable(self.path):
            if self.path.suffix == ".mcap" and self.path.is_file():
                self._reader = _McapReader(self.path)
            else:
                self._reader = _AnyReader(self.path)
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self._reader.close()

    @property
    def topics(self) -> dict[str, tuple[str, int]]:
        """Type and number of messages by topic."""
        found: dict[str, tuple[str, int]] = self._reader.topics
        return found

    def messages(self, topics: tuple[str, ...] | None = None) -> Iterator[Message]:
        """Yield messages by the time at which they were recorded.

        Args:
            topics: Names of topics; None for all.

        Raises:
            BagError: If the recording is damaged.
        """
        with _readable(self.path):
            yield from self._reader.messages(topics)


class _AnyReader:
    """ROS 1 bags and ROS 2 folders, by rosbags."""

    def __init__(self, path: Path) -> None:
        from rosbags.highlevel import AnyReader

        ros: Ros = 1 if path.suffix == ".bag" else 2
        self._reader = AnyReader([path], default_typestore=message_types(ros))
        self._reader.open()

    @property
    def topics(self) -> dict[str, tuple[str, int]]:
        return {
            name: (str(info.msgtype), int(info.msgcount))
            for name, info in self._reader.topics.items()
        }

    def messages(self, topics: tuple[str, ...] | None) -> Iterator[Message]:
        chosen = [c for c in self._reader.connections if topics is None or c.topic in topics]
        if not chosen:
            return
        for connection, stamp, data in self._reader.messages(connections=chosen):
            content = self._reader.deserialize(data, connection.msgtype)
            yield Message(connection.topic, connection.msgtype, int(stamp), content)

    def close(self) -> None:
        self._reader.close()


class _McapReader:
    """MCAP files, checksums looked at."""

    def __init__(self, path: Path) -> None:
        self._types: dict[str, Typestore] = {}
        self._file = path.open("rb")
        try:
            self._open(path)
        except BaseException:
            self._file.close()
            raise

    def _open(self, path: Path) -> None:
        from mcap.reader import make_reader

        self._reader = make_reader(self._file, validate_crcs=True)
        summary = self._reader.get_summary()
        if summary is None or summary.statistics is None:
            raise BagError(
                f"{path}: expected a finished file, got one without its summary; "
                "`andabata bag salvage` keeps what is whole"
            )
        counts = summary.statistics.channel_message_counts
        self.topics = {
            channel.topic: (summary.schemas[channel.schema_id].name, counts.get(number, 0))
            for number, channel in summary.channels.items()
        }

    def messages(self, topics: tuple[str, ...] | None) -> Iterator[Message]:
        chosen = None if topics is None else list(topics)
        for schema, channel, message in self._reader.iter_messages(topics=chosen):
            if schema is None or channel.message_encoding != "cdr":
                continue
            store = types_of(schema.name, schema.data.decode(), self._types)
            content = store.deserialize_cdr(message.data, schema.name)
            yield Message(channel.topic, schema.name, int(message.log_time), content)

    def close(self) -> None:
        self._file.close()


def types_of(kind: str, definition: str, known: "dict[str, Typestore]") -> "Typestore":
    """Return a store that knows a type by its embedded definition."""
    if kind not in known:
        from rosbags.typesys import Stores, get_types_from_msg, get_typestore

        store = get_typestore(Stores.EMPTY)
        store.register(get_types_from_msg(definition, kind))
        known[kind] = store
    return known[kind]


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    """Turn whatever a damaged recording makes the libraries raise into one error.

    Bit flips leak KeyError, UnicodeDecodeError, OverflowError, MemoryError and AssertionError.
    """
    try:
        yield
    except BagError:
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.filename is not None:
            raise  # The file can't be opened; a seek beyond damage has no name.
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise BagError(
            f"{path}: expected a whole recording, got {reason}; "
            "`andabata bag salvage` keeps what is whole of an MCAP file"
        ) from error
