"""Survey of a recording: one pass over its messages for clocks, units and settings."""

from array import array
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from andabata.records import topics
from andabata.records.bags import Bag, BagError, Message
from andabata.records.bursts import find_bursts, holds_what_follows
from andabata.records.clocks import Stamps, TopicStamps
from andabata.records.decoding.accepted_types import ALTERNATIVES, message_type
from andabata.records.decoding.message_decoder import MessageDecoder
from andabata.records.decoding.point_cloud2 import as_point_cloud2, cloud_of
from andabata.records.decoding.row_history import RowHistory
from andabata.records.decoding.sensor_decoder import SensorDecoder
from andabata.records.decoding.source_choice import ReadingSource
from andabata.records.decoding.wheel_speeds import JointFacts
from andabata.records.decoding.wheel_zeros import zeros_between
from andabata.records.decoding.yaw_increments import heading_of, up_direction
from andabata.records.messages import NS, header_ns
from andabata.records.pieces import Piece, cut_pieces
from andabata.records.recorded_settings import parse_settings
from andabata.records.remarks import Remarks
from andabata.records.stamp_offsets import offset_remark
from andabata.records.topic_selection import Remapping, topic_names
from andabata.records.topics import RosMessage, Topic

_MAX_LAGS = {topics.IMU: 0.3, topics.ENCODERS: 0.3, topics.MAG: 0.3, topics.FIX: 3.0}
"""Longest time by which a reading may be older than its record, before its clock is doubted [s]."""

_LASER_MAX_LAG = 1.0
"""The same of lasers, which collect their points for some time [s]."""

_FEW_SCANS = 5
"""Number of a laser's messages by which the duration of one is measured."""


_MAX_HEADER_LAG = NS
"""Largest difference of header and recorder of one clock [ns]."""


@dataclass
class _Stamps:
    """Stamps of one topic as they are read.

    Attributes:
        recorder: Times at which its messages were recorded [ns].
        header: Stamps of their headers [ns], 0 without one.
        durations: Times that the first messages of a laser take [s].
    """

    recorder: "array[int]" = field(default_factory=lambda: array("q"))
    header: "array[int]" = field(default_factory=lambda: array("q"))
    durations: list[float] = field(default_factory=list)


