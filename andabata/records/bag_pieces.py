"""A recording as its pieces: looked through once for clocks and units, then read piece by piece."""

import json
from array import array
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from andabata.records import topics
from andabata.records.bags import Bag, Message
from andabata.records.clocks import NS, Clock, Piece, SenseStamps, cut_pieces
from andabata.records.messages import header_ns
from andabata.records.point_cloud2 import cloud_of
from andabata.records.recorder import SETUP
from andabata.records.remarks import Remarks
from andabata.records.sense_decoding import MessageDecoder, as_point_cloud2, type_of
from andabata.records.sense_units import History
from andabata.records.topics import RosMessage, Topic

_LAGS = {topics.IMU: 0.3, topics.ENCODERS: 0.3, topics.MAG: 0.3, topics.FIX: 3.0}
"""How much older than its record a sense may be before its clock is doubted [s]."""

_LASER_LAG = 1.0
"""The same of lasers, which send what they gathered for some time [s]."""

_FEW_CLOUDS = 5
"""Messages of a laser by which it is told how long one takes."""

_LATCHED = ("/tf_static", "tf_static")
"""Topics that hold for all pieces, whenever they were sent."""


@dataclass
class _Stamps:
    """Stamps of one topic as they are read."""

    recorder: "array[int]" = field(default_factory=lambda: array("q"))
    header: "array[int]" = field(default_factory=lambda: array("q"))
    spans: list[float] = field(default_factory=list)


class Survey:
    """What a recording tells of itself when it is looked through.

    Attributes:
        settings: Those of the drive, empty in a recording that is not ours.
        counts: Number of messages by the recording's topics.
        history: What was sensed first, in the units in which it came.
    """

    def __init__(
        self,
        bag: Bag,
        names: Mapping[str, Topic],
        decoder: MessageDecoder,
        cloud: Topic | None,
        settings: tuple[str, ...] = (),
    ) -> None:
        """Look a recording through.

        Args:
            bag: The recording.
            names: The senses' topics by their names in it.
            decoder: Reads the rows by which units are judged.
            cloud: A 3D laser's topic, None for the turning laser's two.
            settings: Names of the topic that may hold the drive's settings.

        Raises:
            BagError: If the recording is damaged.
        """
        self.settings: dict[str, Any] = {}
        self.history = History()
        self._names, self._cloud, self._joints = names, cloud, decoder.joints
        self._reasons: dict[Topic, Counter[str]] = {}
        self._stamps: dict[str, _Stamps] = {name: _Stamps() for name in names}
        for message in bag.messages((*names, *settings)):
            if message.topic in names:
                self._take(message, names[message.topic], decoder)
            elif not self.settings:
                self.settings = _settings(message.content)

    def _take(self, message: Message, topic: Topic, decoder: MessageDecoder) -> None:
        """Note a message of a sense."""
        content, stamps = message.content, self._stamps[message.topic]
        stamps.recorder.append(message.stamp_ns)
        stamps.header.append(header_ns(content) if hasattr(content, "header") else 0)
        if topic in _UNITED:
            stamp = message.stamp_ns / NS
            try:
                raw = decoder.raw(topic, content, stamp)
            except ValueError as error:  # It is counted when it is replayed.
                self._reasons.setdefault(topic, Counter())[str(error)] += 1
                return
            if raw is not None:
                self.history.add(topic, [stamp, *raw], type_of(content))
        elif topic is not topics.FIX and len(stamps.spans) < _FEW_CLOUDS:
            stamps.spans.append(_span(content, topic is self._cloud))

    def why_none(self, topic: Topic) -> str:
        """Return why no row came of a sense's messages, in words."""
        name = next(name for name, other in self._names.items() if other is topic)
        reasons = self._reasons.get(topic)
        if reasons:
            (reason, count), *_ = reasons.most_common(1)
            return f"{name}: expected a message that can be used, got {count} refused: {reason}"
        joints = ", ".join(self._joints.names) or "none"
        return (
            f"{name}: expected joints called wheels of the left and the right, got {joints}; --map "
            f"{topic.ros1} names another topic"
        )

    @property
    def counts(self) -> dict[str, int]:
        """Number of messages by the recording's topics."""
        return {name: len(stamps.recorder) for name, stamps in self._stamps.items()}

    @property
    def messages(self) -> dict[str, int]:
        """Number of messages by our names of the topics."""
        return {self._names[name].ros1: count for name, count in self.counts.items()}

    def pieces(self, remarks: Remarks) -> tuple[list[Piece], int]:
        """Return the pieces of the recording, and how many parts were left out."""
        heads = [name for name, topic in self._names.items() if topic is topics.HEAD_ANGLE]
        scans = [name for name, topic in self._names.items() if topic is topics.SCAN]
        readings = [self._sense(name) for name in self._stamps if name not in heads]
        pieces, left_out = cut_pieces(readings, remarks)
        for piece in pieces:
            # A sweep finds the angle of the head by its stamp: both are shifted alike.
            if scans and scans[0] in piece.clock.shifts:
                piece.clock.shifts.update(dict.fromkeys(heads, piece.clock.shifts[scans[0]]))
        return pieces, left_out

    def _sense(self, name: str) -> SenseStamps:
        """Return the stamps of a topic."""
        found, topic = self._stamps[name], self._names[name]
        return SenseStamps(
            name,
            np.array(found.recorder, dtype=np.int64),
            np.array(found.header, dtype=np.int64),
            _LAGS.get(topic, _LASER_LAG),
            float(np.median(found.spans)) if found.spans else 0.0,
            topic is not topics.FIX,
        )


_UNITED = (topics.IMU, topics.ENCODERS, topics.MAG)


def _settings(content: RosMessage) -> dict[str, Any]:
    """Return the settings that the first diagnostics of our own drives hold, else nothing."""
    for status in content.status:
        for pair in status.values:
            if pair.key == SETUP:
                try:
                    found = json.loads(pair.value)
                except ValueError:
                    return {}
                return found if isinstance(found, dict) else {}
    return {}


def _span(content: RosMessage, cloud: bool) -> float:
    """Return how long a laser's message takes from its header's stamp to its last point [s]."""
    if not cloud:
        steps = max(len(getattr(content, "ranges", ())) - 1, 0)
        return float(getattr(content, "time_increment", 0.0)) * steps
    try:
        stamps = cloud_of(as_point_cloud2(content), None, 0.0).stamps
    except ValueError:
        return 0.0
    return float(np.clip(stamps.max(initial=0.0), 0.0, 1.0)) if stamps is not None else 0.0


class BagPiece(Bag):
    """A piece of a recording, read as a recording of its own that has one clock."""

    def __init__(self, bag: Bag, piece: Piece) -> None:
        """Choose a piece of a recording that is open."""
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
            yield message if clock.plain else _by_clock(message, clock)


def _by_clock(message: Message, clock: Clock) -> Message:
    """Return a message with the recorder's stamp, and its header's where need be, by a clock."""
    stamp, content = clock.time(message.stamp_ns), message.content
    if message.topic in clock.shifts and hasattr(content, "header"):
        shift = clock.shifts[message.topic]
        if shift is None:
            content = stamped(content, stamp - clock.spans.get(message.topic, 0))
        else:
            content = stamped(content, header_ns(content) + shift)
    return replace(message, stamp_ns=stamp, content=content)


def stamped(content: RosMessage, stamp_ns: int) -> RosMessage:
    """Return a message with another stamp [ns] in its header."""
    second, rest = divmod(stamp_ns, NS)
    time = replace(content.header.stamp, sec=second, nanosec=rest)
    return replace(content, header=replace(content.header, stamp=time))
