"""Connections, raw messages and damage of a recording, independent of its format."""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol


class BagError(ValueError):
    """A recording that cannot be read or written."""


@dataclass(frozen=True)
class Connection:
    """Stream of messages of one publisher: a ROS 1 connection, an MCAP channel, a ROS 2 topic.

    Attributes:
        topic: Name of the topic.
        kind: Message type, as ``package/msg/Name`` if it is one of ROS.
        encoding: Encoding of the messages: ``ros1``, ``cdr`` or another.
        definition: Definition of the type; empty if the recording holds none.
        definition_format: Format of the definition: ``ros1msg``, ``ros2msg``, ``ros2idl`` or
            another; ``standard`` if the recording's format has no field for definitions.
        publisher: Name of the publishing node; empty if it is not recorded.
        latching: True if the publisher sends its last message to later subscribers.
        qos: Quality of service of ROS 2 publishers, as recorded.
        digest: Checksum (MD5) of a ROS 1 type; empty if it is not recorded.
    """

    topic: str
    kind: str
    encoding: str
    definition: str
    definition_format: str
    publisher: str = ""
    latching: bool = False
    qos: str = ""
    digest: str = ""


@dataclass(frozen=True)
class Damage:
    """Unreadable part of a file.

    Attributes:
        offset: Offset of its first byte.
        size: Number of bytes.
        reason: Sentence with what was expected and what was found.
        messages: Number of messages that it held; None if it is unknown.
    """

    offset: int
    size: int
    reason: str
    messages: int | None = None


@dataclass(frozen=True)
class RawMessage:
    """Serialised message.

    Attributes:
        connection: Index of its connection.
        stamp_ns: Time of recording [ns].
        data: Bytes of the message.
    """

    connection: int
    stamp_ns: int
    data: bytes


class Container(Protocol):
    """File or folder of messages, scanned from begin to end.

    Attributes:
        connections: Connections of the recording.
        counts: Number of whole messages of each connection.
        damage: Parts that cannot be read.
        lost: Number of messages that the file once held and no longer holds; None if unknown.
        notes: Facts that a user should know although no message is missing.
        finished: True if the recorder finished it, as far as the format tells.
    """

    connections: list[Connection]
    counts: list[int]
    damage: list[Damage]
    lost: int | None
    notes: list[str]
    finished: bool

    def read(self, wanted: Collection[int]) -> Iterator[RawMessage]:
        """Yield the messages of some connections in the order of their times of recording."""

    def close(self) -> None:
        """Close the files."""


def ros_type_name(name: str) -> str:
    """Return a type's name as ``package/msg/Name``, from the form of ROS 1 or ROS 2."""
    return name.replace("/", "/msg/", 1) if name.count("/") == 1 else name


def is_latched(qos: str) -> bool:
    """Return True if a quality of service of ROS 2 sends the last message to later subscribers."""
    return "transient_local" in qos or re.search(r"durability: 1\b", qos) is not None


def count_mismatches(
    connections: Sequence[Connection], counts: Sequence[int], stated: Mapping[int, int]
) -> list[str]:
    """Return a sentence for each topic whose number of messages in the index is wrong.

    Args:
        connections: Connections of the recording.
        counts: Number of messages found of each connection.
        stated: Number of messages by the index of a connection, as the file's index has it.
    """
    topics: dict[str, list[int]] = {}
    for number, connection in enumerate(connections):
        tally = topics.setdefault(connection.topic, [0, 0])
        tally[0] += counts[number]
        tally[1] += stated.get(number, 0)
    return [
        f"{topic}: the index counts {indexed} messages, the file holds {held}"
        for topic, (held, indexed) in sorted(topics.items())
        if held != indexed
    ]
