"""Clocks of a recording: its recorder's, and those by which its messages are stamped.

Messages carry two times: when they were recorded, and what their header says. In a sound recording
both are of one clock. Otherwise:

* A recording is cut where no sense speaks for longer than ``LONGEST_GAP``, whether somebody paused
  it or set the clock, where the headers jump against the recorder, and where the recorder's clock
  went back over what it had told already: what overlaps is left out.
* In each piece, headers of all senses may be of another clock than the recorder's (simulated time,
  time since boot): then that clock is the piece's, and the recorder's stamps are turned into it.
* A sense whose headers differ from the others' (a laser that counts from its own boot) is shifted
  by the median of the difference; one whose headers are zero gets the recorder's stamps.
"""

from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from andabata.records.remarks import Remarks

NS = 1_000_000_000

Stamps = NDArray[np.int64]

LONGEST_GAP = 2.0
"""Silence of all senses at which a recording is cut [s]: the robot may be anywhere after it."""

STEP = 1.0
"""Change of recorder minus header at which it is cut [s]: no transport varies so much for long."""

_SETTLED = 3.0
"""How long before and after a step the difference is looked at [s]: a burst has passed then."""

_FEW = 3
"""Messages before and after a step that are needed to call it one."""

_MOST_STEPS = 1000
"""Changes of recorder minus header that are looked at."""

SHORTEST = 1.0
"""Shorter pieces are left out [s]."""

MOST_PIECES = 30
"""Pieces that are kept, the longest: for each the recording is read again."""

_EARLY = -0.05
"""A header so far ahead of the recorder is of another clock [s]."""

_CROWDED = 1.6
"""Rate of stamps, as a multiple of the usual, at which two times overlap."""

_MOST_BINS = 10_000_000
"""Tenths of a second in which overlaps are looked for: eleven days."""

_CROWD = 1.0
"""Window in which stamps are counted [s]."""


@dataclass(frozen=True)
class SenseStamps:
    """The stamps of one topic in the order in which it was recorded.

    Attributes:
        name: Name of the topic in the recording.
        recorder: When its messages were recorded [ns], shape (k,).
        header: What their headers say [ns], 0 without a header or stamp, shape (k,).
        lag: Longest time by which a message may be older than its record [s].
        span: Time that a message takes from its header's stamp to its end [s].
        steady: Whether it comes often enough to tell of gaps and jumps.
    """

    name: str
    recorder: Stamps
    header: Stamps
    lag: float
    span: float = 0.0
    steady: bool = True

    def within(self, begin: int, end: int) -> "SenseStamps":
        """Return the stamps that were recorded from ``begin`` to before ``end`` [ns]."""
        part = slice(*np.searchsorted(self.recorder, [begin, end]))
        return SenseStamps(
            self.name, self.recorder[part], self.header[part], self.lag, self.span, self.steady
        )

    @property
    def offsets(self) -> NDArray[np.float64]:
        """Recorder minus header of the messages that have a header's stamp [s]."""
        known = self.header != 0
        return (self.recorder[known] - self.header[known]) / NS

    @property
    def offset(self) -> float | None:
        """The median of ``offsets``; None where more than half of the headers are zero."""
        found = self.offsets
        return float(np.median(found)) if 2 * len(found) > len(self.recorder) else None


@dataclass(frozen=True)
class Clock:
    """The clock of a piece, and how to turn other stamps into it.

    Attributes:
        recorder: Times of the recorder [ns] and
        reference: the piece's own at them, both growing; None where the recorder's is the piece's.
        shifts: What to add to the headers of a topic [ns]; None where the recorder's stamp stands
            for them. Topics that are missing keep theirs.
        spans: Time from such a stamp back to the message's begin [ns], by topic.
    """

    recorder: Stamps | None = None
    reference: Stamps | None = None
    shifts: dict[str, int | None] = field(default_factory=dict)
    spans: dict[str, int] = field(default_factory=dict)

    @property
    def plain(self) -> bool:
        """Whether all stamps may stay as they are."""
        return self.recorder is None and not self.shifts

    def time(self, recorder_ns: int) -> int:
        """Return a time of the recorder by the piece's clock [ns]; time goes on beyond its ends."""
        if self.recorder is None or self.reference is None:
            return recorder_ns
        first, last = self.recorder[0], self.recorder[-1]
        if recorder_ns <= first:
            return int(self.reference[0]) - int(first - recorder_ns)
        if recorder_ns >= last:
            return int(self.reference[-1]) + int(recorder_ns - last)
        inside = np.interp(
            recorder_ns - first, self.recorder - first, self.reference - self.reference[0]
        )
        return int(self.reference[0]) + round(float(inside))


