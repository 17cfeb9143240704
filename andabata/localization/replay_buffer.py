"""Buffer of past periods of the filter, for fixes that arrive late.

A late fix is inserted into the period in which it was taken, and the filter runs again from there:
the result is that of a fix that arrived in time.
"""

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.localization.filter_parameters import NoiseModel
from andabata.localization.measurements import STAMP_TOLERANCE, Measurements


class FilterPeriod(NamedTuple):
    """Belief of the filter at the begin of a control period, and what arrived in the period.

    Attributes:
        belief: Record of the ``Belief``, shape (1,).
        now: Stamp of the state [s].
        measurements: Measurements that arrived.
        noise: Noise that the period is filtered with.
    """

    belief: NDArray[np.void]
    now: float
    measurements: Measurements
    noise: NoiseModel

    def with_fix(self, fix: NDArray[np.float64]) -> Measurements:
        """Return the period's measurements with one more fix, in the order of their stamps.

        Args:
            fix: Row as in ``Measurements.gnss``, shape (6,).
        """
        fixes = self.measurements.gnss
        place = int(np.searchsorted(fixes[:, 0], fix[0]))
        fixes = np.concatenate([fixes[:place], fix[None], fixes[place:]])
        return self.measurements._replace(gnss=fixes)


class ReplayBuffer:
    """Latest periods of the filter, oldest first."""

    def __init__(self, max_delay: float) -> None:
        """Begin empty.

        Args:
            max_delay: Time span that is kept [s].
        """
        self._max_delay = max_delay
        self._periods: deque[FilterPeriod] = deque()

    def clear(self) -> None:
        """Remove all periods."""
        self._periods.clear()

    def append(self, period: FilterPeriod) -> None:
        """Add a period after the others."""
        self._periods.append(period)

    def drop_old(self, now: float) -> None:
        """Remove the periods that began more than ``max_delay`` before ``now`` [s]."""
        while now - self._periods[0].now > self._max_delay:
            self._periods.popleft()

    def reaches(self, stamp: float) -> bool:
        """Return True if a period contains a stamp [s], or one before it does."""
        return bool(self._periods) and self._periods[0].now <= stamp + STAMP_TOLERANCE

    def rewind(self, stamp: float) -> list[FilterPeriod]:
        """Remove and return the periods from the one that contains a stamp on.

        A stamp between two periods belongs to the later one, which begins at that instant: less has
        to be filtered again.

        Args:
            stamp: Time of a late measurement [s].

        Returns:
            Periods, oldest first; none if the stamp is older than the buffer, which then stays as
            it is.
        """
        for count, period in enumerate(reversed(self._periods), start=1):
            if period.now <= stamp + STAMP_TOLERANCE:
                return [self._periods.pop() for _ in range(count)][::-1]
        return []

    def latest_finite_state(self) -> NDArray[np.float64] | None:
        """Return the latest state whose numbers are all finite, None without any."""
        states = (period.belief["x"][0] for period in reversed(self._periods))
        return next((x for x in states if np.isfinite(x).all()), None)
