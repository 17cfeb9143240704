"""Times of a cloud's points in seconds, from any unit and zero that drivers count in.

Ouster writes ``t`` (uint32, ns), Livox ``offset_time`` (uint32, ns) or ``timestamp`` (float64, ns
since the epoch), Velodyne ``time`` (float32, s, sometimes counted back from the end of the turn, or
us), Hesai and RoboSense ``timestamp`` (float64, s since the epoch). No message names the unit, so
the span of the values does: a scan lasts between a millisecond and a few seconds.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

LONGEST_TURN = 1.0
"""Longest turn of a 3D laser [s]: times further from the header's are implausible."""

LONGEST_SCAN = 4.0
"""Longest scan in a file [s]; a turning 2D laser takes more than 3 s."""

_SHORTEST = 1e-3
"""Shortest scan [s]."""

_SHORTEST_UNUSUAL = 1e-2
"""Shortest scan in a unit that the number's type does not suggest, which has to fit better [s]."""

_EPOCH = (9e8, 4.2e9)
"""Span of plausible stamps, the years 1998 to 2103 [s since 1970]."""

_UNITS = {"seconds": 1.0, "milliseconds": 1e-3, "microseconds": 1e-6, "nanoseconds": 1e-9}
"""Length of each unit [s]."""

_NAMES = frozenset(
    (
        *("t", "ts", "dt", "time", "times", "stamp", "stamps", "timestamp", "timestamps"),
        *("offsettime", "timeoffset", "toffset", "relativetime", "reltime", "timerel"),
        *("deltat", "deltatime", "timedelta", "pointtime", "pointtimestamp", "pointtimeoffset"),
        *("firingtime", "gpstime"),
    )
)
_SECONDS = ("stamps", "gpstime")
"""Columns that are always seconds, of our files and of LAS files."""

_SUFFIX = re.compile(
    r"[_ ]?(ns|nsec|nsecs|nanoseconds|us|usec|usecs|microseconds|ms|msec|msecs|milliseconds|"
    r"s|sec|secs|seconds)$"
)
_SUFFIXES = {"n": "nanoseconds", "u": "microseconds", "mi": "milliseconds", "ms": "milliseconds"}


@dataclass(frozen=True)
class PointTimes:
    """Times of a cloud's points, and the field that they were read from.

    Attributes:
        seconds: Time of each point [s], float64, shape (n,): after the header's stamp if there is
            one, else as the file counts; None without a plausible field.
        field: Name of the field, None if ``seconds`` is.
        remarks: Sentences for the user about what was assumed or found implausible.
    """

    seconds: NDArray[np.float64] | None = None
    field: str | None = None
    remarks: tuple[str, ...] = ()


def time_unit_of(name: str) -> tuple[bool, str | None]:
    """Return True if a field's name is one of a time, and the unit that the name ends with."""
    word = name.strip().lower()
    if _plain(word) in _NAMES:
        return True, None
    match = _SUFFIX.search(word)
    if match is None or _plain(word[: match.start()]) not in _NAMES:
        return False, None
    ending = match.group(1)
    return True, _SUFFIXES.get(ending[:2], _SUFFIXES.get(ending[:1], "seconds"))


def _plain(word: str) -> str:
    """Return the letters and digits of a name."""
    return "".join(letter for letter in word if letter.isalnum())


def read_point_times(
    columns: Mapping[str, NDArray[Any]], header: float | None = None
) -> PointTimes:
    """Return the times of points from the first plausible field.

    Args:
        columns: Columns by name, shape (n,) each, without no-returns.
        header: Stamp of the message [s since the epoch]; None for a file, which has none.
    """
    remarks: list[str] = []
    for name, values in columns.items():
        known, unit = time_unit_of(name)
        if not known or not len(values):
            continue
        if header is None and _plain(name) in _SECONDS and values.dtype.kind == "f":
            return PointTimes(values.astype(np.float64), name)
        seconds, remark = _seconds(values, unit, header)
        remarks += [f"field {name}: {remark}"] if remark else []
        if seconds is not None:
            return PointTimes(seconds, name, tuple(remarks))
    return PointTimes(remarks=tuple(remarks))


