"""Positions of wheels over time, and those of a second node that stands still among them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.records.decoding.unusable_message import UnusableMessageError

MAX_STEP = 0.5
"""Longest time between two positions that give a speed [s]."""

_MOVED = 0.2
"""Change of a position from which the wheels have turned [rad, m]."""

_WRAPPED = 2 * np.pi + 0.01
"""Bound of the angles of wheels that wrap around [rad]."""

_JUMP = 0.5
"""Least change between two messages that is a jump [rad]."""

_FASTEST = 100.0
"""Largest speed of a wheel [rad/s]; a faster one is a jump."""


@dataclass
class _Track:
    """Positions that follow one another.

    Attributes:
        first: First positions, shape (n,).
        last: Last positions, shape (n,).
        stamp: Time of the last [s].
    """

    first: NDArray[np.float64]
    last: NDArray[np.float64]
    stamp: float

    @property
    def stands(self) -> bool:
        """True if no wheel has turned."""
        return bool((self.first == self.last).all())


class PositionTracks:
    """Speeds by the positions of wheels, of one node or of two that publish in turn."""

    def __init__(self) -> None:
        """Create tracks without a position."""
        self._tracks: list[_Track] = []
        self._wraps = True

    @property
    def moved(self) -> bool:
        """True if the wheels have turned."""
        return any(float(np.abs(t.last - t.first).max()) > _MOVED for t in self._tracks)

    def add(
        self, positions: NDArray[np.float64] | None, stamp: float
    ) -> NDArray[np.float64] | None:
        """Return the speeds since the positions before, None without any.

        Args:
            positions: Positions of the wheels [rad]; None where they are missing, shape (n,).
            stamp: Their time [s].

        Raises:
            UnusableMessageError: If they jump back to those of a node that stands still, while the
                wheels turn.
        """
        if positions is None or not np.isfinite(positions).all():
            self._tracks.clear()
            return None
        self._wraps &= bool(np.abs(positions).max() < _WRAPPED)
        changes = [self._change(track.last, positions) for track in self._tracks]
        sizes = [float(np.abs(change).max()) for change in changes]
        nearest = int(np.argmin(sizes)) if sizes else -1
        if nearest < 0 or self._is_jump(sizes[nearest], stamp - self._tracks[nearest].stamp):
            self._tracks = [*self._tracks[-1:], _Track(positions, positions, stamp)]
            return None
        track = self._tracks[nearest]
        seconds = stamp - track.stamp
        track.last, track.stamp = positions, stamp
        if track.stands and any(self._moves_at(other, stamp) for other in self._tracks):
            raise UnusableMessageError(
                "expected positions that go on, got some that jump back to those of a second node"
            )
        return changes[nearest] / seconds if 0 < seconds < MAX_STEP else None

    def _change(
        self, before: NDArray[np.float64], after: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the change between two positions, the shorter way round where they wrap."""
        change = after - before
        return (change + np.pi) % (2 * np.pi) - np.pi if self._wraps else change

    @staticmethod
    def _is_jump(size: float, seconds: float) -> bool:
        """Return whether no wheel turns so far in a time."""
        return size > max(_JUMP, _FASTEST * seconds)

    @staticmethod
    def _moves_at(track: _Track, stamp: float) -> bool:
        """Return whether a track that is still published has turned."""
        return not track.stands and stamp - track.stamp < MAX_STEP
