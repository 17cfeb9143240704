"""Pieces of a recording: it is cut where its clocks jump or all sensors pause.

* Cuts are where no sensor sends for longer than ``LONGEST_GAP``, whether the recording was paused
  or its clock was set, and where the headers jump against the recorder.
* Where the recorder's clock was set back, messages of both times lie mixed: that part is left out.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from andabata.records.clocks import Clock, Stamps, TopicStamps, duration_text, estimate_clock
from andabata.records.messages import NS
from andabata.records.remarks import Remarks

LONGEST_GAP = 2.0
"""Silence of all sensors at which a recording is cut [s]: the robot may be anywhere after it."""

_STEP = 1.0
"""Change of recorder minus header at which it is cut [s]: transport never varies so much for long.
"""

_SETTLED = 3.0
"""Time before and after a step in which the difference is compared [s]: a burst has passed then."""

_BURST = NS // 5
"""Time after a step that is not compared [ns]."""

_FEW = 3
"""Number of messages before and after a step that are needed."""

_MOST_STEPS = 1000
"""Number of changes of recorder minus header that are examined."""

SHORTEST = 1.0
"""Length below which a piece is left out [s]."""

MOST_PIECES = 30
"""Number of pieces that are kept, the longest: for each the recording is read again."""

_BIN = NS // 10
"""Length of a bin in which stamps are counted [ns]."""

_MOST_BINS = 10_000_000
"""Number of bins in which overlaps are searched: eleven days."""

_WINDOW_BINS = 10
"""Number of bins per window in which stamps are counted: a second."""

_HOLE_BINS = 5
"""Number of empty bins that make a hole."""

_CROWDED = 1.6
"""Rate of stamps, as a multiple of the usual, at which two times overlap."""

_USUAL_PERCENTILE = 15
"""Percentile of the counts that is the usual rate, where half of a recording may be crowded."""

_MIN_COUNT = 4
"""Number of stamps per window below which a topic is too slow to detect overlaps."""

_MIN_WINDOWS = 20
"""Number of windows with stamps, beyond which the usual rate is known."""

_MARGIN = 3 * _BIN
"""Length that an overlap is widened by on either side [ns]: a third of a window."""

EVER = (-(1 << 62), 1 << 62)
"""Times before and after every stamp [ns]."""


@dataclass(frozen=True)
class Piece:
    """Part of a recording with one continuous clock.

    Attributes:
        begin_ns: Begin by the recorder's clock [ns]; latched topics come before.
        end_ns: End by the recorder's clock, exclusive [ns].
        first_ns: Recorder's stamp of its first reading [ns].
        last_ns: Recorder's stamp of its last reading [ns].
        clock: Clock of the piece.
    """

    begin_ns: int
    end_ns: int
    first_ns: int
    last_ns: int
    clock: Clock

    @property
    def seconds(self) -> float:
        """Time from its first reading to its last [s]."""
        return (self.last_ns - self.first_ns) / NS

    def epoch_ns(self, start_ns: int) -> int:
        """Return the start of a drive by the piece's clock [ns].

        Args:
            start_ns: Recorded start [ns]; one that lies in the piece, or not long before, is kept.
                Otherwise, as with a start pose of hours ago, the drive starts with the first
                reading.
        """
        first, last = self.clock.convert(self.first_ns), self.clock.convert(self.last_ns)
        return start_ns if first - LONGEST_GAP * NS <= start_ns <= last else first


def cut_pieces(readings: list[TopicStamps], remarks: Remarks) -> tuple[list[Piece], int]:
    """Return the pieces of a recording, and the number of parts that are left out.

    Args:
        readings: Stamps of the sensors' topics.
        remarks: Destination of remarks.
    """
    readings = [topic for topic in readings if len(topic.recorder)]
    steady = [topic for topic in readings if topic.is_steady]
    if not steady:
        return [], 0
    cuts = [EVER[0], *sorted(_cuts(steady, remarks)), EVER[1]]
    overlaps: list[tuple[int, int]] = []
    for begin, end in pairwise(cuts):
        inside = [s for topic in steady if len((s := topic.within(begin, end)).recorder)]
        overlaps += _overlaps(inside, remarks) if inside else []
    bounds = sorted({*cuts, *(at for overlap in overlaps for at in overlap)})
    pieces, left_out = [], len(overlaps)
    for begin, end in pairwise(bounds):
        if (begin, end) in overlaps:
            continue
        inside = [topic.within(begin, end) for topic in readings]
        sensed = [topic for topic in inside if topic.is_steady and len(topic.recorder)]
        if not sensed:
            continue
        first = int(min(topic.recorder[0] for topic in sensed))
        last = int(max(topic.recorder[-1] for topic in sensed))
        if len(bounds) > 2 and last - first < SHORTEST * NS:
            remarks.count("clock", "a piece is left out: too short", number=1)
            left_out += 1
            continue
        # A drive does not go on by fixes alone.
        end = min(end, last + round(LONGEST_GAP * NS))
        pieces.append(Piece(begin, end, first, last, estimate_clock(inside, remarks)))
    kept = _longest(pieces, remarks)
    return kept, left_out + len(pieces) - len(kept)


def _longest(pieces: list[Piece], remarks: Remarks) -> list[Piece]:
    """Return the longest pieces in their order."""
    longest = sorted(pieces, key=lambda piece: piece.seconds)[-MOST_PIECES:]
    if len(longest) < len(pieces):
        count = len(pieces) - len(longest)
        remarks.count("clock", f"a piece is left out: {MOST_PIECES} are longer", number=count)
    return [piece for piece in pieces if piece in longest]


def _cuts(readings: list[TopicStamps], remarks: Remarks) -> list[int]:
    """Return the recorder's stamps at which a new piece begins [ns]."""
    cuts: list[int] = []
    stamps = np.unique(np.concatenate([topic.recorder for topic in readings]))
    begin = stamps[0]
    for k in np.flatnonzero(np.diff(stamps) > LONGEST_GAP * NS):
        before, after = int(stamps[k]), int(stamps[k + 1])
        if _headers_continue(readings, after):
            continue  # Only the transport to the recorder was blocked.
        cuts.append(after)
        remarks.note(
            "clock",
            f"{duration_text((after - before) / NS)} without any reading "
            f"{(before - begin) / NS:.1f} s after the first: the recording paused or its clock was "
            "set; cut there",
        )
    for topic in readings:
        for at, size in _steps(topic):
            if any(abs(at - other) < _SETTLED * NS for other in cuts):
                continue
            cuts.append(at)
            remarks.note(
                "clock",
                f"headers of {topic.name} jump by {duration_text(size)} against the recorder's "
                f"clock {(at - begin) / NS:.1f} s after the first reading; cut there",
            )
    return cuts


