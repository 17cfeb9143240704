"""Hills: where ground that nobody has seen from near looks too steep from afar.

Squares and cells of the scan end at 10 m; a slope that no robot climbs goes on for tens of metres,
and whoever sees its near end alone goes round it on the wrong side. The laser sees further: few
points of each metre of level ground, many of a slope that faces it. Not in the papers (assumption).
"""

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.navigation.bumps import follow
from traversability.tiles import Wrapping

_FEW = 4
"""Neighbours, itself among them, that make a plane."""

_SPANNED = 0.05
"""Neighbours in a row make none: the determinant of their spread is less [cells^4]."""

Hillside = tuple[NDArray[np.bool_], int]
"""Which patches of ground look too steep, wrapped around, and cells of a map along a patch."""

LEVEL: Hillside = (np.zeros((1, 1), dtype=np.bool_), 1)
"""No hill anywhere: it repeats, as all that is wrapped."""


class HillsConfig(BaseModel):
    """Numbers of the hills.

    Attributes:
        patches: Patches of ground along an edge of the square that is remembered.
        patch: Cells of the map along a patch's edge.
        nearest: Points nearer to the robot tell nothing [m]: squares do.
        slope: Steeper ground is too steep [rad] (as for the true map).
        jut: What stands so much above a patch beside, for each metre between their middles, is no
            ground but something on it [m].
        creep: A patch that is seen again may lie so much higher than before [m]: dead reckoning
            drifts.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    patches: Wrapping = Field(default=64, ge=16, le=256)
    patch: int = Field(default=5, ge=1)
    nearest: float = Field(default=5.0, ge=0)
    slope: float = Field(default=math.radians(20.0), gt=0, lt=math.pi / 2)
    jut: float = Field(default=1.2, gt=0)
    creep: float = Field(default=0.05, ge=0)


class Hills:
    """Remembers the lowest points around the robot, in ``odom``, and judges how steep they lie.

    Attributes:
        steep: Which patches are too steep; wrapped around, bool, shape (n, n).
        centre: The robot's patch, counted from the origin of ``odom``, shape (2,).
    """

    def __init__(self, cell: float, config: HillsConfig) -> None:
        """Begin without any.

        Args:
            cell: Edge of the map's cells [m].
            config: Numbers.
        """
        self._config = config
        self._edge = config.patch * cell
        n = config.patches
        self._floors = np.zeros((n, n, 2), dtype=np.float32)
        self._now = np.zeros((n, n), dtype=np.float32)
        self._lows = np.zeros((2, n, n), dtype=np.float32)
        self.steep = np.zeros((n, n), dtype=np.bool_)
        self.centre = np.zeros(2, dtype=np.int64)

    def reset(self) -> None:
        """Forget everything."""
        self._floors[:] = 0.0
        self.steep[:] = False
        self.centre[:] = 0

    @property
    def side(self) -> Hillside:
        """What a plan looks up."""
        return self.steep, self._config.patch

    def take(self, points: NDArray[np.float32], here: NDArray[np.float64]) -> None:
        """Take in what was measured.

        Args:
            points: In ``odom`` [m], shape (n, 3).
            here: Position of the robot there [m], shape (2,).
        """
        config, edge = self._config, self._edge
        follow(self._floors, self.centre, here, edge)
        _lower(points, here, edge, config.nearest, self.centre, self._now)
        _remember(self._now, config.creep, self._floors)
        limits = (config.jut * edge, math.tan(config.slope) * edge)
        _judge(self._floors, self.centre, limits, self._lows, self.steep)


@njit(cache=True, nogil=True, error_model="numpy")
def _lower(points, here, edge, nearest, centre, now):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the lowest point of each patch, infinity where there is none."""
    n = len(now)
    now[:] = np.inf
    for k in range(len(points)):
        x, y, z = points[k, 0], points[k, 1], points[k, 2]
        if not (np.hypot(x - here[0], y - here[1]) > nearest and abs(z) < np.inf):
            continue  # Nor does what is no number.
        i, j = int(np.floor(x / edge)), int(np.floor(y / edge))
        if max(abs(i - centre[0]), abs(j - centre[1])) < n // 2:
            now[i & (n - 1), j & (n - 1)] = min(now[i & (n - 1), j & (n - 1)], z)


@njit(cache=True, nogil=True, error_model="numpy")
def _remember(now, creep, floors):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Lower the floors, height and whether it is known, to what was seen now."""
    n = len(now)
    for i in range(n):
        for j in range(n):
            if now[i, j] < np.inf:
                z = now[i, j]
                if floors[i, j, 1] > 0:
                    z = min(z, floors[i, j, 0] + np.float32(creep))
                floors[i, j, 0], floors[i, j, 1] = z, 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _judge(floors, centre, limits, lows, steep):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write where a plane through the floors of a patch and those beside it is too steep.

    Floors are laid out in the square's own order, so that neighbours lie beside each other.
    """
    n, last = len(steep), len(steep) - 1
    jut, rise = limits
    floor, ground = lows
    low0, low1 = centre[0] - n // 2, centre[1] - n // 2
    for i in range(n):
        for j in range(n):
            there = floors[(low0 + i) & last, (low1 + j) & last]
            floor[i, j] = there[0] if there[1] > 0 else np.inf
    ground[:] = np.inf
    for i in range(1, n - 1):
        for j in range(1, n - 1):
            own = floor[i, j]
            if own < np.inf and own <= floor[i - 1 : i + 2, j - 1 : j + 2].min() + jut:
                ground[i, j] = own
    steep[:] = False
    for i in range(2, n - 2):
        for j in range(2, n - 2):
            own = ground[i, j]
            if not own < np.inf:
                continue
            s = sa = sb = sz = saa = sab = sbb = saz = sbz = 0.0
            for a in range(-1, 2):
                for b in range(-1, 2):
                    z = ground[i + a, j + b] - own
                    if z < np.inf:
                        s, sa, sb, sz = s + 1.0, sa + a, sb + b, sz + z
                        saa, sab, sbb = saa + a * a, sab + a * b, sbb + b * b
                        saz, sbz = saz + a * z, sbz + b * z
            ma, mb, mz = sa / s, sb / s, sz / s
            aa, ab, bb = saa / s - ma * ma, sab / s - ma * mb, sbb / s - mb * mb
            spanned = aa * bb - ab * ab
            if s < _FEW or spanned < _SPANNED:
                continue
            az, bz = saz / s - ma * mz, sbz / s - mb * mz
            along, across = (az * bb - bz * ab) / spanned, (bz * aa - az * ab) / spanned
            steep[(low0 + i) & last, (low1 + j) & last] = np.hypot(along, across) > rise