@dataclass(frozen=True)
class Piece:
    """A part of a recording in which time goes on.

    Attributes:
        begin_ns: When it begins by the recorder's clock [ns]; latched topics come before.
        end_ns: Before when it ends [ns].
        first_ns: Stamp of its first sense [ns].
        last_ns: Stamp of its last [ns].
        clock: Its clock.
    """

    begin_ns: int
    end_ns: int
    first_ns: int
    last_ns: int
    clock: Clock

    @property
    def seconds(self) -> float:
        """Time from its first sense to its last [s]."""
        return (self.last_ns - self.first_ns) / NS

    def epoch_ns(self, told_ns: int) -> int:
        """Return when a drive begins by the piece's clock [ns].

        Args:
            told_ns: When it is told to begin; one that lies in the piece, or not long before, is
                kept. Else its first sense begins it, as after a start that was told hours ago.
        """
        first, last = self.clock.time(self.first_ns), self.clock.time(self.last_ns)
        return told_ns if first - LONGEST_GAP * NS <= told_ns <= last else first


EVER = (-(1 << 62), 1 << 62)
"""Before and after every stamp [ns]."""


def cut_pieces(readings: list[SenseStamps], remarks: Remarks) -> tuple[list[Piece], int]:
    """Return the pieces of a recording, and how many parts were left out.

    Args:
        readings: Stamps of the senses.
        remarks: Where to write down what was found.
    """
    readings = [sense for sense in readings if len(sense.recorder)]
    steady = [sense for sense in readings if sense.steady]
    if not steady:
        return [], 0
    cuts = [EVER[0], *sorted(_cuts(steady, remarks)), EVER[1]]
    overlaps: list[tuple[int, int]] = []
    for begin, end in pairwise(cuts):
        inside = [s for sense in steady if len((s := sense.within(begin, end)).recorder)]
        overlaps += _overlaps(inside, remarks) if inside else []
    bounds = sorted({*cuts, *(at for overlap in overlaps for at in overlap)})
    pieces, left_out = [], len(overlaps)
    for begin, end in pairwise(bounds):
        if (begin, end) in overlaps:
            continue
        inside = [sense.within(begin, end) for sense in readings]
        told = [s for s in inside if s.steady and len(s.recorder)]
        if not told:
            continue
        first = int(min(sense.recorder[0] for sense in told))
        last = int(max(sense.recorder[-1] for sense in told))
        if len(bounds) > 2 and last - first < SHORTEST * NS:
            remarks.count("clock", "a piece is left out: too short", number=1)
            left_out += 1
            continue
        # Nothing is sensed after the last: fixes alone don't go on driving.
        end = min(end, last + round(LONGEST_GAP * NS))
        pieces.append(Piece(begin, end, first, last, _clock(inside, remarks)))
    longest = sorted(pieces, key=lambda piece: piece.seconds)[-MOST_PIECES:]
    if len(longest) < len(pieces):
        count = len(pieces) - len(longest)
        remarks.count("clock", f"a piece is left out: {MOST_PIECES} are longer", number=count)
    kept = [piece for piece in pieces if piece in longest]
    return kept, left_out + len(pieces) - len(kept)


