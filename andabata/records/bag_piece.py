"""A piece of a recording, read like a recording of its own that has one clock."""

from collections.abc import Iterator
from dataclasses import replace

from andabata.records.bags import Bag, Message
from andabata.records.clocks import Clock
from andabata.records.messages import NS, header_ns
from andabata.records.pieces import Piece
from andabata.records.topics import RosMessage

_LATCHED = ("/tf_static", "tf_static")
"""Topics that hold for all pieces, whenever they were sent."""


class BagPiece(Bag):
    """A piece of an open recording, with all stamps converted into the piece's clock."""

    def __init__(self, bag: Bag, piece: Piece) -> None:
        """Create a view of a recording.

        Args:
            bag: Open recording.
            piece: Part of it to read.
        """
        self.path = bag.path
        self._bag, self._piece = bag, piece

    @property
    def topics(self) -> dict[str, tuple[str, int]]:
        """Type and number of messages by topic, of the whole recording."""
        return self._bag.topics

    def messages(self, topics: tuple[str, ...] | None = None) -> Iterator[Message]:
        """Yield the messages of the piece, stamped by its clock; see ``Bag.messages``."""
        begin, end, clock = self._piece.begin_ns, self._piece.end_ns, self._piece.clock
        for message in self._bag.messages(topics):
            if message.stamp_ns >= end and topics is not None and not set(_LATCHED) & set(topics):
                return
            inside = begin <= message.stamp_ns < end
            if not inside and message.topic not in _LATCHED:
                continue
            yield message if clock.is_identity else _convert(message, clock)


def _convert(message: Message, clock: Clock) -> Message:
    """Return a message with the recorder's stamp, and the header's if needed, by a clock."""
    stamp, content = clock.convert(message.stamp_ns), message.content
    if message.topic in clock.header_offsets and hasattr(content, "header"):
        offset = clock.header_offsets[message.topic]
        if offset is None:
            content = with_stamp(content, stamp - clock.durations.get(message.topic, 0))
        else:
            content = with_stamp(content, header_ns(content) + offset)
    return replace(message, stamp_ns=stamp, content=content)


def with_stamp(content: RosMessage, stamp_ns: int) -> RosMessage:
    """Return a message with another stamp [ns] in its header."""
    second, rest = divmod(stamp_ns, NS)
    time = replace(content.header.stamp, sec=second, nanosec=rest)
    return replace(content, header=replace(content.header, stamp=time))
