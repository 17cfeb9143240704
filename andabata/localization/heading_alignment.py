"""Heading of a robot that has none: the way that fixes show, beside that of dead reckoning."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import wrap

_LEAST_RATIO = 5.0
"""Least ratio of a way to the white noise of its ends: the heading is then known to 0.2 rad."""

_WAY_TOLERANCE = 0.3
"""Largest relative difference of the two lengths: beyond, wheels spin or a fix is wrong."""


class Alignment(NamedTuple):
    """Rotation from ``odom`` to the map.

    Attributes:
        angle: Angle [rad].
        sigma: Its standard deviation [rad].
    """

    angle: float
    sigma: float


class HeadingAlignment:
    """Search for two fixes that are far enough from each other to tell the heading between them."""

    def __init__(self) -> None:
        """Begin without any fix."""
        self._first: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None

    def clear(self) -> None:
        """Forget the first fix: the heading is known."""
        self._first = None

    def add(
        self, fix: NDArray[np.float64], odometry: NDArray[np.float64], white: float
    ) -> Alignment | None:
        """Compare a fix with the first one; return the rotation once it is known.

        Args:
            fix: Fix in the map [m], shape (2,).
            odometry: Place by dead reckoning at its time, in ``odom`` [m], shape (2,).
            white: White noise of each axis of a fix [m].
        """
        if self._first is None:
            self._first = (fix.copy(), odometry.copy())
            return None
        way, driven = fix - self._first[0], odometry - self._first[1]
        length, reference = math.hypot(*way), math.hypot(*driven)
        noise = math.sqrt(2) * white
        if reference < _LEAST_RATIO * noise:
            return None
        if abs(length - reference) > _WAY_TOLERANCE * reference:
            self._first = (fix.copy(), odometry.copy())
            return None
        self._first = None
        angle = math.atan2(way[1], way[0]) - math.atan2(driven[1], driven[0])
        return Alignment(wrap(angle), noise / reference)