class BagSurvey:
    """Contents of a recording that are needed before it is replayed.

    Attributes:
        settings: Settings of the drive, empty in a recording that is not ours.
        counts: Number of messages by the recording's topics.
        history: First readings, in the units in which they came.
    """

    def __init__(
        self,
        bag: Bag,
        names: Mapping[str, Topic],
        decoder: MessageDecoder,
        cloud: Topic | None,
        diagnostics: tuple[str, ...] = (),
    ) -> None:
        """Read a recording once.

        Args:
            bag: Recording to read.
            names: Topics of the sensors by their names in it.
            decoder: Decoder of the rows by which units are inferred.
            cloud: Topic of a 3D laser, None for the rotating laser's two.
            diagnostics: Names of the topic that may hold the drive's settings.

        Raises:
            BagError: If the recording is damaged.
        """
        self.settings: dict[str, Any] = {}
        self.history = RowHistory()
        self._names, self._cloud, self._joints = names, cloud, decoder.joints
        self._reasons: dict[Topic, Counter[str]] = {}
        self._unread: Counter[Topic] = Counter()
        self._in_bursts: set[Topic] = set()
        self._sources: dict[Topic, list[ReadingSource]] = {}
        self._stamps: dict[str, _Stamps] = {name: _Stamps() for name in names}
        for message in bag.messages((*names, *diagnostics)):
            if message.topic in names:
                self._add(message, names[message.topic], decoder)
            elif not self.settings:
                self.settings = parse_settings(message.content)

    def _add(self, message: Message, topic: Topic, decoder: MessageDecoder) -> None:
        """Add a message of a sensor."""
        content, stamps = message.content, self._stamps[message.topic]
        stamps.recorder.append(message.stamp_ns)
        stamps.header.append(header_ns(content) if hasattr(content, "header") else 0)
        if topic in ALTERNATIVES:
            source = ReadingSource.of(content, message.publisher)
            if source not in (sources := self._sources.setdefault(topic, [])):
                sources.append(source)
            stamp = self._measured_ns(stamps) / NS
            try:
                raw = decoder.raw(topic, content, stamp)
            except ValueError as error:  # The replay counts it.
                self._reasons.setdefault(topic, Counter())[str(error)] += 1
                raw = None
            self._unread[topic] += raw is None
            if raw is not None:
                self.history.add(topic, [stamp, *raw], message_type(content))
        elif topic is not topics.FIX and len(stamps.durations) < _FEW_SCANS:
            stamps.durations.append(_scan_duration(content, topic is self._cloud))

    @staticmethod
    def _measured_ns(stamps: _Stamps) -> int:
        """Return when the last message was measured [ns]: its header's stamp if it may be."""
        recorder, header = stamps.recorder[-1], stamps.header[-1]
        return header if abs(recorder - header) < _MAX_HEADER_LAG else recorder

    def reason_without_rows(self, topic: Topic) -> str:
        """Return the reason why a topic gave no row, as text with the next step."""
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

    def choice_of_source(self, topic: Topic) -> str:
        """Return how to choose one of two sources of a topic, empty where it has one."""
        first, *others = self._sources.get(topic, [ReadingSource()])
        if not others:
            return ""
        names = " or ".join(
            f"--source {topic.ros1}={one.name_beside(other)}"
            for one, other in ((first, others[0]), (others[0], first))
        )
        return f"; readings come from {first} and {others[0]}: {names} chooses one"

    @property
    def joints(self) -> JointFacts:
        """Facts about the joint states."""
        return self._joints.facts

    @property
    def counts(self) -> dict[str, int]:
        """Number of messages by the recording's topics."""
        return {name: len(stamps.recorder) for name, stamps in self._stamps.items()}

    @property
    def messages(self) -> dict[str, int]:
        """Number of messages by our names of the topics."""
        return {self._names[name].ros1: count for name, count in self.counts.items()}

    def pieces(
        self, remarks: Remarks, time_offsets: Mapping[str, float] | None = None
    ) -> tuple[list[Piece], int]:
        """Return the pieces of the recording, and the number of parts that are left out.

        Args:
            remarks: Destination of remarks.
            time_offsets: Times that are added to the stamps of topics by our names [s]; None for
                none.
        """
        heads = [name for name, topic in self._names.items() if topic is topics.HEAD_ANGLE]
        scans = [name for name, topic in self._names.items() if topic is topics.SCAN]
        readings = [self._topic_stamps(name) for name in self._stamps if name not in heads]
        pieces, left_out = cut_pieces(readings, remarks)
        for piece in pieces:
            # A sweep finds the angle of the head by its stamp: both are shifted alike.
            offsets = piece.clock.header_offsets
            if scans and scans[0] in offsets:
                offsets.update(dict.fromkeys(heads, offsets[scans[0]]))
            for topic in readings:
                part = topic.within(piece.begin_ns, piece.end_ns)
                self._spread_bursts(part, piece, remarks)
                self._shift(part, piece, time_offsets or {})
        self._note_offset(pieces, remarks, time_offsets or {})
        return pieces, left_out

    def _shift(self, stamps: TopicStamps, piece: Piece, offsets: Mapping[str, float]) -> None:
        """Add the time that the user gives to the stamps of a topic in a piece."""
        seconds = offsets.get(self._names[stamps.name].ros1)
        if seconds is None:
            return
        spread = piece.clock.spread
        times = spread[stamps.name] if stamps.name in spread else _times(stamps)
        spread[stamps.name] = times + round(seconds * NS)

    def _note_offset(
        self, pieces: list[Piece], remarks: Remarks, offsets: Mapping[str, float]
    ) -> None:
        """Remark on a sensor whose turns are stamped earlier or later than the others'.

        Topics that come in bursts, or whose clock is corrected, have stamps of another kind.
        """
        names = {name for piece in pieces for name in piece.clock.header_offsets}
        corrected = {self._names[name] for name in names} | self._in_bursts
        rows = {}
        for topic in (topics.IMU, topics.MAG, topics.ENCODERS):
            history = self.history.array(topic)
            if history is not None and topic not in corrected and len(self._sources[topic]) == 1:
                history[:, 0] += offsets.get(topic.ros1, 0.0)
                rows[topic] = history
        if topics.IMU not in rows:
            return
        remark = offset_remark(rows[topics.IMU], rows.get(topics.MAG), rows.get(topics.ENCODERS))
        if remark is not None:
            remarks.note(remark[0].ros1, remark[1])

    def _spread_bursts(self, stamps: TopicStamps, piece: Piece, remarks: Remarks) -> None:
        """Spread the readings of a topic that come in bursts in a piece of the recording."""
        topic = self._names[stamps.name]
        times = _times(stamps)
        bursts = find_bursts(times) if self._is_of_one_source(topic) else None
        if bursts is None:
            return
        before, after = (bursts.spread(times, is_after) for is_after in (False, True))
        is_after = topic is topics.IMU and self._holds_what_follows(times, before, after)
        piece.clock.spread[stamps.name] = after if is_after else before
        self._in_bursts.add(topic)
        remarks.note(
            stamps.name,
            f"readings come in bursts of {bursts.size:.1f}, {NS / bursts.period:.0f} a second in "
            f"all: each is spread over the time {'after' if is_after else 'before'} it",
        )

    def _is_of_one_source(self, topic: Topic) -> bool:
        """Return whether all messages of a topic are readings of one node, each recorded once."""
        rows = self.history.array(topic) if topic in ALTERNATIVES else None
        if rows is None or self._unread[topic] or len(self._sources[topic]) > 1:
            return False
        if topic is topics.ENCODERS and zeros_between(rows).any():
            return False
        return not self.history.is_repeated(topic)

    def _holds_what_follows(self, times: Stamps, before: Stamps, after: Stamps) -> bool:
        """Return whether a burst of the IMU holds what was measured after it, by the compass."""
        imu, compass = self.history.array(topics.IMU), self.history.array(topics.MAG)
        if imu is None or compass is None:
            return False
        if find_bursts(np.round(compass[:, 0] * NS).astype(np.int64)) is not None:
            return False  # It comes with the IMU.
        up = up_direction(imu)
        headings = np.column_stack([compass[:, 0], heading_of(compass[:, 1:4], up)])
        earlier, later = (
            imu[:, 0] + np.interp(imu[:, 0], times / NS, (stamps - times) / NS)
            for stamps in (before, after)
        )
        return holds_what_follows(earlier, later, imu[:, 1:4] @ up, headings)

    def _topic_stamps(self, name: str) -> TopicStamps:
        """Return the stamps of a topic."""
        stamps, topic = self._stamps[name], self._names[name]
        return TopicStamps(
            name,
            np.array(stamps.recorder, dtype=np.int64),
            np.array(stamps.header, dtype=np.int64),
            _MAX_LAGS.get(topic, _LASER_MAX_LAG),
            float(np.median(stamps.durations)) if stamps.durations else 0.0,
            topic is not topics.FIX,
        )


