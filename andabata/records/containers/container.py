"""Connections, raw messages and damage of a recording's file, the same for every format."""

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol


class BagError(ValueError):
    """A recording that cannot be read or written."""


@dataclass(frozen=True)
class Connection:
    """One publisher's stream of messages: a ROS 1 connection, an MCAP channel, a ROS 2 topic.

    Attributes:
        topic: Topic's name.
        kind: Message type, as ``package/msg/Name`` where it is one of ROS.
        encoding: Encoding of the messages: ``ros1``, ``cdr`` or another.
        definition: Definition of the type; empty where the recording holds none.
        definition_format: ``ros1msg``, ``ros2msg``, ``ros2idl`` or another; ``standard`` where
            the format of the recording has no place for definitions.
        publisher: Name of the publishing node; empty where the recording doesn't tell.
        latching: Whether the publisher repeats its last message to who comes later.
        qos: Quality of service of ROS 2 publishers, as the recording holds it.
        digest: Checksum of ROS 1 of the type; empty where the recording doesn't tell.
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
    """One stretch of a file that cannot be read.

    Attributes:
        place: Offset of its first byte.
        size: Number of bytes.
        reason: What was expected and what came.
        messages: Number of messages that it held, as far as the file tells; None if it doesn't.
    """

    place: int
    size: int
    reason: str
    messages: int | None = None


@dataclass(frozen=True)
class RawMessage:
    """One message as it is stored.

    Attributes:
        connection: Index of its connection.
        stamp_ns: When it was recorded [ns].
        data: Serialised message.
    """

    connection: int
    stamp_ns: int
    data: bytes


class Container(Protocol):
    """A file or folder of messages, scanned from begin to end.

    Attributes:
        connections: All connections.
        counts: Number of whole messages of each connection.
        damage: What cannot be read.
        lost: Number of messages that the file once held and holds no more; None if not known.
        notes: What a user should know although no message is missing.
    """

    connections: list[Connection]
    counts: list[int]
    damage: list[Damage]
    lost: int | None
    notes: list[str]

    def read(self, wanted: Collection[int]) -> Iterator[RawMessage]:
        """Yield the messages of some connections by the time at which they were recorded."""

    def close(self) -> None:
        """Close the files."""


def ros_type_name(name: str) -> str:
    """Return a type's name as ``package/msg/Name``, whatever ROS wrote it."""
    return name.replace("/", "/msg/", 1) if name.count("/") == 1 else name


def is_latched(qos: str) -> bool:
    """Return whether ROS 2's quality of service keeps the last message for who comes later."""
    return "transient_local" in qos or re.search(r"durability: 1\b", qos) is not None


def count_mismatches(
    connections: Sequence[Connection], counts: Sequence[int], stated: Mapping[int, int]
) -> list[str]:
    """Return a sentence for each topic of which the index tells another number of messages.

    Args:
        connections: All connections.
        counts: Number of messages found of each connection.
        stated: Number of messages that the index tells, by connection.
    """
    topics: dict[str, list[int]] = {}
    for number, connection in enumerate(connections):
        found = topics.setdefault(connection.topic, [0, 0])
        found[0] += counts[number]
        found[1] += stated.get(number, 0)
    return [
        f"{topic}: the index tells of {told} messages, the file holds {held}"
        for topic, (held, told) in sorted(topics.items())
        if held != told
    ]
