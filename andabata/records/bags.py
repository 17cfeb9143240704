"""Recordings: ROS 1 bags, MCAP files and ROS 2 folders, written and read without ROS."""

import hashlib
import json
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, Self

from andabata.records import atomic_io
from andabata.records.containers.container import (
    BagError,
    Connection,
    Container,
    RawMessage,
)
from andabata.records.containers.opening import open_container
from andabata.records.deserialization import (
    Deserialize,
    Deserializers,
    UnreadableConnectionError,
    one_line,
)
from andabata.records.topics import Ros, RosMessage, Topic, message_types

__all__ = [
    "Bag",
    "BagError",
    "LeftOut",
    "Message",
    "MessageWriter",
    "open_writer",
    "readable",
    "write_manifest",
]

_CHUNK_BYTES = 1 << 20
"""Size of an MCAP chunk [bytes]: a killed recorder loses at most the last one."""

_LIBRARY = "andabata"


@dataclass(frozen=True)
class Message:
    """Recorded message.

    Attributes:
        topic: Name of its topic.
        kind: Message type, as ``package/msg/Name``.
        stamp_ns: Time of recording [ns].
        content: Message, as an object of rosbags.
    """

    topic: str
    kind: str
    stamp_ns: int
    content: RosMessage


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
    text = json.dumps({"sha256": sums, **about}, indent=1, sort_keys=True)
    atomic_io.write(manifest, text.encode())
    return manifest