def _times(stamps: TopicStamps) -> Stamps:
    """Return the stamps that a topic's readings are used by [ns], shape (k,)."""
    return stamps.header if (stamps.header != 0).all() else stamps.recorder


def survey_bag(
    bag: Bag, cloud: Topic | None, remapping: Remapping, decoder: MessageDecoder
) -> BagSurvey:
    """Return the survey of a recording whose sensors all have usable messages.

    Args:
        bag: Recording to read.
        cloud: Topic of a 3D laser, None for the rotating laser's two.
        remapping: Names that the recording uses.
        decoder: Decoder of the rows by which units are inferred.

    Raises:
        BagError: If a needed sensor has no usable message.
    """
    wanted = [topic for topic in SensorDecoder(0, cloud).wanted if topic is not topics.GOAL]
    names = {n: t for n, t in topic_names(tuple(wanted), remapping).items() if n in bag.topics}
    diagnostics = tuple(topic_names((topics.DIAGNOSTICS,), remapping))
    survey = BagSurvey(bag, names, decoder, cloud, diagnostics)
    silent = [n for n, count in survey.counts.items() if not count and names[n] != topics.FIX]
    if silent:
        raise BagError(
            f"{bag.path}: expected messages of {', '.join(silent)}, got none; --map names another "
            "topic with the same readings"
        )
    for topic in (topics.IMU, topics.ENCODERS, topics.MAG):
        if not survey.history.count(topic):
            raise BagError(f"{bag.path}: {survey.reason_without_rows(topic)}")
    return survey


def _scan_duration(content: RosMessage, is_cloud: bool) -> float:
    """Return the time from a laser message's header stamp to its last point [s]."""
    if not is_cloud:
        steps = max(len(getattr(content, "ranges", ())) - 1, 0)
        return float(getattr(content, "time_increment", 0.0)) * steps
    try:
        stamps = cloud_of(as_point_cloud2(content), None, 0.0).stamps
    except ValueError:
        return 0.0
    return float(np.clip(stamps.max(initial=0.0), 0.0, 1.0)) if stamps is not None else 0.0
