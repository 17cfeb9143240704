"""Memory of a planar laser's scans, which tells what moves from what only seems to.

Circles through the hits of a post that is half hidden slide about, although nothing moves. What
does move is hit where earlier beams went through, and beams go through where it was hit before:
whatever stands never is. Hits are compared, and not circles, since hits do not slide.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.planar.hit_layer import LaserPose
from terrain.kernel import kernel

X, Y, RADIUS, PROBES = 0, 1, 2, 3
"""Columns of a circle: centre and radius [m], and from ``PROBES`` on x and y of its probes, places
a little behind three of its hits [m]."""

COLUMNS = 9
"""Number of columns of a circle."""


class PassLaw(NamedTuple):
    """Numbers of what counts as a hit that a beam passed.

    Attributes:
        margin: Distance behind a hit that a beam and its two neighbours have to reach [m].
        gate: Largest distance of an older circle from where a track was by its velocity [m].
        max_range: Largest range of a hit that counts [m].
    """

    margin: float
    gate: float
    max_range: float


class ScanMemory:
    """Remembers the last scans and the circles in them.

    Attributes:
        law: Limits of what counts as a hit that a beam passed.
    """

    def __init__(
        self, bearings: NDArray[np.float64], scans: int, period: float, law: PassLaw
    ) -> None:
        """Begin without scans.

        Args:
            bearings: Bearing of each beam from the laser's heading, in their order and equally
                far apart [rad], shape (b,).
            scans: Number of scans that are remembered.
            period: Time between two scans [s].
            law: Limits of what counts as a hit that a beam passed.
        """
        self.law = law
        self._bearings, self._scans, self._period = bearings, scans, period
        self.reset()

    def reset(self) -> None:
        """Forget all scans."""
        self._ranges = np.zeros((self._scans, len(self._bearings)))
        self._eyes = np.zeros((self._scans, 3))
        self._circles = np.full((self._scans, _MOST, COLUMNS), np.nan)
        self._taken = 0

    def take(
        self, eye: LaserPose, ranges: NDArray[np.float64], circles: NDArray[np.float64]
    ) -> None:
        """Remember a scan.

        Args:
            eye: Pose of the laser.
            ranges: Range of each beam [m], shape (b,).
            circles: Circles in it, shape (k, ``COLUMNS``).
        """
        slot = self._taken % self._scans
        self._ranges[slot], self._eyes[slot] = ranges, eye
        self._circles[slot] = np.nan
        kept = circles[:_MOST]
        self._circles[slot, : len(kept)] = kept
        self._taken += 1

    def count_passes(
        self, places: NDArray[np.float64], velocities: NDArray[np.float64]
    ) -> NDArray[np.int64]:
        """Return in how many scans beams show that each track has moved, shape (k,).

        Args:
            places: Places after the last scan [m], shape (k, 2).
            velocities: Velocities [m/s], shape (k, 2).
        """
        slots = np.arange(min(self._taken, self._scans))
        return _passes(
            np.hstack((places, velocities)),
            np.asarray((self._taken - 1 - slots) % self._scans * self._period, dtype=np.float64),
            self._eyes,
            self._ranges,
            self._circles,
            self._bearings,
            self.law,
        )


_MOST = 64
"""Most circles of a scan that are remembered."""

_SAME = 1e-6
"""Distance within which a circle of the last scan is the place of a track [m]."""


@kernel
def _passes(
    tracks: NDArray[np.float64],
    ages: NDArray[np.float64],
    eyes: NDArray[np.float64],
    ranges: NDArray[np.float64],
    circles: NDArray[np.float64],
    bearings: NDArray[np.float64],
    law: PassLaw,
) -> NDArray[np.int64]:
    """Return in how many scans beams show that each track has moved, shape (k,).

    Args:
        tracks: x, y [m] and velocity [m/s] of each, shape (k, 4).
        ages: Time since each scan [s], 0 for the last one, shape (n,).
        eyes: x, y [m] and yaw [rad] of the laser in each scan, shape (m, 3), m at least n.
        ranges: Range of each beam [m], shape (m, b).
        circles: Circles in each scan, NaN for none, shape (m, c, ``COLUMNS``).
        bearings: Bearing of each beam [rad], shape (b,).
        law: Limits of what counts as a hit that a beam passed.
    """
    counts = np.zeros(len(tracks), dtype=np.int64)
    now = int(np.argmin(ages))
    for k in range(len(tracks)):
        x, y, vx, vy = tracks[k]
        here = _nearest(x, y, circles[now], _SAME)
        if here < 0:
            continue
        for scan in range(len(ages)):
            if scan == now:
                continue
            if _is_passed(circles[now, here], scan, eyes, ranges, bearings, law):
                counts[k] += 1
                continue
            then = _nearest(x - vx * ages[scan], y - vy * ages[scan], circles[scan], law.gate)
            if then >= 0:
                counts[k] += _is_passed(circles[scan, then], now, eyes, ranges, bearings, law)
    return counts


@kernel
def _nearest(x: float, y: float, circles: NDArray[np.float64], gate: float) -> int:
    """Return the circle nearest to a place within a distance, -1 for none.

    Args:
        x: Place [m].
        y: Place [m].
        circles: Circles of a scan, NaN after the last one, shape (c, ``COLUMNS``).
        gate: Distance [m].
    """
    nearest, which = gate, -1
    for c in range(len(circles)):
        if np.isnan(circles[c, X]):
            break
        away = math.hypot(circles[c, X] - x, circles[c, Y] - y)
        if away < nearest:
            nearest, which = away, c
    return which


@kernel
def _is_passed(
    circle: NDArray[np.float64],
    scan: int,
    eyes: NDArray[np.float64],
    ranges: NDArray[np.float64],
    bearings: NDArray[np.float64],
    law: PassLaw,
) -> bool:
    """Return True if beams of a scan passed one of the probes of a circle.

    Args:
        circle: Circle, shape (``COLUMNS``,).
        scan: Scan.
        eyes: x, y [m] and yaw [rad] of the laser in each scan, shape (m, 3).
        ranges: Range of each beam [m], shape (m, b).
        bearings: Bearing of each beam [rad], shape (b,).
        law: Limits of what counts as a hit that a beam passed.
    """
    step = (bearings[-1] - bearings[0]) / (len(bearings) - 1)
    for probe in range(PROBES, COLUMNS, 2):
        dx, dy = circle[probe] - eyes[scan, 0], circle[probe + 1] - eyes[scan, 1]
        reach = math.hypot(dx, dy) + law.margin
        turn = (math.atan2(dy, dx) - eyes[scan, 2] - bearings[0]) % (2.0 * math.pi)
        beam = round(turn / step)
        # A beam that grazes an edge or a wall is not alone in going on behind it.
        if 0 < beam < len(bearings) - 1 and reach < law.max_range + law.margin:
            passed = ranges[scan, beam - 1] > reach and ranges[scan, beam] > reach
            if passed and ranges[scan, beam + 1] > reach:
                return True
    return False
