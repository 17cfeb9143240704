"""Clocks of a live graph: the wall clock, or the time that is published on ``/clock``."""

import threading
import time
from typing import Protocol

from andabata.records.messages import NS
from andabata.ros.graph import RosError


class GraphClock(Protocol):
    """Source of a graph's time."""

    def now_ns(self) -> int:
        """Return the time [ns]; 0 before the first one is known."""

    def sleep_until(self, stamp_ns: int) -> None:
        """Wait for a time [ns].

        Raises:
            RosError: If the time runs back.
        """


class WallClock:
    """The system's clock."""

    def now_ns(self) -> int:
        """Return the time [ns]."""
        return time.time_ns()

    def sleep_until(self, stamp_ns: int) -> None:
        """Wait for a time [ns]."""
        rest = stamp_ns - time.time_ns()
        if rest > 0:
            time.sleep(rest / NS)


class SimulatedClock:
    """Clock that stands between two messages of ``/clock``."""

    def __init__(self) -> None:
        """Begin without a time."""
        self._now_ns, self._has_jumped = 0, False
        self._changed = threading.Condition()

    def set(self, stamp_ns: int) -> None:
        """Take a time of ``/clock`` [ns]."""
        with self._changed:
            self._has_jumped = self._has_jumped or stamp_ns < self._now_ns
            self._now_ns = stamp_ns
            self._changed.notify_all()

    def now_ns(self) -> int:
        """Return the last time [ns]; 0 before the first one."""
        return self._now_ns

    def sleep_until(self, stamp_ns: int) -> None:
        """Wait for a time [ns].

        Raises:
            RosError: If the time has run back, now or before.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._now_ns >= stamp_ns or self._has_jumped)
            if self._has_jumped:
                raise RosError("/clock: expected time that increases, got a jump back; start again")
