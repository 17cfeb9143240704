"""Rate and age of the usable readings of each sense, against its own usual ones.

Readings that nothing can use, such as numbers that are none, do not count. A sense that sends fewer
of them than usual, or later than usual, is named; what still arrives of it is used. Both laws need
no clock but the robot's: a constant difference of the clocks belongs to the usual age.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.localization.measurements import (
    FORCE,
    GYRO,
    LEFT,
    MAX_FLUX,
    MAX_FORCE,
    MAX_GYRO_RATE,
    MAX_WHEEL_SPEED,
    RIGHT,
    STAMP,
)
from terrain.kernel import borrowing_kernel

NAMES = ("imu", "wheels", "compass", "gravity", "gnss")
"""Names of the senses in warnings; ``gravity`` is the accelerometer of the inertial unit."""

RATE, USUAL_RATE, KNOWN, AGE, USUAL_AGE, DOUBT, SINCE, FIRST, NEWEST, READ, COLUMNS = range(11)
"""Columns of a sense: rate at which its usable readings arrive [Hz], its usual rate by their own
stamps, time for which it is known [s], age of its newest reading on arrival [s], its usual age,
doubt and its begin [s], stamps of the first and of the newest reading [s], number of readings since
the first; and the number of columns."""

FEW, LATE = 1, 2
"""Doubts; 0 is none."""

_WINDOW = 1.0
"""Time constant of the rate [s]: without readings it halves in 0.7 s."""

_LEARNING = 3.0
"""Time after the first reading after which the usual rate is known [s]."""

_BEGUN = 1e-9
"""Time for which a sense is known at its first reading [s]."""

_LONGEST_GAP = 1.5
"""Longest time between the stamps of readings that the usual rate is learned from [s]."""

_MEMORY = 30.0
"""Time constant with which the usual rate follows [s]."""

_LEAST_RATE = 5.0
"""Usual rate from which the rate is judged [Hz]: below, each lost message would be a shortage."""

_FEW, _ENOUGH = 0.5, 0.7
"""Shares of the usual rate below which a doubt begins, and above which it ends."""

_LATE, _PUNCTUAL = 0.5, 0.25
"""Ages beyond the usual one above which a doubt begins, and below which it ends [s]."""

_FALL, _RISE = 0.5, 0.02
"""Weights of a reading's age in the usual one, if it is younger and if it is older: messages that
wait together at a start are old once."""


@borrowing_kernel
def _follow_usual_rate(
    sense: NDArray[np.float64], count: int, newest: float, is_known: bool
) -> None:
    """Follow the usual rate by the stamps of readings: a process that was held up gets a burst."""
    time, sense[NEWEST] = newest - sense[NEWEST], newest
    sense[READ] += count
    if not is_known and time > _LONGEST_GAP:
        # What waited at the start: learn from here on.
        sense[KNOWN], sense[FIRST], sense[READ] = _BEGUN, newest, 0.0
    elif not is_known:
        sense[USUAL_RATE] = sense[READ] / (newest - sense[FIRST])
    elif count > _ENOUGH * sense[USUAL_RATE] * time:
        near = min(count / time, 1.25 * sense[USUAL_RATE])
        sense[USUAL_RATE] += (near - sense[USUAL_RATE]) * min(time / _MEMORY, 1.0)


@borrowing_kernel
def follow_arrivals(
    sense: NDArray[np.float64], stamp: float, dt: float, count: int, newest: float
) -> None:
    """Follow the arrivals of a sense, and judge them.

    Args:
        sense: Numbers of the sense, changed in place, shape (COLUMNS,).
        stamp: End of the period [s].
        dt: Length of the period [s].
        count: Number of usable readings that arrived in it.
        newest: Stamp of the newest of them [s]; anything without one.
    """
    if sense[KNOWN] == 0.0 and count > 0:
        sense[KNOWN], sense[USUAL_AGE] = _BEGUN, stamp - newest
        sense[FIRST], sense[NEWEST] = newest, newest
        return
    if not dt > 0.0 or sense[KNOWN] == 0.0:
        return
    sense[RATE] += (count / dt - sense[RATE]) * (1.0 - np.exp(-dt / _WINDOW))
    is_known = sense[KNOWN] >= _LEARNING
    sense[KNOWN] += min(dt, _WINDOW)
    if count > 0 and newest > sense[NEWEST]:
        _follow_usual_rate(sense, count, newest, is_known)
    is_late = sense[DOUBT] == LATE
    if count > 0:
        sense[AGE] = stamp - newest
        lag = sense[AGE] - sense[USUAL_AGE]
        is_late = is_known and lag > (_PUNCTUAL if is_late else _LATE)
        if not is_late:
            sense[USUAL_AGE] += (_FALL if lag < 0.0 else _RISE) * lag if is_known else lag
    least = (_ENOUGH if sense[DOUBT] == FEW else _FEW) * sense[USUAL_RATE]
    is_few = is_known and sense[USUAL_RATE] >= _LEAST_RATE and sense[RATE] < least
    doubt = LATE if is_late else (FEW if is_few else 0)
    if sense[DOUBT] == 0 and doubt != 0:
        sense[SINCE] = stamp
    sense[DOUBT] = doubt


@borrowing_kernel
def _is_below(row: NDArray[np.float64], first: int, end: int, limit: float) -> bool:
    """Return true if the stamp is finite and some numbers are smaller than a limit."""
    usable = bool(np.isfinite(row[STAMP]))
    for c in range(first, end):
        # A number that is none compares as false.
        usable = usable and abs(row[c]) < limit
    return usable


@borrowing_kernel
def _follow(
    sense: NDArray[np.float64],
    stamp: float,
    dt: float,
    rows: NDArray[np.float64],
    columns: tuple[int, int, float],
) -> None:
    """Follow a sense by its rows: first column, the one after the last, and limit of a reading."""
    count, newest = 0, -np.inf
    for k in range(len(rows)):
        if _is_below(rows[k], columns[0], columns[1], columns[2]):
            count += 1
            newest = max(newest, rows[k, STAMP])
    follow_arrivals(sense, stamp, dt, count, newest)


@borrowing_kernel
def follow_senses(
    senses: NDArray[np.float64],
    stamp: float,
    dt: float,
    imu: NDArray[np.float64],
    wheels: NDArray[np.float64],
    mag: NDArray[np.float64],
    gnss: NDArray[np.float64],
) -> int:
    """Follow the arrivals of all senses of the filter in a period.

    Args:
        senses: Numbers of the senses in the order of ``NAMES``, changed in place, shape (5,
            COLUMNS).
        stamp: End of the period [s].
        dt: Length of the period [s].
        imu: Inertial rows, shape (k, 7).
        wheels: Encoder rows, shape (k, 3).
        mag: Compass rows, shape (k, 4).
        gnss: Rows of the receiver, shape (k, 5); a report of no fix is an arrival.

    Returns:
        Number of senses that are doubted.
    """
    _follow(senses[0], stamp, dt, imu, (GYRO, FORCE, MAX_GYRO_RATE))
    _follow(senses[1], stamp, dt, wheels, (LEFT, RIGHT + 1, MAX_WHEEL_SPEED))
    _follow(senses[2], stamp, dt, mag, (1, 4, MAX_FLUX))
    _follow(senses[3], stamp, dt, imu, (FORCE, FORCE + 3, MAX_FORCE))
    _follow(senses[4], stamp, dt, gnss, (1, 1, 0.0))
    doubted = 0
    for k in range(len(senses)):
        doubted += senses[k, DOUBT] != 0.0
    return doubted


class ArrivalRate:
    """Supervision of the rate and the age of all senses of the filter.

    Attributes:
        doubted: Number of senses that send too few readings, or late ones.
    """

    def __init__(self) -> None:
        """Begin without any reading."""
        self.reset(0.0)

    def reset(self, stamp: float) -> None:
        """Begin anew at a time [s]."""
        self._senses, self._now = np.zeros((len(NAMES), COLUMNS)), stamp
        self.doubted = 0

    def update(
        self,
        stamp: float,
        imu: NDArray[np.float64],
        wheels: NDArray[np.float64],
        mag: NDArray[np.float64],
        gnss: NDArray[np.float64],
    ) -> None:
        """Take the rows of a period; see ``follow_senses``."""
        dt, self._now = stamp - self._now, stamp
        self.doubted = follow_senses(self._senses, stamp, dt, imu, wheels, mag, gnss)

    def warnings(self) -> dict[str, str]:
        """Return what is wrong with the arrivals, by the name of the sense."""
        if not self.doubted:
            return {}
        rows = zip(NAMES, self._senses, strict=True)
        texts = {name: arrival_warning(name, row, self._now) for name, row in rows if row[DOUBT]}
        if "imu" in texts:  # What is wrong with the rows is wrong with their accelerometer, too.
            texts.pop("gravity", None)
        return texts


def arrival_warning(name: str, sense: NDArray[np.float64], now: float) -> str:
    """Return the warning about a sense that is doubted.

    Args:
        name: Name of the sense.
        sense: Its numbers, shape (COLUMNS,).
        now: Time [s].
    """
    if sense[DOUBT] == LATE:
        return f"{name}: arrives late, by {sense[AGE] - sense[USUAL_AGE]:.1f} s more than usual"
    lost = 100 * (1 - sense[RATE] / sense[USUAL_RATE])
    time = now - sense[SINCE]
    return f"{name}: fewer usable readings than usual, by {lost:.0f} %, for {time:.1f} s"