def _sha256(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


@dataclass(frozen=True)
class LeftOut:
    """Messages of a recording that could not be read.

    Attributes:
        topic: Name of their topic; None if damage hides it.
        messages: Number of messages; None if it is unknown.
        reason: Sentence with what was expected and what was found.
    """

    topic: str | None
    messages: int | None
    reason: str

    def __str__(self) -> str:
        """Return topic, number and reason in words."""
        count = "messages" if self.messages is None else f"{self.messages} messages"
        return f"{self.topic or 'damage'}: {count} left out: {self.reason}"


class Bag:
    """Reader of a recording, to be used in a ``with`` statement.

    Connections whose type cannot be read, and messages that cannot be deserialised, are skipped
    and listed by ``left_out``.

    Attributes:
        path: Path of the recording.
    """

    def __init__(self, path: Path, damaged: bool = False) -> None:
        """Choose a recording without opening it.

        Args:
            path: Path of a ``.bag``, ``.mcap`` or ``.db3`` file, or of a ROS 2 folder.
            damaged: True to read the whole messages of a damaged recording, too.

        Raises:
            BagError: If the path does not exist.
        """
        if not path.exists():
            raise BagError(
                f"{path}: expected a .bag, an .mcap or a ROS 2 folder, got nothing; check the path"
            )
        self.path = path
        self._damaged = damaged
        self._container: Container | None = None
        self._decoders: dict[int, Deserialize] = {}
        self._reasons: dict[int, str] = {}
        self._undecoded: dict[str, tuple[int, str]] = {}

    def __enter__(self) -> Self:
        """Open the recording.

        Raises:
            BagError: If it cannot be read, or is damaged although ``damaged`` is False.
        """
        with readable(self.path):
            self._container = open_container(self.path)
        try:
            if self._container.damage and not self._damaged:
                raise BagError(
                    f"{self.path}: expected a whole recording, got damage: "
                    f"{self._container.damage[0].reason}; `andabata bag salvage {self.path.name} "
                    "--out NEW` keeps what is whole"
                )
            if self._container.damage and not any(self._container.counts):
                raise BagError(
                    f"{self.path}: expected messages, got none that is whole: "
                    f"{self._container.damage[0].reason}"
                )
            self._make_decoders()
        except BaseException:
            self._container.close()
            raise
        return self

    def _make_decoders(self) -> None:
        """Create a decoder for every connection whose type can be read."""
        decoders = Deserializers()
        for number, connection in enumerate(self.connections):
            try:
                self._decoders[number] = decoders.deserializer(connection)
            except UnreadableConnectionError as error:
                self._reasons[number] = str(error)

    def __exit__(self, *_: object) -> None:
        """Close the recording."""
        self._opened.close()

    @property
    def _opened(self) -> Container:
        """Container of the open recording.

        Raises:
            BagError: If the recording is not open.
        """
        if self._container is None:
            raise BagError(f"{self.path}: expected an open recording; use it in a with statement")
        return self._container

    @property
    def connections(self) -> Sequence[Connection]:
        """All connections; several may have the same topic."""
        return self._opened.connections

    @property
    def counts(self) -> Sequence[int]:
        """Numbers of whole messages by connection."""
        return self._opened.counts

    @property
    def topics(self) -> dict[str, tuple[str, int]]:
        """Message type, the first that can be read, and number of messages by topic."""
        found: dict[str, tuple[str, int]] = {}
        order = sorted(range(len(self.connections)), key=lambda k: k not in self._decoders)
        for k in order:
            connection = self.connections[k]
            kind, count = found.get(connection.topic, (connection.kind, 0))
            found[connection.topic] = (kind, count + self.counts[k])
        return found

    @property
    def unreadable(self) -> dict[str, str]:
        """Reasons by topic of which no message can be read."""
        readable = {self.connections[k].topic for k in self._decoders}
        return {
            topic: reason
            for k, reason in self._reasons.items()
            if (topic := self.connections[k].topic) not in readable
        }

    @property
    def notes(self) -> Sequence[str]:
        """Facts that a user should know although no message is missing."""
        return self._opened.notes

    @property
    def left_out(self) -> list[LeftOut]:
        """Messages that could not be read: known since the opening, or found by ``messages``."""
        found = [
            LeftOut(self.connections[k].topic, self.counts[k], reason)
            for k, reason in self._reasons.items()
            if self.counts[k]
        ]
        found += [LeftOut(topic, *about) for topic, about in sorted(self._undecoded.items())]
        damage = self._opened.damage
        if damage:
            more = f" (and {len(damage) - 1} more)" if len(damage) > 1 else ""
            offset = f" at byte {damage[0].offset:,}" if damage[0].size else ""
            found.append(LeftOut(None, self._opened.lost, f"{damage[0].reason}{offset}{more}"))
        return found

    def messages(self, topics: tuple[str, ...] | None = None) -> Iterator[Message]:
        """Yield messages in the order of their times of recording.

        Args:
            topics: Names of topics; None for all.

        Raises:
            BagError: If the recording is damaged.
        """
        chosen = {
            k for k in self._decoders if topics is None or self.connections[k].topic in topics
        }
        for topic in {self.connections[k].topic for k in chosen}:
            self._undecoded.pop(topic, None)  # A second pass counts anew.
        for raw in self.raw_messages(chosen):
            message = self.decode(raw)
            if message is not None:
                yield message

    def raw_messages(self, connections: Collection[int] | None = None) -> Iterator[RawMessage]:
        """Yield serialised messages in the order of their times of recording.

        Args:
            connections: Indices of ``connections``; None for all.

        Raises:
            BagError: If the recording is damaged.
        """
        chosen = range(len(self.connections)) if connections is None else connections
        with readable(self.path):
            yield from self._opened.read(chosen)

    def decode(self, raw: RawMessage) -> Message | None:
        """Return a deserialised message; None, and counted as left out, if that fails."""
        connection = self.connections[raw.connection]
        decode = self._decoders.get(raw.connection)
        if decode is None:
            return None  # Counted with its connection.
        try:
            content = decode(raw.data)
        except Exception as error:  # Flipped bits cause many kinds of errors.
            reason = f"expected a {connection.kind}, got {one_line(error)}"
            count, reason = self._undecoded.get(connection.topic, (0, reason))
            self._undecoded[connection.topic] = (count + 1, reason)
            return None
        return Message(connection.topic, connection.kind, raw.stamp_ns, content)


@contextmanager
def readable(path: Path) -> Iterator[None]:
    """Convert every error that libraries raise on a damaged recording to one ``BagError``.

    Flipped bits cause KeyError, UnicodeDecodeError, OverflowError, MemoryError, AssertionError.

    Args:
        path: Path of the recording.

    Raises:
        BagError: If the block raises an error other than a failure to open the file.
    """
    try:
        yield
    except BagError:
        raise
    except Exception as error:
        if isinstance(error, OSError) and error.filename is not None:
            raise  # The file can't be opened; a failed seek in a damaged file has no filename.
        raise BagError(
            f"{path}: expected a whole recording, got {one_line(error)}; "
            f"`andabata bag salvage {path.name} --out NEW` keeps what is whole"
        ) from error
