"""Pace of a drive that is watched: real time times a factor, a pause, single steps."""

import math
import threading
import time
from collections.abc import Callable

AS_FAST_AS_IT_GOES = math.inf
"""Speed of a drive that waits for nothing."""

_SLACK = 0.2
"""Delay beyond which a drive that cannot keep up with its pace does not catch up [s]."""


class Pace:
    """Lets a drive wait until its next control step is due.

    All methods may be called from any thread.
    """

    def __init__(
        self, speed: float = 1.0, is_paused: bool = False, now: Callable[[], float] = time.monotonic
    ) -> None:
        """Begin.

        Args:
            speed: Simulated or recorded seconds in a second; infinite waits for nothing.
            is_paused: True to begin with a pause.
            now: Clock [s].
        """
        self._changed = threading.Condition()
        self._speed, self._is_paused, self._now = speed, is_paused, now
        self._steps, self._due, self._is_closed = 0, -math.inf, False
        self._is_nudged = False

    @property
    def speed(self) -> float:
        """Simulated or recorded seconds in a second."""
        return self._speed

    @property
    def is_paused(self) -> bool:
        """True while nothing moves but by single steps."""
        return self._is_paused

    def set_speed(self, speed: float) -> None:
        """Go on at another speed.

        Raises:
            ValueError: If it is not above 0.
        """
        if not speed > 0:
            raise ValueError(f"speed: expected above 0, got {speed}")
        with self._changed:
            self._speed, self._due = speed, -math.inf
            self._changed.notify_all()

    def pause(self) -> None:
        """Stop before the next step."""
        with self._changed:
            self._is_paused, self._steps = True, 0

    def play(self) -> None:
        """Go on."""
        with self._changed:
            self._is_paused, self._due = False, -math.inf
            self._changed.notify_all()

    def step(self) -> None:
        """Let one control step pass, and pause."""
        with self._changed:
            self._steps += 1
            self._is_paused = True
            self._changed.notify_all()

    def nudge(self) -> None:
        """Let a wait end at once, in a pause as well: something else is to be shown."""
        with self._changed:
            self._is_nudged = True
            self._changed.notify_all()

    def close(self) -> None:
        """Let everything pass from now on."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()

    def wait(self, period: float) -> None:
        """Wait until a control step is due.

        Args:
            period: Length of the step [s].
        """
        with self._changed:
            while not self._is_closed:
                if self._is_nudged:
                    self._is_nudged = False
                    return
                if self._is_paused:
                    if self._steps:
                        self._steps -= 1
                        return
                    self._changed.wait()
                    continue
                late = self._now() - self._due
                if late >= 0:
                    # After a long step the clock goes on from now, without a burst of steps.
                    begin = self._now() if late > _SLACK else self._due
                    self._due = begin + period / self._speed
                    return
                self._changed.wait(-late)