def _cuts(readings: list[SenseStamps], remarks: Remarks) -> list[int]:
    """Return at which recorder's stamps [ns] something else begins."""
    found: list[int] = []
    stamps = np.unique(np.concatenate([sense.recorder for sense in readings]))
    begin = stamps[0]
    for k in np.flatnonzero(np.diff(stamps) > LONGEST_GAP * NS):
        before, after = int(stamps[k]), int(stamps[k + 1])
        if _goes_on(readings, before, after):
            continue  # Only the way to the recorder was blocked: the headers go on.
        found.append(after)
        remarks.note(
            "clock",
            f"{_duration((after - before) / NS)} without any sense {(before - begin) / NS:.1f} s "
            "after the first: the recording paused or its clock was set; cut there",
        )
    for sense in readings:
        for at, size in _steps(sense):
            if any(abs(at - other) < _SETTLED * NS for other in found):
                continue
            found.append(at)
            remarks.note(
                "clock",
                f"headers of {sense.name} jump by {_duration(size)} against the recorder's clock "
                f"{(at - begin) / NS:.1f} s after the first sense; cut there",
            )
    return found


def _goes_on(readings: list[SenseStamps], before: int, after: int) -> bool:
    """Return whether most headers go on as if there were no gap in what the recorder took down."""
    votes = []
    for sense in readings:
        k = int(np.searchsorted(sense.recorder, after))
        if 0 < k < len(sense.recorder) and sense.header[k] and sense.header[k - 1]:
            passed = (sense.header[k] - sense.header[k - 1]) / NS
            votes.append(0 < passed < STEP)
    return 2 * sum(votes) > len(votes)


