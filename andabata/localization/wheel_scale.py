"""Scale of the wheels by the satellite fixes: the way that each of them says, laid over the other.

The fixes of some seconds are fitted by the way of the wheels, turned and scaled. The scale is that
of an error of the encoders, or of wheels that spin, if the shapes agree: fixes that jump have
another shape, and prove nothing.
"""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.kernel import borrowing_kernel

_CLEAR_WAY = 3.0
"""Way by the fixes of wheels that stand for all of them, from which the wheels are wrong [m]."""

_TINY = 1e-9
"""Least spread that is divided by."""


class WheelScaleConfig(BaseModel):
    """Limits beyond which the fixes contradict the wheels.

    Attributes:
        fixes: Number of fixes that are compared.
        time: Time after which a fix is forgotten [s].
        ratio: Ratio of the two ways that is no slip any more.
        sigmas: Least difference of the ratio from 1 in its own standard deviations.
        least_noise: Least standard deviation of a fix [m].
        most_noise: Largest one with which fixes prove something [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    fixes: int = Field(default=16, ge=6)
    time: float = Field(default=25.0, gt=0)
    ratio: float = Field(default=1.5, gt=1)
    sigmas: float = Field(default=5.0, gt=0)
    least_noise: float = Field(default=0.3, gt=0)
    most_noise: float = Field(default=0.6, gt=0)


class WheelScale:
    """Compares the way by the wheels with the fixes.

    Attributes:
        is_wrong: True if the fixes contradict the wheels, twice in a row; false if they agree; None
            without proof.
    """

    def __init__(self, config: WheelScaleConfig) -> None:
        """Begin without any fix.

        Args:
            config: Limits.
        """
        self._config = config
        noises = config.least_noise, config.most_noise
        self._limits = config.ratio, config.sigmas, *noises
        self._rows = np.full((config.fixes, 5), -np.inf)
        self._verdict = _UNKNOWN
        self.is_wrong: bool | None = None

    def add(self, stamp: float, fix: NDArray[np.float64], way: NDArray[np.float64]) -> None:
        """Compare a fix with the way by the wheels.

        Args:
            stamp: Time of the fix [s].
            fix: Its place in the map [m], shape (2,).
            way: Sum of the robot's steps by the wheels until then, in the map's axes [m], shape
                (2,).
        """
        rows = self._rows
        rows[:-1] = rows[1:]
        rows[-1] = stamp, *fix, *way
        is_full = stamp - self.begin <= self._config.time
        before, self._verdict = self._verdict, _judge(rows, *self._limits) if is_full else _UNKNOWN
        # One fix beside the others is enough for the limits, now and then: the next one is not.
        is_first = self._verdict == _IS_WRONG and before != _IS_WRONG
        self.is_wrong = None if is_first else _VERDICTS[self._verdict]

    @property
    def begin(self) -> float:
        """Stamp of the first fix that is compared [s]; minus infinity before there are enough."""
        return float(self._rows[0, 0])


_VERDICTS = (None, False, True)
"""Verdicts by their number in the kernel."""

_UNKNOWN, _AGREES, _IS_WRONG = range(3)


@borrowing_kernel
def _judge(
    rows: NDArray[np.float64], most: float, sigmas: float, least_noise: float, most_noise: float
) -> int:
    """Return the number of the verdict by a fit of the fixes.

    Args:
        rows: Rows of stamp [s], x and y by a fix, x and y by the wheels [m], shape (n, 5).
        most: Ratio of the two ways that is no slip any more.
        sigmas: Least difference of the ratio from 1 in its own standard deviations.
        least_noise: Least standard deviation of a fix [m].
        most_noise: Largest one with which fixes prove something [m].
    """
    ratio, noise, spread = _fit(rows)
    if spread == 0.0:  # The wheels say that they stand.
        way, noise = _line(rows)
        return _IS_WRONG if noise <= most_noise and way > _CLEAR_WAY else _UNKNOWN
    sigma = max(noise, least_noise) / max(np.sqrt(spread), _TINY)
    if noise > most_noise or sigmas * sigma > 1:
        return _UNKNOWN
    if 1 / most < ratio < most:
        return _AGREES
    if abs(ratio - 1) < sigmas * sigma:
        return _UNKNOWN
    # A detour of the signals lasts some seconds: it is not in both halves.
    half = len(rows) // 2
    first, second, bound = _fit(rows[:half])[0], _fit(rows[half:])[0], np.sqrt(most)
    both = min(first, second) > bound if ratio > 1 else max(first, second) < 1 / bound
    return _IS_WRONG if both else _UNKNOWN


@borrowing_kernel
def _line(rows: NDArray[np.float64]) -> tuple[float, float]:
    """Return way and noise of fixes by a line that is driven at one speed.

    Args:
        rows: Rows as in ``_judge``.

    Returns:
        Way from the first fix to the last, and the standard deviation of what is left on each axis
        [m].
    """
    n = len(rows)
    time, x, y = 0.0, 0.0, 0.0
    for k in range(n):
        time, x, y = time + rows[k, 0] / n, x + rows[k, 1] / n, y + rows[k, 2] / n
    times, along_x, along_y, fixes = 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        t, fx, fy = rows[k, 0] - time, rows[k, 1] - x, rows[k, 2] - y
        times += t * t
        along_x, along_y = along_x + t * fx, along_y + t * fy
        fixes += fx * fx + fy * fy
    product = np.hypot(along_x, along_y)
    rest = max(fixes - product * product / max(times, _TINY), 0.0)
    speed = product / max(times, _TINY)
    return speed * (rows[n - 1, 0] - rows[0, 0]), np.sqrt(rest / (2 * n - 4))


@borrowing_kernel
def _fit(rows: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the scale that lays the ways over the fixes, turned as fits best.

    Args:
        rows: Rows as in ``_judge``.

    Returns:
        The scale, the standard deviation of what is left on each axis [m], and the sum of the
        squared distances of the ways from their middle [m2].
    """
    n = len(rows)
    fix_x, fix_y, way_x, way_y = 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        fix_x, fix_y = fix_x + rows[k, 1] / n, fix_y + rows[k, 2] / n
        way_x, way_y = way_x + rows[k, 3] / n, way_y + rows[k, 4] / n
    along, across, ways, fixes = 0.0, 0.0, 0.0, 0.0
    for k in range(n):
        fx, fy = rows[k, 1] - fix_x, rows[k, 2] - fix_y
        wx, wy = rows[k, 3] - way_x, rows[k, 4] - way_y
        along += wx * fx + wy * fy
        across += wx * fy - wy * fx
        ways += wx * wx + wy * wy
        fixes += fx * fx + fy * fy
    # The product of the ways, as complex numbers, with the fixes: its angle is the turn.
    product = np.hypot(along, across)
    rest = max(fixes - product * product / max(ways, _TINY), 0.0)
    return product / max(ways, _TINY), np.sqrt(rest / (2 * n - 4)), ways
