"""Plausibility of a sweeping laser's ranges: possible numbers, and ground that stays where it is.

From one sweep to the next the head turns by a degree or two and the robot moves by a centimetre:
the ground around the robot cannot move away from it, or towards it, in all directions at once.
Ranges that are multiplied, or off by a constant, from one moment to the next do so. Which ranges
are right is known by the ground's own usual distance: the doubt ends when it is there again.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.sensor_readings import Sweeps
from terrain.kernel import borrowing_kernel

_DOWN = np.deg2rad(115.0)
"""Angle from the zenith from which a beam meets the ground near the robot [rad]: at twice the
laser's height, or nearer."""

_LEAST_BEAMS = 20
"""Least number of beams to the ground with which sweeps are compared."""

_FARTHEST = 1e4
"""Range that no laser of a robot measures [m]."""

_MOST_IMPOSSIBLE = 0.05
"""Share of impossible numbers from which a sweep is not used."""

_STEP = 1.12
"""Ratio of ranges beyond which a beam to the ground is longer, or shorter, than before. The median
of the beams differs by 1.065 at most in development drives on rough ground, with errors of 2 cm
that are common to a sweep."""

_LONGEST_GAP = 0.25
"""Longest time between sweeps that are compared [s]."""

_RETURN = 0.5
"""Share of a step, in the mean distance of the ground, that has to be left to keep a doubt."""

_USUAL_WEIGHT, _RECENT_WEIGHT = 0.01, 0.04
"""Weights of a sweep in the usual distance of the ground, and in that of the last second."""

_FAR_GROUND = 3.0
"""Ranges of beams to the ground count as this at most [m]."""

_STAMP, _BEFORE, _USUAL, _RECENT, _CHANGE, _SINCE, _PENDING, _NUMBERS = range(8)
"""Numbers of a laser's memory: stamp of the last sweep [s]; mean distance of the ground in it,
usual, and recent [m]; change of it by the step that is doubted [m], 0 without a doubt; stamp of the
last sweep without one [s]; sign of a step that waits for the next sweep; and their number."""


@borrowing_kernel
def has_impossible(rows: NDArray[np.float32], least: float) -> bool:
    """Return true if a row has more than a few numbers that are finite and impossible.

    No number is no measurement, and infinity no return: both are possible.

    Args:
        rows: Sweeps or points [m], shape (k, n).
        least: Smallest number that is possible.
    """
    for row in rows:
        count = 0
        for number in row:
            count += np.isfinite(number) and (number < least or abs(number) > _FARTHEST)
        if count > _MOST_IMPOSSIBLE * len(row):
            return True
    return False


@borrowing_kernel
def _compare(
    ranges: NDArray[np.float32], last: NDArray[np.float32], beams: NDArray[np.int64]
) -> tuple[int, float]:
    """Compare the ground beams of two sweeps.

    Returns:
        1 if most are longer by a step, -1 if most are shorter, else 0; and the mean of the new
        ones [m], NaN without enough of them.
    """
    both, longer, shorter, total, count = 0, 0, 0, 0.0, 0
    for k in range(len(beams)):
        before, now = last[k], ranges[beams[k]]
        if not np.isfinite(now):
            continue
        total += min(now, np.float32(_FAR_GROUND))
        count += 1
        if np.isfinite(before):
            both += 1
            longer += now > _STEP * before
            shorter += before > _STEP * now
    mean = total / count if count >= _LEAST_BEAMS else np.nan
    if both < _LEAST_BEAMS:
        return 0, mean
    return (2 * longer > both) - (2 * shorter > both), mean