def _steps(sense: SenseStamps) -> list[tuple[int, float]]:
    """Return where recorder minus header changes for good [ns], and by how much [s]."""
    known = sense.header != 0
    stamps, offsets = sense.recorder[known], sense.offsets
    found: list[tuple[int, float]] = []
    for k in np.flatnonzero(np.abs(np.diff(offsets)) > STEP / 2)[:_MOST_STEPS] + 1:
        if found and stamps[k] - found[-1][0] < _SETTLED * NS:
            continue
        lows = int(np.searchsorted(stamps, stamps[k] - int(_SETTLED * NS)))
        first = np.searchsorted(stamps, stamps[k] + NS // 5)
        high = np.searchsorted(stamps, stamps[k] + int(_SETTLED * NS))
        if k - lows < _FEW or high - first < _FEW:
            continue  # A straggler, not another clock.
        after = offsets[first:high]
        size = float(np.median(offsets[lows:k]) - np.median(after))
        if abs(size) > STEP:
            found.append((int(stamps[k]), size))
    return found


def _overlaps(readings: list[SenseStamps], remarks: Remarks) -> list[tuple[int, int]]:
    """Return the times [ns] that were lived through twice, since the clock went back.

    The recorder's order is lost there: the messages of both lie between each other, twice as many
    as elsewhere, of every sense.
    """
    found: NDArray[np.bool_] | None = None
    begin = min(int(sense.recorder[0]) for sense in readings)
    end = max(int(sense.recorder[-1]) for sense in readings)
    bins = np.arange(begin, end + 1, NS // 10)
    if not 3 * _CROWD * 10 < len(bins) < _MOST_BINS:
        return []
    for sense in readings:
        window = _counts(sense, begin, len(bins))
        usual = float(np.percentile(window[window > 0], 15)) if (window > 0).sum() > 20 else 0.0
        if usual < 4:
            continue  # Too slow to tell.
        crowded = window > _CROWDED * usual
        found = crowded if found is None else found & crowded
    if found is None or not found.any():
        return []
    ends = np.flatnonzero(np.diff(np.concatenate([[0], found.astype(np.int8), [0]])))
    margin = int(0.3 * _CROWD * NS)
    overlaps = []
    for first, last in ends.reshape(-1, 2):
        if (last - first) * 0.1 < _CROWD:
            continue
        overlap = int(bins[first]) - margin, int(bins[last - 1]) + margin
        overlaps.append(overlap)
        remarks.note(
            "clock",
            f"the clock went back by about {(last - first) * 0.1:.0f} s; what was recorded then "
            f"({(bins[first] - begin) / NS:.0f} to {(bins[last - 1] - begin) / NS:.0f} s) lies "
            "mixed and is left out",
        )
    return overlaps


def _counts(sense: SenseStamps, begin: int, bins: int) -> NDArray[np.int64]:
    """Return how many stamps lie within half a second of each bin of 0.1 s, 0 beside a hole.

    Headers count where there are some: the recorder's stamps crowd after a hold-up on the way.
    """
    offset = sense.offset
    stamps = (
        sense.recorder if offset is None else sense.header[sense.header != 0] + round(offset * NS)
    )
    places = (stamps - begin) // (NS // 10)
    counts = np.bincount(places[(places >= 0) & (places < bins)], minlength=bins)
    hole = np.convolve(counts, np.ones(5, np.int64), mode="same") == 0
    hole[:5] = hole[-5:] = True
    window = np.convolve(counts, np.ones(int(_CROWD * 10), np.int64), mode="same")
    window[np.convolve(hole, np.ones(11), mode="same") > 0] = 0
    return window


def _clock(readings: list[SenseStamps], remarks: Remarks) -> Clock:
    """Return the clock of a piece."""
    told = [(sense, sense.offset) for sense in readings if len(sense.recorder)]
    offsets = {s.name: offset for s, offset in told if offset is not None}
    lags = {s.name: s.lag for s, _ in told}
    same = [name for name, offset in offsets.items() if _EARLY < offset < lags[name]]
    main = max((s for s, offset in told if offset is not None), key=_weight, default=None)
    reference: SenseStamps | None = None
    if main is not None and 2 * len(same) < len(offsets):
        reference = main
    recorder = header = None
    if reference is not None:
        recorder, header = _growing(reference)
        remarks.note(
            "clock",
            f"headers are {_duration(-offsets[reference.name])} after the recorder's clock: theirs "
            "is used" if offsets[reference.name] < 0 else
            f"headers are {_duration(offsets[reference.name])} before the recorder's clock: theirs "
            "is used",
        )  # fmt: skip
    clock = Clock(recorder, header)
    shifts: dict[str, int | None] = {}
    for sense, offset in told:
        if offset is None:
            shifts[sense.name] = None
            remarks.note(sense.name, "headers have no stamps: the recorder's are used")
            continue
        apart = np.array([clock.time(int(r)) for r in _few(sense.recorder)]) - _few(sense.header)
        apart = apart[_few(sense.header) != 0] / NS
        middle = float(np.median(apart))
        if reference is sense or _EARLY < middle < sense.lag:
            continue
        if float(np.subtract(*np.percentile(apart, [90, 10]))) > sense.lag:
            shifts[sense.name] = None  # It runs at another pace.
            remarks.note(sense.name, "headers run at another pace: the recorder's stamps are used")
            continue
        shifts[sense.name] = round((middle - sense.span) * NS)
        remarks.note(
            sense.name,
            f"headers are of another clock, {_duration(abs(middle))} "
            f"{'behind' if middle > 0 else 'ahead'}: shifted by the median",
        )
    spans = {s.name: round(s.span * NS) for s, _ in told if shifts.get(s.name, 0) is None}
    return Clock(recorder, header, shifts, spans)


def _weight(sense: SenseStamps) -> tuple[bool, int]:
    """Return how well a sense tells the time: often and without delay."""
    return sense.steady and sense.lag < 0.5, len(sense.recorder)


def _few(stamps: Stamps) -> Stamps:
    """Return at most a thousand of some stamps, evenly spread."""
    return stamps[:: max(1, len(stamps) // 1000)]


def _growing(sense: SenseStamps) -> tuple[Stamps, Stamps]:
    """Return pairs of recorder's and header's stamps [ns], both growing."""
    known = sense.header != 0
    recorder, first = np.unique(sense.recorder[known], return_index=True)
    return recorder, np.maximum.accumulate(sense.header[known][first])


def _duration(seconds: float) -> str:
    """Return a duration in words."""
    size = abs(seconds)
    for unit, name in ((365.25 * 86400, "years"), (86400, "days"), (3600, "h"), (60, "min")):
        if size >= 2 * unit:
            return f"{size / unit:.1f} {name}"
    return f"{size:.2f} s"
