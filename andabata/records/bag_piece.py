"""A piece of a recording, read like a recording of its own that has one clock."""

import heapq
from collections.abc import Iterator, Mapping
from dataclasses import replace

from andabata.records.bags import Bag, Message
from andabata.records.clocks import Clock, Stamps
from andabata.records.messages import NS, header_ns
from andabata.records.pieces import Piece
from andabata.records.topics import RosMessage

_LATCHED = ("/tf_static", "tf_static")
"""Topics that hold for all pieces, whenever they were sent."""


_REORDERED = NS
"""Longest time by which the spread readings of a burst change their place [ns]."""


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
        clock = self._piece.clock
        inside = self._recorded(topics)
        if clock.spread:
            inside = in_order(spread_out(inside, clock.spread))
        for message in inside:
            yield message if clock.is_identity else _convert(message, clock)

    def _recorded(self, topics: tuple[str, ...] | None) -> Iterator[Message]:
        """Yield the messages of the piece as they were recorded."""
        begin, end = self._piece.begin_ns, self._piece.end_ns
        for message in self._bag.messages(topics):
            if message.stamp_ns >= end and topics is not None and not set(_LATCHED) & set(topics):
                return
            if begin <= message.stamp_ns < end or message.topic in _LATCHED:
                yield message


def spread_out(messages: Iterator[Message], spread: Mapping[str, Stamps]) -> Iterator[Message]:
    """Yield messages with the stamps of topics that came in bursts replaced by even ones.

    Args:
        messages: All messages of these topics in the piece, as they were recorded.
        spread: Stamps by topic [ns].
    """
    counts = dict.fromkeys(spread, 0)
    for message in messages:
        if message.topic not in spread:
            yield message
            continue
        stamp = int(spread[message.topic][counts[message.topic]])
        counts[message.topic] += 1
        content = message.content
        if hasattr(content, "header"):
            # The recorder's time goes along: a robot gets its readings when they are measured.
            later = stamp - (header_ns(content) or message.stamp_ns)
            yield replace(
                message, stamp_ns=message.stamp_ns + later, content=with_stamp(content, stamp)
            )
        else:
            yield replace(message, stamp_ns=stamp)


def in_order(messages: Iterator[Message]) -> Iterator[Message]:
    """Yield messages in the order of their times, which lie up to ``_REORDERED`` apart."""
    waiting: list[tuple[int, int, Message]] = []
    for k, message in enumerate(messages):
        heapq.heappush(waiting, (message.stamp_ns, k, message))
        while waiting[0][0] < message.stamp_ns - _REORDERED:
            yield heapq.heappop(waiting)[2]
    while waiting:
        yield heapq.heappop(waiting)[2]


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
