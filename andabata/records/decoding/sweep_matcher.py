"""Matching of the rotating laser's sweeps with the head angles of the same stamps."""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from andabata.records.messages import NS, header_ns
from andabata.records.topics import RosMessage

Pair = tuple[RosMessage, RosMessage]
"""A sweep and the head's angle at its stamp."""

_TIMEOUT = round(0.5 * NS)
"""Time for which a sweep waits for its head angle, and an angle for its sweep [ns]."""


class SweepMatcher:
    """Pairs sweeps with head angles of equal stamps, whichever comes first."""

    def __init__(self) -> None:
        """Create a matcher without messages."""
        self._scans: deque[tuple[int, RosMessage]] = deque()
        self._heads: dict[int, RosMessage] = {}

    def add_scan(self, message: RosMessage) -> None:
        """Add a sweep."""
        self._scans.append((header_ns(message), message))

    def add_head(self, message: RosMessage) -> None:
        """Add an angle of the head."""
        self._heads[header_ns(message)] = message

    def take(self) -> list[Pair]:
        """Return the pairs that are complete, oldest first, and drop what has waited too long.

        A sweep whose angle is still missing waits, and those after it wait with it: a cloud is made
        of sweeps in order.
        """
        newest = max((stamp for stamp, _ in self._scans), default=0)
        complete: list[Pair] = []
        while self._scans:
            stamp, scan = self._scans[0]
            head = self._heads.pop(stamp, None)
            if head is not None:
                complete.append((scan, head))
            elif newest - stamp < _TIMEOUT:
                break
            self._scans.popleft()
        for stamp in [s for s in self._heads if newest - s > _TIMEOUT]:
            del self._heads[stamp]
        return complete


def valid_ranges(scan: RosMessage) -> NDArray[np.float32]:
    """Return the ranges of a scan [m], ``inf`` outside of its bounds (REP-117), shape (b,)."""
    ranges = np.array(scan.ranges, dtype=np.float32)
    with np.errstate(invalid="ignore"):
        ranges[~((ranges >= scan.range_min) & (ranges <= scan.range_max))] = np.inf
    return ranges
