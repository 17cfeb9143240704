"""Clocks of a recording: the recorder's, and those that stamp the messages' headers.

A message carries two times: when it was recorded, and the stamp of its header. In a sound recording
both are of one clock. Otherwise, in each piece of the recording:

* Headers of most topics may be of another clock than the recorder's (simulated time, time since
  boot): then that clock is the piece's, and the recorder's stamps are converted into it.
* A topic whose headers differ from the others' (a laser that counts from its own boot) is shifted
  by the median clock offset; one whose headers are zero gets the recorder's stamps.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from andabata.records.messages import NS
from andabata.records.remarks import Remarks

Stamps = NDArray[np.int64]

_MAX_LEAD = -0.05
"""Recorder minus header of a message from the future, from which its clock is another [s]."""

_REFERENCE_LAG = 0.5
"""Allowed lag below which a topic is preferred as reference [s]."""

_SAMPLE = 1000
"""Number of stamps by which a topic's clock offset is estimated."""


@dataclass(frozen=True)
class TopicStamps:
    """Stamps of one topic in the order of its recording.

    Attributes:
        name: Name of the topic in the recording.
        recorder: Times at which its messages were recorded [ns], shape (k,).
        header: Stamps of their headers [ns], 0 without a header or stamp, shape (k,).
        max_lag: Longest time by which a message may be older than its record [s].
        duration: Time from a message's header stamp to its last measurement [s].
        is_steady: True if it comes often enough to detect gaps and jumps.
    """

    name: str
    recorder: Stamps
    header: Stamps
    max_lag: float
    duration: float = 0.0
    is_steady: bool = True

    def within(self, begin: int, end: int) -> "TopicStamps":
        """Return the stamps that were recorded from ``begin`` to before ``end`` [ns]."""
        part = slice(*np.searchsorted(self.recorder, [begin, end]))
        return TopicStamps(
            self.name,
            self.recorder[part],
            self.header[part],
            self.max_lag,
            self.duration,
            self.is_steady,
        )

    @property
    def offsets(self) -> NDArray[np.float64]:
        """Recorder minus header of the messages that have a header stamp [s]."""
        known = self.header != 0
        return (self.recorder[known] - self.header[known]) / NS

    @property
    def offset(self) -> float | None:
        """Median of ``offsets`` [s]; None where at least half of the headers are zero."""
        offsets = self.offsets
        return float(np.median(offsets)) if 2 * len(offsets) > len(self.recorder) else None


@dataclass(frozen=True)
class Clock:
    """Clock of a piece, with the conversion of other stamps into it.

    Attributes:
        recorder: Increasing times of the recorder [ns], shape (k,); None where its clock is the
            piece's.
        reference: Times of the piece's clock at these instants [ns], increasing, shape (k,).
        header_offsets: Offsets that are added to the headers of a topic [ns]; None replaces them
            by the recorder's stamp. Topics that are missing keep theirs.
        durations: Time from such a recorder's stamp back to the message's start [ns], by topic.
        spread: Stamps of all messages of a topic in the piece [ns], by topic, where they came in
            bursts; they replace the headers' and the recorder's before these are converted.
    """

    recorder: Stamps | None = None
    reference: Stamps | None = None
    header_offsets: dict[str, int | None] = field(default_factory=dict)
    durations: dict[str, int] = field(default_factory=dict)
    spread: dict[str, Stamps] = field(default_factory=dict)

    @property
    def is_identity(self) -> bool:
        """True if all stamps stay as they are."""
        return self.recorder is None and not self.header_offsets and not self.spread

    def convert(self, recorder_ns: int) -> int:
        """Return a recorder's time by the piece's clock [ns]; beyond the ends at equal rates."""
        if self.recorder is None or self.reference is None:
            return recorder_ns
        first, last = self.recorder[0], self.recorder[-1]
        if recorder_ns <= first:
            return int(self.reference[0]) - int(first - recorder_ns)
        if recorder_ns >= last:
            return int(self.reference[-1]) + int(recorder_ns - last)
        # Differences fit into a double exactly, nanoseconds since 1970 do not.
        inside = np.interp(
            recorder_ns - first, self.recorder - first, self.reference - self.reference[0]
        )
        return int(self.reference[0]) + round(float(inside))


