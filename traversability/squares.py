"""Squares: the ground around a robot judged every two decimetres, where a local map needs it.

A polar cell three metres away is half a metre wide and almost a metre deep: one trunk in it closes
a gap that the robot fits through. A cloud shows more than that. Each square of two by two tiles is
described by planes through the tiles around it, which is the paper's step from points to features
(Sanchez et al. 2023, section 3.3) on the scale of a wheel and of the body, and boosted trees judge
it. Not in the papers (assumption).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from traversability.cloud import PointCloud
from traversability.labels import MIN_SHARE
from traversability.tiles import HIGHEST, LOWEST, MEAN, POINTS, TALL, Tiles

SQUARE = 2
"""Tiles along a square's edge."""

REACH = 5.0
"""Squares further away are not judged [m]: a cloud of a rotating laser has holes there."""

NEAREST = 0.7
"""Nor are those nearer [m], where the laser sees the robot's own shadow."""

_WINDOWS = (2, 4, 8)
"""The windows around a square reach so many tiles beyond it."""

_FLAT = 0.1
"""Tiles whose points differ by more stand out of the ground and are kept out of the planes [m]."""

_FEW = 5
"""Tiles that make a plane."""

_SHARED = 5
"""Features that do not belong to a window."""

_OF_WINDOW = 7
"""Features of each window."""

_UNKNOWN = -1.0
"""Value of what cannot be told."""

SQUARE_FEATURES = (
    "points",
    "tiles",
    "spread",
    "height",
    "range",
    *(
        f"{name}_{window}"
        for window in ("near", "around", "wide")
        for name in ("filled", "slope", "roughness", "step", "rise", "drop", "peak")
    ),
)
"""What is known of a square, in order: its points and tiles, the largest difference of height [m]
within one of its tiles and within it, its distance from the robot [m], and of the planes through
the flat tiles around it the share of tiles that are seen, the slope, the mean and the range of what
lies beside the plane [m], how far the highest and the lowest of its own tiles do, and the highest
point in them [m]."""


class SquareFeatures:
    """Describes the squares of clouds; its memory lives as long as it does.

    Attributes:
        places: Squares of the last cloud, int64, shape (k, 2).
        values: In the order of ``SQUARE_FEATURES``, float32, shape (k, f).
    """

    def __init__(self) -> None:
        """Begin without a cloud."""
        self._count = 0
        self._places = np.zeros((0, 2), dtype=np.int64)
        self._values = np.zeros((0, len(SQUARE_FEATURES)), dtype=np.float32)

    def describe(self, tiles: Tiles, here: NDArray[np.float64]) -> None:
        """Describe the squares of a cloud around a place [m]."""
        most = (2 * int(REACH / (SQUARE * tiles.cell)) + 3) ** 2
        if len(self._places) < most:
            self._places = np.zeros((most, 2), dtype=np.int64)
            self._values = np.zeros((most, len(SQUARE_FEATURES)), dtype=np.float32)
        self._count = _describe(
            tiles.table, tiles.centre, tiles.cell, here, self._places, self._values
        )

    @property
    def places(self) -> NDArray[np.int64]:
        """Squares of the last cloud."""
        return self._places[: self._count]

    @property
    def values(self) -> NDArray[np.float32]:
        """Their features."""
        return self._values[: self._count]


