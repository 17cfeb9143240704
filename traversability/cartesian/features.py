"""Squares: the ground around a robot judged every two decimetres, where a local map needs it.

A polar cell three metres away is half a metre wide and almost a metre deep: one trunk in it closes
a gap that the robot fits through. A cloud shows more than that. Each square of two by two tiles is
described by planes through the tiles around it, which is the paper's step from points to features
(Sanchez et al. 2023, section 3.3) on the scale of a wheel and of the body, and boosted trees judge
it. Not in the papers (assumption).
"""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.cartesian.elevation_grid import (
    ANY_AGE,
    HIGHEST,
    LOWEST,
    MAX_HEIGHT,
    MEAN,
    POINTS,
    ElevationGrid,
)
from traversability.cloud import PointCloud

EDGE_CELLS = 2
"""Tiles along a square's edge."""

MAX_RANGE = 10.0
"""Squares further away are not judged [m]. Between 5 and 10 m half of them show points: what stands
there does, and much of the ground between has none."""

MIN_RANGE = 0.7
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

GROUND_FEATURES = (
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


class GroundFeatures:
    """Describes the squares of clouds; its memory lives as long as it does.

    Attributes:
        cells: Squares of the last cloud, int64, shape (k, 2).
        values: In the order of ``GROUND_FEATURES``, float32, shape (k, f).
        due: Whether they were asked for, bool, shape (k,); the others lie beside one that was.
    """

    def __init__(self) -> None:
        """Begin without a cloud."""
        self._count = 0
        self._cells = np.zeros((0, 2), dtype=np.int64)
        self._values = np.zeros((0, len(GROUND_FEATURES)), dtype=np.float32)
        self._due = np.zeros(0, dtype=np.bool_)
        self._flat = np.zeros((2, 0, 0))

    def describe(
        self, tiles: ElevationGrid, here: NDArray[np.float64], span: tuple[float, float] = ANY_AGE
    ) -> None:
        """Describe the squares of a cloud around a place, and those beside them.

        Args:
            tiles: The cloud.
            here: The place [m], shape (2,).
            span: Squares that were last measured so long ago [s]: from the first age on, less than
                the second.
        """
        most = (2 * int(MAX_RANGE / (EDGE_CELLS * tiles.cell)) + 3) ** 2
        if len(self._cells) < most:
            self._cells = np.zeros((most, 2), dtype=np.int64)
            self._values = np.zeros((most, len(GROUND_FEATURES)), dtype=np.float32)
            self._due = np.zeros(most, dtype=np.bool_)
        if self._flat.shape[1] != len(tiles.table):
            self._flat = np.zeros((2, *tiles.table.shape[:2]))
        _flatten(tiles.table, tiles.centre, self._flat)
        self._count = _describe(
            (tiles.table, tiles.ages, self._flat),
            tiles.centre,
            tiles.cell,
            here,
            (np.float32(span[0]), np.float32(span[1])),
            (self._cells, self._values, self._due),
        )

    @property
    def cells(self) -> NDArray[np.int64]:
        """Squares of the last cloud."""
        return self._cells[: self._count]

    @property
    def values(self) -> NDArray[np.float32]:
        """Their features."""
        return self._values[: self._count]

    @property
    def due(self) -> NDArray[np.bool_]:
        """Which of them were asked for."""
        return self._due[: self._count]


def label_ground_cells(
    cloud: PointCloud,
    bad: NDArray[np.bool_],
    share: float,
    tiles: ElevationGrid,
    cells: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Return which squares of a cloud have a tile whose points below crowns are bad.

    Args:
        cloud: The points.
        bad: Which of them are, bool, shape (m,).
        share: Of a tile's points, from which it is.
        tiles: The same cloud.
        cells: Squares, int64, shape (n, 2).

    Returns:
        bool, shape (n,).
    """
    last = len(tiles.table) - 1
    tile = np.floor(cloud.points[:, :2] / tiles.cell).astype(np.int64)
    inside = (np.abs(tile - tiles.centre) < len(tiles.table) // 2 - 1).all(axis=1)
    i, j = (tile & last).T
    own = tiles.table[i, j]
    low = inside & (own[:, POINTS] > 0) & (cloud.points[:, 2] < own[:, LOWEST] + MAX_HEIGHT)
    place, size = i * (last + 1) + j, (last + 1) ** 2
    total = np.bincount(place[low], minlength=size)
    count = np.bincount(place[low & bad], minlength=size)
    red = ((count > 0) & (count >= share * total)).reshape(last + 1, last + 1)
    found = np.zeros(len(cells), dtype=np.bool_)
    for a in range(EDGE_CELLS):
        for b in range(EDGE_CELLS):
            u, v = (EDGE_CELLS * cells + np.array([a, b])).T & last
            found |= red[u, v]
    return found


@kernel
def _flatten(table, centre, flat):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write which tiles are flat, 1 or 0, and their mean heights, else 0.

    Tiles stand in the square's own order, so that windows are rows of memory.
    """
    n = len(table)
    for i in range(n):
        for j in range(n):
            tile = table[(centre[0] - n // 2 + i) & (n - 1), (centre[1] - n // 2 + j) & (n - 1)]
            is_flat = tile[POINTS] > 0 and tile[HIGHEST] - tile[LOWEST] <= _FLAT
            flat[0, i, j] = 1.0 if is_flat else 0.0
            flat[1, i, j] = tile[MEAN] if is_flat else 0.0


@kernel
def _describe(ground, centre, cell, here, span, found):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the squares that are due or beside such ones, and their features; return how many."""
    table, ages, flat = ground
    places, values, due = found
    n = len(table)
    edge = EDGE_CELLS * cell
    wide = _WINDOWS[-1]
    most = n // 2 - wide - EDGE_CELLS - 1
    first0, first1 = int(np.floor(here[0] / edge)), int(np.floor(here[1] / edge))
    half = int(MAX_RANGE / edge) + 1
    columns = np.empty((8, 2 * wide + EDGE_CELLS))
    own = np.empty((EDGE_CELLS, EDGE_CELLS, 2))
    # Rims of one square more, so that each has eight neighbours.
    asked = np.zeros((2 * half + 3, 2 * half + 3), dtype=np.bool_)
    beside = asked.copy()
    for a in range(2 * half + 1):
        for b in range(2 * half + 1):
            age = _age(ages, EDGE_CELLS * (first0 - half + a), EDGE_CELLS * (first1 - half + b))
            if span[0] <= age < span[1]:
                asked[a + 1, b + 1] = True
                beside[a : a + 3, b : b + 3] = True
    count = 0
    for i in range(first0 - half, first0 + half + 1):
        for j in range(first1 - half, first1 + half + 1):
            k, m = i - first0 + half + 1, j - first1 + half + 1
            if not beside[k, m]:
                continue
            far = np.hypot((i + 0.5) * edge - here[0], (j + 0.5) * edge - here[1])
            u, v = EDGE_CELLS * i - centre[0], EDGE_CELLS * j - centre[1]
            if far < MIN_RANGE or far > MAX_RANGE or count == len(places):
                continue
            if abs(u) > most or abs(v) > most:
                continue
            points, seen, spread = 0.0, 0, 0.0
            low, high = np.inf, -np.inf
            for a in range(EDGE_CELLS):
                for b in range(EDGE_CELLS):
                    tile = table[(EDGE_CELLS * i + a) & (n - 1), (EDGE_CELLS * j + b) & (n - 1)]
                    own[a, b, 0] = np.nan
                    if tile[POINTS] > 0:
                        points, seen = points + tile[POINTS], seen + 1
                        spread = max(spread, tile[HIGHEST] - tile[LOWEST])
                        low, high = min(low, tile[LOWEST]), max(high, tile[HIGHEST])
                        own[a, b, 0], own[a, b, 1] = tile[MEAN], tile[HIGHEST]
            if seen == 0:
                continue
            row = values[count]
            row[0], row[1], row[2], row[3], row[4] = points, seen, spread, high - low, far
            row[_SHARED:] = _UNKNOWN
            _fit(flat, u + n // 2, v + n // 2, cell, own, columns, row[_SHARED:])
            places[count, 0], places[count, 1] = i, j
            due[count] = asked[k, m]
            count += 1
    return count


@kernel
def _age(ages, u, v):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the age of a square's newest tile."""
    n, least = len(ages), np.float32(np.inf)
    for a in range(EDGE_CELLS):
        for b in range(EDGE_CELLS):
            least = min(least, ages[(u + a) & (n - 1), (v + b) & (n - 1)])
    return least


@kernel
def _fit(flat, u, v, cell, own, columns, found):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write what the planes through the flat tiles around a square tell, window by window.

    Sums are kept by column, so that the tiles of a row are worked at together, and from one window
    to the next, which holds it.
    """
    wide = _WINDOWS[-1]
    columns[:6] = 0.0
    done = 0
    for k in range(len(_WINDOWS)):
        beyond = _WINDOWS[k]
        for a in range(-beyond, beyond + EDGE_CELLS):
            if k > 0 and -done <= a < done + EDGE_CELLS:
                continue
            x = (a - (EDGE_CELLS - 1) / 2) * cell
            ones = flat[0, u + a, v - wide : v + wide + EDGE_CELLS]
            heights = flat[1, u + a, v - wide : v + wide + EDGE_CELLS]
            for c in range(2 * wide + EDGE_CELLS):
                one, z = ones[c], heights[c]
                columns[0, c] += one
                columns[1, c] += one * x
                columns[2, c] += one * x * x
                columns[3, c] += z
                columns[4, c] += x * z
                columns[5, c] += z * z
        done = beyond
        _judge(flat, (u, v, beyond, cell), own, columns, found[_OF_WINDOW * k :])


@kernel
def _judge(flat, at, own, columns, found):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write what the plane through the flat tiles of one window tells."""
    u, v, beyond, cell = at
    middle = (EDGE_CELLS - 1) / 2
    s = sx = sy = sz = sxx = syy = sxy = sxz = syz = szz = 0.0
    for b in range(-beyond, beyond + EDGE_CELLS):
        c, y = b + _WINDOWS[-1], (b - middle) * cell
        one, x, xx, z, xz, zz = columns[:6, c]
        s, sx, sy, sz = s + one, sx + x, sy + y * one, sz + z
        sxx, syy, sxy = sxx + xx, syy + y * y * one, sxy + y * x
        sxz, syz, szz = sxz + xz, syz + y * z, szz + zz
    found[0] = s / (2 * beyond + EDGE_CELLS) ** 2
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
    least, most, width = columns[6], columns[7], 2 * beyond + EDGE_CELLS
    least[:width], most[:width] = np.inf, -np.inf
    for a in range(-beyond, beyond + EDGE_CELLS):
        ones = flat[0, u + a, v - beyond : v - beyond + width]
        heights = flat[1, u + a, v - beyond : v - beyond + width]
        plane = mz + gx * ((a - middle) * cell - mx) - gy * ((beyond + middle) * cell + my)
        for c in range(width):
            off = heights[c] - plane - gy * cell * c
            below, above = (off, off) if ones[c] > 0 else (np.inf, -np.inf)
            least[c] = below if below < least[c] else least[c]
            most[c] = above if above > most[c] else most[c]
    lowest, highest = least[:width].min(), most[:width].max()
    drop, rise, peak = np.inf, -np.inf, -np.inf
    uphill = (abs(gx) + abs(gy)) * cell / 2  # A tile's own edge stands out of its middle so far.
    for a in range(EDGE_CELLS):
        for b in range(EDGE_CELLS):
            mean, top = own[a, b]
            if np.isnan(mean):
                continue
            off = mean - mz - gx * ((a - middle) * cell - mx) - gy * ((b - middle) * cell - my)
            drop, rise = min(drop, off), max(rise, off)
            peak = max(peak, off + top - mean - uphill)
    found[3], found[4], found[5], found[6] = highest - lowest, rise, drop, peak