@borrowing_kernel
def _follow_ground(memory: NDArray[np.float64], step: int, mean: float) -> None:
    """Follow the distance of the ground; begin a doubt at a step, and end it if it is back."""
    if np.isnan(mean):
        return
    before, memory[_BEFORE] = memory[_BEFORE], mean
    if np.isnan(before):
        memory[_USUAL] = mean
    elif memory[_CHANGE] == 0.0 and step != 0:
        memory[_CHANGE], memory[_RECENT] = mean - before, mean
    elif memory[_CHANGE] == 0.0:
        memory[_USUAL] += _USUAL_WEIGHT * (mean - memory[_USUAL])
    else:
        memory[_RECENT] += _RECENT_WEIGHT * (mean - memory[_RECENT])
        left = (memory[_RECENT] - memory[_USUAL]) / memory[_CHANGE]
        if step * memory[_CHANGE] < 0.0 or left < _RETURN:
            memory[_CHANGE] = 0.0


@borrowing_kernel
def _take_sweep(
    memory: NDArray[np.float64],
    last: NDArray[np.float32],
    beams: NDArray[np.int64],
    stamp: float,
    ranges: NDArray[np.float32],
) -> None:
    """Compare a sweep with the last one; a step counts if the next sweep confirms it."""
    step, mean = _compare(ranges, last, beams)
    if not 0.0 < stamp - memory[_STAMP] <= _LONGEST_GAP:
        step = 0
    pending, memory[_PENDING] = memory[_PENDING], step
    if step != 0 and pending != step:
        return  # The next one is compared with the sweep before the step, too.
    memory[_PENDING], memory[_STAMP] = 0.0, stamp
    for k in range(len(beams)):
        last[k] = ranges[beams[k]]
    _follow_ground(memory, step, mean)
    if memory[_CHANGE] == 0.0:
        memory[_SINCE] = stamp


@borrowing_kernel
def _examine(
    memory: NDArray[np.float64],
    last: NDArray[np.float32],
    beams: NDArray[np.int64],
    stamps: NDArray[np.float64],
    ranges: NDArray[np.float32],
) -> bool:
    """Examine sweeps, oldest first; return false if their numbers are impossible."""
    if has_impossible(ranges, 0.0):
        return False
    for k in range(len(stamps)):
        _take_sweep(memory, last, beams, stamps[k], ranges[k])
    return True


class RangePlausibility:
    """Examines the sweeps of a rotating laser.

    Attributes:
        is_doubted: True if the ground has moved away, or nearer, from one sweep to the next.
    """

    def __init__(self) -> None:
        """Begin without any sweep."""
        self.reset()

    def reset(self) -> None:
        """Forget all sweeps."""
        self.is_doubted = False
        self._elevations: NDArray[np.float32] | None = None
        self._beams = np.empty(0, dtype=np.int64)
        self._last = np.empty(0, dtype=np.float32)
        self._memory = np.zeros(_NUMBERS)
        self._memory[_STAMP], self._memory[_BEFORE] = -np.inf, np.nan

    def is_possible(self, sweeps: Sweeps) -> bool:
        """Take sweeps; return false if a laser cannot measure many of their numbers.

        Args:
            sweeps: Sweeps that arrived, oldest first.
        """
        if sweeps.elevations is not self._elevations:
            self._choose_beams(sweeps.elevations)
        ranges = np.ascontiguousarray(sweeps.ranges)
        possible = _examine(self._memory, self._last, self._beams, sweeps.stamps, ranges)
        self.is_doubted = bool(self._memory[_CHANGE])
        return bool(possible)

    def _choose_beams(self, elevations: NDArray[np.float32]) -> None:
        """Choose the beams that meet the ground; none of a laser whose beams change."""
        down = np.abs(elevations) > _DOWN
        beams = np.flatnonzero(down if elevations.ndim == 1 else False)
        if not np.array_equal(beams, self._beams):
            self._beams = beams
            self._last = np.full(len(self._beams), np.nan, dtype=np.float32)
        self._elevations = elevations

    def warning(self, now: float) -> str:
        """Return what is wrong with the ranges.

        Args:
            now: Time [s].
        """
        change, time = self._memory[_CHANGE], now - self._memory[_SINCE]
        word = "longer" if change > 0 else "shorter"
        return (
            f"laser: ranges to the ground became {word} all at once, by {abs(change):.2f} m, "
            f"for {time:.1f} s"
        )