def _seconds(
    values: NDArray[Any], unit: str | None, header: float | None
) -> tuple[NDArray[np.float64] | None, str]:
    """Return times in seconds, or None, and a remark on them, which may be empty."""
    longest = LONGEST_SCAN if header is None else LONGEST_TURN
    numbers = values.astype(np.float64)
    if not np.isfinite(numbers).all():
        bad = int((~np.isfinite(numbers)).sum())
        return None, f"expected times, got {bad} of {len(numbers)} not finite; not used"
    low, high = float(numbers.min()), float(numbers.max())
    usual = unit or ("nanoseconds" if values.dtype.kind in "iu" else "seconds")
    # Large numbers count from 1970; otherwise the usual unit is tried first.
    names = (usual,) if unit else (usual, *(name for name in _UNITS if name != usual))
    for name in _UNITS if unit is None else names:
        scale = _UNITS[name]
        if _EPOCH[0] <= low * scale and high * scale <= _EPOCH[1]:
            if (low < high or len(numbers) == 1) and (high - low) * scale <= longest:
                return _since_epoch(numbers, scale, header, longest)
            if values.dtype.itemsize == 8 or low == high:
                names = (name,)  # So large a number counts from 1970, whatever else might fit.
                break
    for name in names:
        if _fits(low, high, name, usual, longest, unit is not None):
            remark = "" if name == usual else f"taken as {name} ({low:.6g} to {high:.6g})"
            return _since_begin(numbers, low, high, name, remark, header, longest)
    if header is None and usual == "seconds":
        remark = f"spans {high - low:.6g} s, longer than a scan of {longest:g} s; kept as seconds"
        return numbers * _UNITS[usual], remark
    return None, (
        f"expected point times that span 1 ms to {longest:g} s in s, ms, us or ns, got "
        f"{low:.10g} {'for all' if low == high else f'to {high:.10g}'} of {values.dtype.name}; "
        "not used"
    )


def _fits(low: float, high: float, name: str, usual: str, longest: float, sure: bool) -> bool:
    """Return True if numbers in a unit span as long as a scan may last."""
    span = (high - low) * _UNITS[name]
    if name != usual:
        return _SHORTEST_UNUSUAL <= span < longest
    # Less than a millisecond of seconds is a small piece of a scan, of whole nanoseconds a counter.
    short = 0.0 if sure or usual == "seconds" else _SHORTEST
    if low == high:
        return abs(low) * _UNITS[name] <= longest
    return short <= span <= longest


def _since_epoch(
    numbers: NDArray[np.float64], scale: float, header: float | None, longest: float
) -> tuple[NDArray[np.float64], str]:
    """Return times that count from 1970, after the header's where there is one."""
    if header is None:
        return numbers * scale, ""
    offsets = (numbers - header / scale) * scale
    if np.abs(offsets).max() <= longest:
        return offsets, ""
    away = float(offsets[np.abs(offsets).argmin()])
    remark = (
        f"counts by another clock, {away:.6g} s from the header's; taken from the first point on"
    )
    return (numbers - numbers.min()) * scale, remark


def _since_begin(
    numbers: NDArray[np.float64],
    low: float,
    high: float,
    name: str,
    remark: str,
    header: float | None,
    longest: float,
) -> tuple[NDArray[np.float64], str]:
    """Return times that count from the header's, or from the start of some clock."""
    scale = _UNITS[name]
    if low == high and len(numbers) > 1 and header is not None:
        remark = f"holds {low:.6g} for all points; motion within the scan is not undone"
    if header is None or max(abs(low), abs(high)) * scale <= longest:
        return numbers * scale, remark
    apart = f"begins at {low * scale:.6g} s, not near the header's; taken from the first point on"
    return (numbers - low) * scale, f"{remark}; {apart}" if remark else apart
