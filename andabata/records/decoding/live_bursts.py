"""Bursts in a live session: readings are spread over the time since the burst before them.

A recording is known as a whole (``bursts``). Live, a burst is spread when it has arrived, over the
time that has passed: its last reading keeps its stamp, and no reading waits. So the robot has the
others up to the length of a burst late, as the driver that collects them makes it. A driver that
stamps the begin of a block cannot be distinguished from one that stamps its end before the block
is over: live, a burst is taken as what was measured before it.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.records.bursts import find_bursts
from andabata.records.messages import NS

Rows = NDArray[np.float64]

_MOST_STAMPS = 200
"""Number of last stamps by which bursts are recognised: two seconds of an IMU."""

_SHORTEST_STEP = 1e-6
"""Time between two readings of a burst of which a part was used before [s]."""


class LiveBursts:
    """Spreads the readings of one topic that arrive in bursts.

    Attributes:
        text: Remark on the bursts, None without any so far.
    """

    def __init__(self) -> None:
        """Create a spreader before the first reading."""
        self._stamps = np.zeros(0)
        self._last_row: Rows | None = None
        self._is_repeated = False
        self._last_given = -np.inf
        self.text: str | None = None

    def spread(self, rows: Rows) -> Rows:
        """Return the rows of a control period with the stamps of bursts spread.

        Readings that are sent twice are no burst: a topic with such ones stays as it is.

        Args:
            rows: Stamp [s] and numbers, in the order of their arrival, shape (k, width).
        """
        self._note_repeats(rows)
        self._stamps = np.append(self._stamps, rows[:, 0])[-max(_MOST_STAMPS, len(rows)) :]
        bursts = None if self._is_repeated else find_bursts(self._nanoseconds)
        if bursts is not None:
            shifts = bursts.spread(self._nanoseconds, is_after=False) - self._nanoseconds
            stamps = rows[:, 0] + shifts[-len(rows) :] / NS
            earliest = self._last_given + _SHORTEST_STEP * np.arange(1, len(rows) + 1)
            rows = np.column_stack([np.maximum(stamps, earliest), rows[:, 1:]])
            self.text = self.text or (
                f"readings come in bursts of {bursts.size:.1f}, {NS / bursts.period:.0f} a second "
                "in all: each is spread over the time before it"
            )
        self._last_given = max(self._last_given, float(rows[:, 0].max()))
        return rows

    @property
    def _nanoseconds(self) -> NDArray[np.int64]:
        """Last stamps [ns]."""
        return np.round(self._stamps * NS).astype(np.int64)

    def _note_repeats(self, rows: Rows) -> None:
        """Note whether a reading came twice."""
        known = rows if self._last_row is None else np.vstack([self._last_row, rows])
        self._is_repeated |= bool((known[1:] == known[:-1]).all(axis=1).any())
        self._last_row = rows[-1]
