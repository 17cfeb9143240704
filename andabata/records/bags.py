"""Reads recordings: ROS 1 bags, MCAP files and ROS 2 folders, without ROS."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from andabata.records.containers.container import (
    BagError,
    Connection,
    Container,
    RawMessage,
)
from andabata.records.containers.opening import open_container
from andabata.records.decoding.source_choice import is_chosen
from andabata.records.deserialization import (
    Deserialize,
    Deserializers,
    UnreadableConnectionError,
    one_line,
)
from andabata.records.manifest import changed_files
from andabata.records.topics import RosMessage

__all__ = [
    "Bag",
    "BagError",
    "LeftOut",
    "Message",
    "readable",
]


@dataclass(frozen=True)
class Message:
    """Recorded message.

    Attributes:
        topic: Name of its topic.
        kind: Message type, as ``package/msg/Name``.
        stamp_ns: Time of recording [ns].
        content: Message, as an object of rosbags.
        publisher: Name of the publishing node; empty if it is not recorded.
    """

    topic: str
    kind: str
    stamp_ns: int
    content: RosMessage
    publisher: str = ""


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
        sources: Frame, node or joints of the only source that is read, by topic; set before
            reading where several publish on one topic.
    """

    def __init__(self, path: Path, damaged: bool = False) -> None:
        """Choose a recording without opening it.

        Args:
            path: Path of a ``.bag``, ``.mcap`` or ``.db3`` file, or of a ROS 2 folder.
            damaged: True to read the whole messages of a damaged recording, too, and to compare
                its files with the manifest beside it.

        Raises:
            BagError: If the path does not exist.
        """
        if not path.exists():
            raise BagError(
                f"{path}: expected a .bag, an .mcap or a ROS 2 folder, got nothing; check the path"
            )
        self.path = path
        self.sources: dict[str, str] = {}
        self._damaged = damaged
        self._container: Container | None = None
        self._decoders: dict[int, Deserialize] = {}
        self._reasons: dict[int, str] = {}
        self._replaced: tuple[str, ...] = ()
        self._undecoded: dict[str, tuple[int, str]] = {}
        self._changed = ""

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
            if self._damaged and not self._container.damage:
                self._changed = changed_files(self.path)
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
        self._replaced = tuple(decoders.notes)

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
        types_and_counts: dict[str, tuple[str, int]] = {}
        order = sorted(range(len(self.connections)), key=lambda k: k not in self._decoders)
        for k in order:
            connection = self.connections[k]
            kind, count = types_and_counts.get(connection.topic, (connection.kind, 0))
            types_and_counts[connection.topic] = (kind, count + self.counts[k])
        return types_and_counts

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
        return [*self._opened.notes, *self._replaced]

    @property
    def left_out(self) -> list[LeftOut]:
        """Messages that could not be read: known since the opening, or found by ``messages``."""
        unread = [
            LeftOut(self.connections[k].topic, self.counts[k], reason)
            for k, reason in self._reasons.items()
            if self.counts[k]
        ]
        unread += [LeftOut(topic, *about) for topic, about in sorted(self._undecoded.items())]
        damage = self._opened.damage
        if damage:
            more = f" (and {len(damage) - 1} more)" if len(damage) > 1 else ""
            offset = f" at byte {damage[0].offset:,}" if damage[0].size else ""
            unread.append(LeftOut(None, self._opened.lost, f"{damage[0].reason}{offset}{more}"))
        elif self._changed:
            unread.append(LeftOut(None, 0, self._changed))
        return unread

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
            if message is not None and self._is_chosen(message):
                yield message

    def _is_chosen(self, message: Message) -> bool:
        """Return whether a message is of the source that is read."""
        return is_chosen(message.topic, message.content, message.publisher, self.sources)

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
        return Message(
            connection.topic, connection.kind, raw.stamp_ns, content, connection.publisher
        )


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