def _headers_continue(readings: list[TopicStamps], after: int) -> bool:
    """Return whether most headers go on over a gap that ends at ``after`` [ns]."""
    votes = []
    for topic in readings:
        k = int(np.searchsorted(topic.recorder, after))
        if 0 < k < len(topic.recorder) and topic.header[k] and topic.header[k - 1]:
            passed = (topic.header[k] - topic.header[k - 1]) / NS
            votes.append(0 < passed < _STEP)
    return 2 * sum(votes) > len(votes)


def _steps(topic: TopicStamps) -> list[tuple[int, float]]:
    """Return the times at which recorder minus header changes for good [ns], and the sizes [s]."""
    known = topic.header != 0
    stamps, offsets = topic.recorder[known], topic.offsets
    steps: list[tuple[int, float]] = []
    for k in np.flatnonzero(np.abs(np.diff(offsets)) > _STEP / 2)[:_MOST_STEPS] + 1:
        if steps and stamps[k] - steps[-1][0] < _SETTLED * NS:
            continue
        low = int(np.searchsorted(stamps, stamps[k] - int(_SETTLED * NS)))
        first = np.searchsorted(stamps, stamps[k] + _BURST)
        high = np.searchsorted(stamps, stamps[k] + int(_SETTLED * NS))
        if k - low < _FEW or high - first < _FEW:
            continue  # A straggler, not another clock.
        size = float(np.median(offsets[low:k]) - np.median(offsets[first:high]))
        if abs(size) > _STEP:
            steps.append((int(stamps[k]), size))
    return steps


def _overlaps(readings: list[TopicStamps], remarks: Remarks) -> list[tuple[int, int]]:
    """Return the intervals [ns] that were recorded twice, since the clock was set back.

    The recorder's order is lost there: the messages of both times alternate, so that every topic
    has twice as many as elsewhere.
    """
    begin = min(int(topic.recorder[0]) for topic in readings)
    end = max(int(topic.recorder[-1]) for topic in readings)
    bins = np.arange(begin, end + 1, _BIN)
    if not 3 * _WINDOW_BINS < len(bins) < _MOST_BINS:
        return []
    crowded = _crowded_bins(readings, begin, len(bins))
    if crowded is None or not crowded.any():
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[0], crowded.astype(np.int8), [0]])))
    overlaps = []
    for first, last in edges.reshape(-1, 2):
        if last - first < _WINDOW_BINS:
            continue
        overlaps.append((int(bins[first]) - _MARGIN, int(bins[last - 1]) + _MARGIN))
        remarks.note(
            "clock",
            f"the clock went back by about {(last - first) * 0.1:.0f} s; what was recorded then "
            f"({(bins[first] - begin) / NS:.0f} to {(bins[last - 1] - begin) / NS:.0f} s) lies "
            "mixed and is left out",
        )
    return overlaps


def _crowded_bins(readings: list[TopicStamps], begin: int, bins: int) -> NDArray[np.bool_] | None:
    """Return the bins in which all topics are crowded, shape (bins,), None if all are too slow."""
    all_crowded: NDArray[np.bool_] | None = None
    for topic in readings:
        counts = _window_counts(topic, begin, bins)
        busy = counts[counts > 0]
        known = len(busy) > _MIN_WINDOWS
        usual = float(np.percentile(busy, _USUAL_PERCENTILE)) if known else 0.0
        if usual < _MIN_COUNT:
            continue
        crowded = counts > _CROWDED * usual
        all_crowded = crowded if all_crowded is None else all_crowded & crowded
    return all_crowded


def _window_counts(topic: TopicStamps, begin: int, bins: int) -> NDArray[np.int64]:
    """Return the number of stamps in the window around each bin, 0 beside a hole, shape (bins,).

    Header stamps are counted where there are some: the recorder's are crowded after a delay of
    transport, too.
    """
    stamps = _recorded_headers(topic)
    places = (stamps - begin) // _BIN
    counts = np.bincount(places[(places >= 0) & (places < bins)], minlength=bins)
    hole = np.convolve(counts, np.ones(_HOLE_BINS, np.int64), mode="same") == 0
    hole[:_HOLE_BINS] = hole[-_HOLE_BINS:] = True  # The ends of a recording are holes, too.
    window = np.convolve(counts, np.ones(_WINDOW_BINS, np.int64), mode="same")
    # A window that reaches into a hole holds too few stamps.
    window[np.convolve(hole, np.ones(_WINDOW_BINS + 1), mode="same") > 0] = 0
    return window


def _recorded_headers(topic: TopicStamps) -> Stamps:
    """Return header stamps in the recorder's time [ns], the recorder's own where there are none."""
    offset = topic.offset
    if offset is None:
        return topic.recorder
    return topic.header[topic.header != 0] + round(offset * NS)
