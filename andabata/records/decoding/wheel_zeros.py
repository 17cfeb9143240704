"""Zeros between the speeds of wheels: messages of a node that publishes beside the driver.

A robot that drives does not stand for one message and drive on as before. Rows of zeros between
two rows of like speeds are of another publisher, such as a joint_state_publisher or a watchdog.
"""

import numpy as np
from numpy.typing import NDArray

_MOVING = 0.3
"""Least wheel speed of a robot that drives [rad/s, or the reading's own unit at its scale]."""

MOST = 1e6
"""Number from which nothing is a wheel speed, in whatever unit: a damaged message."""

_LONGEST = 0.15
"""Longest time between the rows around zeros [s]: within it no robot stops and starts."""

_ALIKE = 0.5
"""Largest change between the rows around zeros, as a share of the larger."""


def zeros_between(rows: NDArray[np.float64], moving: float = _MOVING) -> NDArray[np.bool_]:
    """Return which rows are zeros that another publisher sent in between, shape (k,).

    Args:
        rows: Stamp [s], left and right wheel speed in order of time, shape (k, 3).
        moving: Least speed of a robot that drives, in the unit of the rows.
    """
    speeds = np.abs(rows[:, 1:3]).max(axis=1)
    is_zero = (rows[:, 1:3] == 0).all(axis=1)
    drives = np.flatnonzero((speeds > moving) & (speeds < MOST))
    is_foreign = np.zeros(len(rows), dtype=np.bool_)
    if len(drives) < 2 or not is_zero.any():
        return is_foreign
    after = np.searchsorted(drives, np.flatnonzero(is_zero))
    for k, place in zip(np.flatnonzero(is_zero), after, strict=True):
        if 0 < place < len(drives):
            is_foreign[k] = _alike(rows[drives[place - 1]], rows[drives[place]])
    return is_foreign


def _alike(one: NDArray[np.float64], other: NDArray[np.float64]) -> bool:
    """Return whether a robot drives on from one row to the other."""
    change = np.abs(other[1:3] - one[1:3]).max()
    largest = max(np.abs(one[1:3]).max(), np.abs(other[1:3]).max())
    return bool(other[0] - one[0] < _LONGEST and change < _ALIKE * largest)