def estimate_clock(readings: list[TopicStamps], remarks: Remarks) -> Clock:
    """Return the clock of a piece.

    Args:
        readings: Stamps of the piece's topics.
        remarks: Destination of remarks.
    """
    present = [topic for topic in readings if len(topic.recorder)]
    offsets = {topic.name: topic.offset for topic in present}
    reference = _reference_topic(present, offsets)
    recorder = header = None
    if reference is not None:
        recorder, header = _increasing_pairs(reference)
        offset = offsets[reference.name] or 0.0
        size, side = duration_text(offset), "after" if offset < 0 else "before"
        text = f"headers are {size} {side} the recorder's clock: theirs is used"
        remarks.note("clock", text)
    clock = Clock(recorder, header)
    header_offsets: dict[str, int | None] = {}
    for topic in present:
        if offsets[topic.name] is None:
            header_offsets[topic.name] = None
            remarks.note(topic.name, "headers have no stamps: the recorder's are used")
        elif topic is not reference:
            header_offsets |= _header_offset(topic, clock, remarks)
    durations = {
        topic.name: round(topic.duration * NS)
        for topic in present
        if header_offsets.get(topic.name, 0) is None
    }
    return Clock(recorder, header, header_offsets, durations)


def _reference_topic(
    present: list[TopicStamps], offsets: dict[str, float | None]
) -> TopicStamps | None:
    """Return the topic whose headers are the piece's clock, None where the recorder's is."""
    known = [topic for topic in present if offsets[topic.name] is not None]
    agreeing = [topic for topic in known if _agrees(offsets[topic.name], topic.max_lag)]
    if 2 * len(agreeing) >= len(known):
        return None
    return max(known, key=_reference_rank, default=None)


def _agrees(offset: float | None, max_lag: float) -> bool:
    """Return whether recorder minus header [s] is a delay of transport alone."""
    return offset is not None and _MAX_LEAD < offset < max_lag


def _reference_rank(topic: TopicStamps) -> tuple[bool, int]:
    """Return the rank of a topic as reference: steady ones with a short lag, then frequent ones."""
    return topic.is_steady and topic.max_lag < _REFERENCE_LAG, len(topic.recorder)


def _header_offset(topic: TopicStamps, clock: Clock, remarks: Remarks) -> dict[str, int | None]:
    """Return the entry of ``Clock.header_offsets`` for a topic with stamps, empty without one."""
    headers = _sample(topic.header)
    lags = np.array([clock.convert(int(r)) for r in _sample(topic.recorder)]) - headers
    lags = lags[headers != 0] / NS
    median = float(np.median(lags))
    if _agrees(median, topic.max_lag):
        return {}
    if float(np.subtract(*np.percentile(lags, [90, 10]))) > topic.max_lag:
        remarks.note(topic.name, "headers run at another rate: the recorder's stamps are used")
        return {topic.name: None}
    side = "behind" if median > 0 else "ahead"
    remarks.note(
        topic.name,
        f"headers are of another clock, {duration_text(median)} {side}: shifted by the median",
    )
    # A message is recorded after its last measurement, and stamped at its first.
    return {topic.name: round((median - topic.duration) * NS)}


def _sample(stamps: Stamps) -> Stamps:
    """Return about a thousand of some stamps at most, evenly spread."""
    return stamps[:: max(1, len(stamps) // _SAMPLE)]


def _increasing_pairs(topic: TopicStamps) -> tuple[Stamps, Stamps]:
    """Return pairs of recorder's and header's stamps [ns], both increasing, shape (k,) each."""
    known = topic.header != 0
    recorder, first = np.unique(topic.recorder[known], return_index=True)
    return recorder, np.maximum.accumulate(topic.header[known][first])


def duration_text(seconds: float) -> str:
    """Return the size of a time as text with a unit."""
    size = abs(seconds)
    for unit, name in ((365.25 * 86400, "years"), (86400, "days"), (3600, "h"), (60, "min")):
        if size >= 2 * unit:
            return f"{size / unit:.1f} {name}"
    return f"{size:.2f} s"
