"""Bursts: readings that are stamped when their bytes arrive, several at once, then a pause.

A sensor measures at a steady rate. Where its stamps come in bursts, each burst is spread evenly
over the time to its neighbour. Mostly a burst holds what was measured before it. A driver that
stamps the begin of a block makes it hold what came after; which of the two, the compass decides.
Wheels cannot: a robot turns later than its wheels.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Stamps = NDArray[np.int64]
Rows = NDArray[np.float64]

_CLOSE = 0.25
"""Interval within a burst, as a share of the mean one; below it two readings are of one burst."""

_BURST_SHARE = 0.4
"""Share of such intervals from which stamps come in bursts: pairs have a half of them."""

_FEWEST = 30
"""Number of stamps by which bursts are recognised."""

_LONGEST_CYCLE = 3.0
"""Time between two bursts, as a multiple of the median, beyond which readings are missing."""

_BETTER = 0.98
"""Error of the heading, as a share of the other, from which a burst holds what follows it."""


@dataclass(frozen=True)
class Bursts:
    """Bursts among the stamps of one topic.

    Attributes:
        starts: Index of the first reading of each burst, shape (b,).
        number: Number of readings, k.
        period: Median time between two readings when they are spread [ns].
    """

    starts: NDArray[np.intp]
    number: int
    period: float

    @property
    def size(self) -> float:
        """Mean number of readings in a burst."""
        return self.number / len(self.starts)

    def spread(self, stamps: Stamps, is_after: bool) -> Stamps:
        """Return stamps spread over the time to the neighbouring burst [ns], shape (k,).

        Args:
            stamps: Stamps in the order of the readings [ns], shape (k,).
            is_after: True if a burst holds what was measured after it.
        """
        ends = np.append(self.starts[1:], self.number)
        anchors = stamps[self.starts] if is_after else stamps[ends - 1]
        counts, gaps = ends - self.starts, np.diff(anchors).astype(np.float64)
        usual = self.period * counts
        cycles = usual.copy()
        part = slice(None, -1) if is_after else slice(1, None)
        regular = gaps < _LONGEST_CYCLE * usual[part]
        cycles[part] = np.where(regular, gaps, usual[part])
        burst = np.repeat(np.arange(len(counts)), counts)
        place = np.arange(self.number) - self.starts[burst]
        if not is_after:
            place = place - (counts[burst] - 1)
        steps = np.round(place * (cycles / counts)[burst]).astype(np.int64)
        return np.asarray(np.maximum.accumulate(anchors[burst] + steps))


def find_bursts(stamps: Stamps) -> Bursts | None:
    """Return the bursts of a topic, None where its stamps are even or too few.

    Args:
        stamps: Stamps in the order of the readings [ns], shape (k,).
    """
    intervals = np.diff(stamps).astype(np.float64)
    if len(stamps) < _FEWEST or not (intervals >= 0).all():
        return None
    # The mean over a tenth of the recording, in the middle of all of these: without its pauses.
    span = min(len(intervals), max(_FEWEST, len(intervals) // 10))
    sums = np.convolve(intervals, np.ones(span), "valid") / span
    period = float(np.median(sums))
    close = intervals < _CLOSE * period
    if not period > 0 or close.mean() < _BURST_SHARE:
        return None
    starts = np.concatenate([[0], np.flatnonzero(~close) + 1])
    counts = np.diff(starts)
    return Bursts(starts, len(stamps), float(np.median(np.diff(stamps[starts]) / counts)))


def holds_what_follows(
    spread_before: Rows, spread_after: Rows, yaw_rates: Rows, headings: Rows
) -> bool:
    """Return whether a gyro fits the compass better if its bursts hold what came after.

    Args:
        spread_before: Stamps of the gyro if bursts hold what came before [s], shape (k,).
        spread_after: Stamps of the gyro if they hold what came after [s], shape (k,).
        yaw_rates: Yaw rates of the gyro in any unit, shape (k,).
        headings: Stamp [s] and heading by the compass, unwrapped [rad], shape (j, 2).
    """
    if len(headings) < _FEWEST:
        return False
    before, after = (
        _misfit(stamps, yaw_rates, headings) for stamps in (spread_before, spread_after)
    )
    return after < _BETTER * before


def _misfit(stamps: Rows, yaw_rates: Rows, headings: Rows) -> float:
    """Return the root mean square error of a fit of the turned angle to the headings [rad]."""
    steps = np.diff(stamps) * (yaw_rates[1:] + yaw_rates[:-1]) / 2
    angles = np.concatenate([[0.0], np.cumsum(steps)])
    inside = (headings[:, 0] > stamps[0]) & (headings[:, 0] < stamps[-1])
    times, measured = headings[inside].T
    if len(times) < _FEWEST:
        return np.inf
    # Scale, bias of the gyro and first heading are unknown.
    columns = np.column_stack([np.interp(times, stamps, angles), times - times[0], 0 * times + 1])
    fitted = columns @ np.linalg.lstsq(columns, measured, rcond=None)[0]
    return float(np.sqrt(np.mean((fitted - measured) ** 2)))
