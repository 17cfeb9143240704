"""Window of what was measured last in every direction, its points side by side in memory."""

from collections import deque
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from traversability.cloud import PointCloud

_CAPACITY = 1 << 17
"""Number of points for which there is memory at first: two half turns of 1081 beams."""


class Part(NamedTuple):
    """Points that were placed at once, at least one.

    Attributes:
        cloud: Placed points with stamps, in ``odom``.
        newest: Stamp of the newest of them [s].
        angle: Angle of the head at their end [rad].
    """

    cloud: PointCloud
    newest: float
    angle: float = 0.0


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
        parts: The parts.
        settled: Stamp up to which places were measured with what lies beside them [s]: the head has
            turned on since.
    """

    points: NDArray[np.float32]
    stamps: NDArray[np.float64]
    parts: tuple[Part, ...]
    settled: float

    def since(self, stamp: float) -> Swath:
        """Return what was measured around the places that have settled since a stamp.

        That is one swath of the head, as far before these places as it has turned past them: what
        was measured half a turn earlier lies centimetres off, and would be a step beside them.

        Args:
            stamp: An earlier ``settled`` [s], so that every place comes once.
        """
        newest = self.parts[-1].newest
        lag, begin = newest - self.settled, len(self.points)
        # Parts are in order: those before the first old one are older still.
        for part in reversed(self.parts):
            if part.newest <= stamp - lag:
                break
            newest, begin = max(newest, part.newest), begin - len(part.cloud)
        due = (newest - self.settled, newest - stamp)
        return Swath(self.points[begin:], self.stamps[begin:], newest, due)


class SweepBuffer:
    """Memory of a window: parts come at its end and go at its begin.

    Attributes:
        parts: Parts, oldest first.
    """

    def __init__(self) -> None:
        """Allocate memory."""
        self._points = np.empty((_CAPACITY, 3), dtype=np.float32)
        self._stamps = np.empty(_CAPACITY)
        self.clear()

    def clear(self) -> None:
        """Forget all parts."""
        self.parts: deque[Part] = deque()
        self._begin = self._end = 0

    def append(self, part: Part) -> None:
        """Add a part.

        Raises:
            ValueError: If the part has no points, or they have no stamps.
        """
        points, stamps = part.cloud.points, part.cloud.stamps
        if stamps is None or not len(stamps):
            raise ValueError("stamps: expected points with stamps, got none")
        if self._end + len(stamps) > len(self._stamps):
            self._make_room(len(stamps))
        begin, self._end = self._end, self._end + len(stamps)
        self._points[begin : self._end] = points
        self._stamps[begin : self._end] = stamps
        self.parts.append(part)

    def remove_oldest(self) -> None:
        """Remove the oldest part."""
        self._begin += len(self.parts.popleft().cloud)

    def window(self, settled: float) -> SweepWindow:
        """Return the window, in memory that may be written to when the next part is added.

        Args:
            settled: Stamp up to which places have settled [s].
        """
        points = self._points[self._begin : self._end]
        stamps = self._stamps[self._begin : self._end]
        return SweepWindow(points, stamps, tuple(self.parts), settled)

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
