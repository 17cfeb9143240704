"""Window of what was measured last in every direction, its points side by side in memory."""

from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from traversability.cloud import PointCloud

_CAPACITY = 1 << 17
"""Number of points for which there is memory at first: two half turns of 1081 beams."""


class Swath(NamedTuple):
    """Points around places that have settled; see ``SweepWindow.since``.

    Attributes:
        points: Points in ``odom`` [m], float32, shape (n, 3).
        stamps: Their times [s], float64, shape (n,).
        newest: Time of the newest of them [s].
        due: Ages before ``newest`` of what has settled, from the first on, less than the second.
    """

    points: NDArray[np.float32]
    stamps: NDArray[np.float64]
    newest: float
    due: tuple[float, float]


@dataclass(frozen=True)
class SweepWindow:
    """What was measured last in every direction: a whole cloud at any time, not at the turn's end.

    Attributes:
        points: Placed points in ``odom``, part after part, oldest first [m], float32, shape (n, 3).
        stamps: Their times [s], float64, shape (n,).
        parts: Number of points and newest stamp [s] of each part; none is empty.
        settled: Stamp up to which places were measured with what lies beside them [s]: the head has
            turned on since.
    """

    points: NDArray[np.float32]
    stamps: NDArray[np.float64]
    parts: tuple[tuple[int, float], ...]
    settled: float

    def since(self, stamp: float) -> Swath:
        """Return what was measured around the places that have settled since a stamp.

        That is one swath of the head, as far before these places as it has turned past them: what
        was measured half a turn earlier lies centimetres off, and would be a step beside them.

        Args:
            stamp: An earlier ``settled`` [s], so that every place comes once.
        """
        newest = self.parts[-1][1]
        lag, begin = newest - self.settled, len(self.points)
        # Parts are in order: those before the first old one are older still.
        for count, last in reversed(self.parts):
            if last <= stamp - lag:
                break
            newest, begin = max(newest, last), begin - count
        due = (newest - self.settled, newest - stamp)
        return Swath(self.points[begin:], self.stamps[begin:], newest, due)


class SweepBuffer:
    """Memory of a window: parts come at its end and go at its begin.

    Attributes:
        parts: Parts with the angle of the head at the end of each [rad], oldest first.
    """

    def __init__(self) -> None:
        """Allocate memory."""
        self._points = np.empty((_CAPACITY, 3), dtype=np.float32)
        self._stamps = np.empty(_CAPACITY)
        self.clear()

    def clear(self) -> None:
        """Forget all parts."""
        self.parts: deque[tuple[PointCloud, float]] = deque()
        self._begin = self._end = 0

    def append(self, part: PointCloud, angle: float = 0.0) -> None:
        """Add a part.

        Args:
            part: Placed points with stamps, at least one.
            angle: Angle of the head at its end [rad].

        Raises:
            ValueError: If the part has no points, or they have no stamps.
        """
        if part.stamps is None or not len(part):
            raise ValueError("stamps: expected points with stamps, got none")
        if self._end + len(part) > len(self._stamps):
            self._make_room(len(part))
        begin, self._end = self._end, self._end + len(part)
        self._points[begin : self._end] = part.points
        self._stamps[begin : self._end] = part.stamps
        self.parts.append((part, angle))

    def remove_oldest(self) -> None:
        """Remove the oldest part."""
        self._begin += len(self.parts.popleft()[0])

    def window(self, settled: float) -> SweepWindow:
        """Return the window, in memory that may be written to when the next part is added.

        Args:
            settled: Stamp up to which places have settled [s].
        """
        points = self._points[self._begin : self._end]
        stamps = self._stamps[self._begin : self._end]
        parts = tuple((len(part), part.newest) for part, _ in self.parts)
        return SweepWindow(points, stamps, parts, settled)

    def _make_room(self, count: int) -> None:
        """Move all points to the begin of memory that has room for some more."""
        points = self._points[self._begin : self._end]
        stamps = self._stamps[self._begin : self._end]
        self._begin, self._end = 0, len(stamps)
        if 2 * (self._end + count) > len(self._stamps):
            capacity = 4 * (self._end + count)
            self._points = np.empty((capacity, 3), dtype=np.float32)
            self._stamps = np.empty(capacity)
        self._points[: self._end], self._stamps[: self._end] = points, stamps
