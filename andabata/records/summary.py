"""Summary of a recording: topics, types, counts, rates, and unreadable messages."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from andabata.records.bags import Bag, LeftOut


@dataclass(frozen=True)
class TopicSummary:
    """Summary of one topic.

    Attributes:
        topic: Name of the topic.
        kinds: Message types, as ``package/msg/Name``; nearly always one.
        messages: Number of whole messages in the file.
        rate_hz: Mean rate of the messages [Hz]; None for fewer than two messages.
        connections: Number of connections or channels.
        publishers: Names of the publishing nodes, as far as they are recorded.
        latching: True if a publisher latched its last message.
        reason: Reason why some or all of its messages cannot be read; empty if all can be.
        readable: True if messages of it can be read.
    """

    topic: str
    kinds: tuple[str, ...]
    messages: int
    rate_hz: float | None
    connections: int
    publishers: tuple[str, ...]
    latching: bool
    reason: str
    readable: bool

    def to_json(self) -> dict[str, Any]:
        """Return the summary, ready for JSON."""
        return {
            "topic": self.topic,
            "type": ", ".join(self.kinds),
            "messages": self.messages,
            "rate_hz": self.rate_hz,
            "connections": self.connections,
            "readable": self.readable,
            "publishers": list(self.publishers),
            "latching": self.latching,
            "reason": self.reason or None,
        }


@dataclass(frozen=True)
class BagSummary:
    """Summary of a recording.

    Attributes:
        topics: Summaries of all topics, by name.
        duration_s: Time from the first message to the last [s].
        left_out: Messages that cannot be read.
        damaged: True if a part of the file cannot be read.
        notes: Facts that a user should know although no message is missing.
    """

    topics: tuple[TopicSummary, ...]
    duration_s: float
    left_out: tuple[LeftOut, ...]
    damaged: bool
    notes: tuple[str, ...]


def summarise(path: Path, on_message: Callable[[], None] | None = None) -> BagSummary:
    """Return the summary of a recording; every message is deserialised once.

    Args:
        path: Path of the recording.
        on_message: Function called after each message.

    Raises:
        BagError: If it holds no message that can be read.
    """
    spans: dict[str, tuple[int, int]] = {}
    with Bag(path, damaged=True) as bag:
        for raw in bag.raw_messages():
            topic = bag.connections[raw.connection].topic
            first, _ = spans.get(topic, (raw.stamp_ns, 0))
            spans[topic] = (first, raw.stamp_ns)
            bag.decode(raw)
            if on_message is not None:
                on_message()
        topics = tuple(_topic(bag, topic, spans.get(topic)) for topic in sorted(bag.topics))
        left_out, notes = tuple(bag.left_out), tuple(bag.notes)
    begin = min((first for first, _ in spans.values()), default=0)
    end = max((last for _, last in spans.values()), default=0)
    damaged = any(each.topic is None for each in left_out)
    return BagSummary(topics, (end - begin) / 1e9, left_out, damaged, notes)


def _topic(bag: Bag, topic: str, span: tuple[int, int] | None) -> TopicSummary:
    """Return the summary of one topic; ``span`` holds its first and last stamps [ns]."""
    places = [k for k, each in enumerate(bag.connections) if each.topic == topic]
    own = [bag.connections[k] for k in places]
    count = sum(bag.counts[k] for k in places)
    seconds = (span[1] - span[0]) / 1e9 if span else 0.0
    reasons = [each.reason for each in bag.left_out if each.topic == topic]
    unreadable = bag.unreadable.get(topic)
    if unreadable and not reasons:
        reasons = [unreadable]  # A topic without messages has none to leave out.
    return TopicSummary(
        topic,
        tuple(dict.fromkeys(each.kind or "(none)" for each in own)),
        count,
        (count - 1) / seconds if count > 1 and seconds > 0 else None,
        len(own),
        tuple(sorted({each.publisher for each in own if each.publisher})),
        any(each.latching for each in own),
        "; ".join(dict.fromkeys(reasons)),
        unreadable is None,
    )