def label_squares(
    cloud: PointCloud, forbidden: NDArray[np.bool_], tiles: Tiles, places: NDArray[np.int64]
) -> NDArray[np.bool_]:
    """Return which squares of a cloud are forbidden, bool, shape (n,).

    A square is, when one of its tiles has the paper's share of forbidden points below crowns.

    Args:
        cloud: The points.
        forbidden: Which of them are, shape (m,).
        tiles: The same cloud.
        places: Squares, int64, shape (n, 2).
    """
    last = len(tiles.table) - 1
    tile = np.floor(cloud.points[:, :2] / tiles.cell).astype(np.int64)
    inside = (np.abs(tile - tiles.centre) < len(tiles.table) // 2 - 1).all(axis=1)
    i, j = (tile & last).T
    own = tiles.table[i, j]
    low = inside & (own[:, POINTS] > 0) & (cloud.points[:, 2] < own[:, LOWEST] + TALL)
    place, size = i * (last + 1) + j, (last + 1) ** 2
    total = np.bincount(place[low], minlength=size)
    bad = np.bincount(place[low & forbidden], minlength=size)
    red = ((bad > 0) & (bad >= MIN_SHARE * total)).reshape(last + 1, last + 1)
    found = np.zeros(len(places), dtype=np.bool_)
    for a in range(SQUARE):
        for b in range(SQUARE):
            u, v = (SQUARE * places + np.array([a, b])).T & last
            found |= red[u, v]
    return found


@njit(cache=True, nogil=True, error_model="numpy")
def _describe(table, centre, cell, here, places, values):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the squares that have points, and their features; return how many."""
    n = len(table)
    edge = SQUARE * cell
    most = n // 2 - _WINDOWS[-1] - SQUARE - 1
    first0, first1 = int(np.floor(here[0] / edge)), int(np.floor(here[1] / edge))
    half = int(REACH / edge) + 1
    count = 0
    for i in range(first0 - half, first0 + half + 1):
        for j in range(first1 - half, first1 + half + 1):
            far = np.hypot((i + 0.5) * edge - here[0], (j + 0.5) * edge - here[1])
            u, v = SQUARE * i, SQUARE * j
            if far < NEAREST or far > REACH or count == len(places):
                continue
            if abs(u - centre[0]) > most or abs(v - centre[1]) > most:
                continue
            points, seen, spread = 0.0, 0, 0.0
            low, high = np.inf, -np.inf
            for p in range(u, u + SQUARE):
                for q in range(v, v + SQUARE):
                    tile = table[p & (n - 1), q & (n - 1)]
                    if tile[POINTS] > 0:
                        points, seen = points + tile[POINTS], seen + 1
                        spread = max(spread, tile[HIGHEST] - tile[LOWEST])
                        low, high = min(low, tile[LOWEST]), max(high, tile[HIGHEST])
            if seen == 0:
                continue
            row = values[count]
            row[0], row[1], row[2], row[3], row[4] = points, seen, spread, high - low, far
            for k in range(len(_WINDOWS)):
                own = row[_SHARED + _OF_WINDOW * k : _SHARED + _OF_WINDOW * (k + 1)]
                _fit(table, u, v, _WINDOWS[k], cell, own)
            places[count, 0], places[count, 1] = i, j
            count += 1
    return count


@njit(cache=True, nogil=True, error_model="numpy")
def _fit(table, u, v, beyond, cell, found):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write what the plane through the flat tiles around a square tells."""
    n = len(table)
    middle = (SQUARE - 1) / 2
    level = np.inf
    s = sx = sy = sz = sxx = syy = sxy = sxz = syz = szz = 0.0
    for a in range(-beyond, beyond + SQUARE):
        for b in range(-beyond, beyond + SQUARE):
            tile = table[(u + a) & (n - 1), (v + b) & (n - 1)]
            if tile[POINTS] == 0 or tile[HIGHEST] - tile[LOWEST] > _FLAT:
                continue
            if level == np.inf:
                level = tile[MEAN]
            x, y, z = (a - middle) * cell, (b - middle) * cell, float(tile[MEAN] - level)
            s, sx, sy, sz = s + 1, sx + x, sy + y, sz + z
            sxx, syy, sxy = sxx + x * x, syy + y * y, sxy + x * y
            sxz, syz, szz = sxz + x * z, syz + y * z, szz + z * z
    found[:] = _UNKNOWN
    found[0] = s / (2 * beyond + SQUARE) ** 2
    if s < _FEW:
        return
    mx, my, mz = sx / s, sy / s, sz / s
    cxx, cyy, cxy = sxx / s - mx * mx, syy / s - my * my, sxy / s - mx * my
    cxz, cyz, czz = sxz / s - mx * mz, syz / s - my * mz, szz / s - mz * mz
    spanned = cxx * cyy - cxy * cxy
    if spanned < 0.1 * cell**4:  # The tiles lie in a row.
        return
    gx, gy = (cxz * cyy - cyz * cxy) / spanned, (cyz * cxx - cxz * cxy) / spanned
    found[1] = np.hypot(gx, gy)
    found[2] = np.sqrt(max(czz - gx * cxz - gy * cyz, 0.0))
    lowest, drop = np.inf, np.inf
    highest = rise = peak = -np.inf
    uphill = (abs(gx) + abs(gy)) * cell / 2  # A tile's own edge stands out of its middle so far.
    for a in range(-beyond, beyond + SQUARE):
        for b in range(-beyond, beyond + SQUARE):
            tile = table[(u + a) & (n - 1), (v + b) & (n - 1)]
            if tile[POINTS] == 0:
                continue
            x, y = (a - middle) * cell, (b - middle) * cell
            off = tile[MEAN] - level - mz - gx * (x - mx) - gy * (y - my)
            if 0 <= a < SQUARE and 0 <= b < SQUARE:
                drop, rise = min(drop, off), max(rise, off)
                peak = max(peak, off + tile[HIGHEST] - tile[MEAN] - uphill)
            if tile[HIGHEST] - tile[LOWEST] <= _FLAT:
                lowest, highest = min(lowest, off), max(highest, off)
    found[3], found[4], found[5], found[6] = highest - lowest, rise, drop, peak
