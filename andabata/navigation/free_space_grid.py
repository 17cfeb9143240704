"""Free space grid: where beams passed at body height around the robot, and what stands there.

A return from a place that beams passed through before comes from something that was not there:
something that moves (Dynablox, Schmid et al. 2023, does so with voxels). Heights are over the
ground of the same grid, so that slopes do no harm, and what is lower than a body, such as grass,
does not count. All returns of one place are compared with what was known before they came.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.kernel import borrowing_kernel, kernel
from traversability.cartesian.rolling_grid import PowerOfTwo, RollingGrid

_GROUND, _IS_KNOWN, _PASSED, _LOOKS, _STOOD, _BESIDE, _HIT, _CAME, _LEFT = range(9)
"""Layers of a cell: height of the ground [m], 1 where it is known, stamp of the last beam that
passed, number of looks that passed since anything stood there, stamps of the last return of what
stands, of the last one in the cell or beside it, of the last return of all, of the first of what is
there now and came, and of the beam that passed after it had left; stamps are 0 for never."""

_LAYERS = ("ground", "is_known", "passed", "looks", "stood", "beside", "hit", "came", "left")

X, Y, HEIGHT, STAMP, KIND = range(5)
"""Columns of a return at body height: place [m], height over the ground [m], stamp [s], kind."""

UNKNOWN, STANDS, CAME = range(3)
"""Kinds of a return: nothing was known of its cell, something stood there, or it was free."""

_EARLIEST = 1.0
"""Stamp of the first returns in the grid [s]: 0 means never."""

_SETTLING = 0.05
"""Share of a higher low return by which the height of the ground rises."""

_LOW = 0.3
"""Height over the ground up to which returns may raise it [m]."""

_BESIDE_ROBOT = 2.0
"""Distance from the robot up to which ground that was never seen is as high as the robot stands: a
laser sees none below its lowest beam [m]."""


class FreeSpaceConfig(BaseModel):
    """Settings of the free space grid, all of them assumptions.

    Attributes:
        cell: Edge of a cell [m].
        cells: Number of cells along an edge of the square around the robot.
        max_range: Horizontal range beyond which nothing counts [m].
        min_range: Horizontal range below which nothing counts: the robot's body [m].
        heights: Heights over the ground between which beams count: those of a body [m].
        margin: Distance before a return up to which its beam has surely passed [m].
        passing_stride: Number of beams of which one counts as passing: there are many in a cell.
        min_looks: Number of looks, with stamps of their own, that have to pass through a cell
            before it is free. The beams of one plane are one look: it may miss what is thin.
        memory: Time for which a cell stays free without another beam [s].
        standing_memory: Time for which a cell where something stood, or beside it, does not become
            free, however many beams pass: leaves stop some and let others through, and what stands
            is seen beside its cell when the pose drifts [s].
        parking_time: Time from which on what came and stays stands [s].
        left_time: Time for which a place counts as left: longer than clouds keep what was there
            [s].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    cell: float = Field(default=0.2, gt=0)
    cells: PowerOfTwo = Field(default=128, ge=16, le=512)
    max_range: float = Field(default=7.0, gt=0)
    min_range: float = Field(default=0.5, ge=0)
    heights: tuple[float, float] = (0.3, 1.6)
    margin: float = Field(default=0.3, ge=0)
    passing_stride: int = Field(default=2, ge=1)
    min_looks: int = Field(default=2, ge=1)
    memory: float = Field(default=10.0, gt=0)
    standing_memory: float = Field(default=5.0, ge=0)
    parking_time: float = Field(default=6.0, gt=0)
    left_time: float = Field(default=7.0, ge=0)


class Rays(NamedTuple):
    """Beams of one moment in ``odom``.

    Attributes:
        origin: Place of the laser [m], shape (3,).
        ends: Ends of the beams: returns, or places that a beam passed without one [m], float32,
            shape (n, 3).
        stamps: Times [s], shape (n,), the same for beams that are one look: those of a plane, or of
            a cloud.
        is_return: True where a beam was returned, shape (n,).
    """

    origin: NDArray[np.float64]
    ends: NDArray[np.float32]
    stamps: NDArray[np.float64]
    is_return: NDArray[np.bool_]


class _Law(NamedTuple):
    """Numbers of ``FreeSpaceConfig`` for compiled code."""

    cell: float
    max_range: float
    min_range: float
    low: float
    high: float
    margin: float
    stride: int
    min_looks: float
    memory: float
    standing_memory: float
    parking_time: float


class FreeSpaceGrid:
    """Remembers where beams passed, and tells returns of what came from returns of what stands.

    Attributes:
        config: Settings.
    """

    def __init__(self, config: FreeSpaceConfig | None = None) -> None:
        """Begin empty.

        Args:
            config: Settings.
        """
        self.config = config = config or FreeSpaceConfig()
        self._grid = RollingGrid(config.cell, config.cells, _LAYERS)
        largest = (config.cells / 2 - 2) * config.cell
        self._law = _Law(
            config.cell,
            min(config.max_range, largest),
            config.min_range,
            *config.heights,
            config.margin,
            config.passing_stride,
            config.min_looks,
            config.memory,
            config.standing_memory,
            config.parking_time,
        )
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._grid.reset()
        self._begin: float | None = None
        self._newest = 0.0

    def update(self, rays: Rays, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Take in beams, and return their returns at body height, shape (k, 5).

        Args:
            rays: Beams.
            position: Position of the robot's base in ``odom`` [m], shape (3,).
        """
        if not len(rays.stamps):
            return np.empty((0, 5))
        if self._begin is None:
            self._begin = float(rays.stamps.min()) - _EARLIEST
        self._newest = float(rays.stamps.max()) - self._begin
        self._grid.follow(position[:2])
        base = float(position[2])
        return _observe(self._grid.values, self._grid.centre, *rays, base, self._begin, self._law)

    def left_places(self) -> NDArray[np.float64]:
        """Return the middles of the cells that something came to and has left [m], shape (k, 2)."""
        earliest = self._newest - self.config.left_time
        cells = _left(self._grid.values, self._grid.centre, earliest)
        return np.asarray((cells + 0.5) * self.config.cell, dtype=np.float64)

    def cells_that_came(self, trails: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the middles of the cells along trails where something came that was not there [m].

        What stood there before is never among them.

        Args:
            trails: Ends of each trail and the distance from it that counts: x, y, x, y, distance
                [m], shape (k, 5).

        Returns:
            Places, shape (c, 2).
        """
        config = self.config
        earliest = self._newest - config.parking_time
        values, centre = self._grid.values, self._grid.centre
        cells = _came_along(values, centre, trails / config.cell, earliest)
        return np.asarray((cells + 0.5) * config.cell, dtype=np.float64)


@kernel
def _came_along(
    values: NDArray[np.float32],
    centre: NDArray[np.int64],
    trails: NDArray[np.float64],
    earliest: float,
) -> NDArray[np.int64]:
    """Return the cells along trails that something came to after a stamp, shape (c, 2)."""
    n, count = len(values), 0
    cells = np.empty((n * n, 2), dtype=np.int64)
    if not len(trails):
        return cells[:0].copy()
    for i in range(centre[0] - n // 2, centre[0] + n // 2):
        for j in range(centre[1] - n // 2, centre[1] + n // 2):
            came = values[i & (n - 1), j & (n - 1), _CAME]
            if came > 0.0 and came > earliest and _is_along(i + 0.5, j + 0.5, trails):
                cells[count, 0], cells[count, 1] = i, j
                count += 1
    return cells[:count].copy()


@borrowing_kernel
def _is_along(x: float, y: float, trails: NDArray[np.float64]) -> bool:
    """Return True for a place on one of the trails."""
    for k in range(len(trails)):
        dx, dy = trails[k, 2] - trails[k, 0], trails[k, 3] - trails[k, 1]
        square = dx * dx + dy * dy
        along = ((x - trails[k, 0]) * dx + (y - trails[k, 1]) * dy) / square if square > 0 else 0.0
        along = min(max(along, 0.0), 1.0)
        away = np.hypot(trails[k, 0] + along * dx - x, trails[k, 1] + along * dy - y)
        if away <= trails[k, 4]:
            return True
    return False


@kernel
def _left(
    values: NDArray[np.float32], centre: NDArray[np.int64], earliest: float
) -> NDArray[np.int64]:
    """Return the cells that were left after a stamp, shape (k, 2)."""
    n, count = len(values), 0
    cells = np.empty((n * n, 2), dtype=np.int64)
    for i in range(centre[0] - n // 2, centre[0] + n // 2):
        for j in range(centre[1] - n // 2, centre[1] + n // 2):
            left = values[i & (n - 1), j & (n - 1), _LEFT]
            if left > 0.0 and left >= earliest:
                cells[count, 0], cells[count, 1] = i, j
                count += 1
    return cells[:count].copy()


@kernel
def _observe(
    values: NDArray[np.float32],
    centre: NDArray[np.int64],
    origin: NDArray[np.float64],
    ends: NDArray[np.float32],
    stamps: NDArray[np.float64],
    is_return: NDArray[np.bool_],
    base: float,
    begin: float,
    law: _Law,
) -> NDArray[np.float64]:
    """Take in beams, and return the returns at body height, shape (k, 5).

    Args:
        values: Layers of the grid, changed in place, shape (n, n, 9).
        centre: Cell of the robot, shape (2,).
        origin: Place of the laser [m], shape (3,).
        ends: Ends of the beams [m], shape (n, 3).
        stamps: Their times [s], shape (n,).
        is_return: True where a beam was returned, shape (n,).
        base: Height of the robot's base [m].
        begin: Time of the grid's stamp 0 [s].
        law: Numbers of the settings.
    """
    _level(values, origin, ends, is_return, base, law)
    returns = _returns(values, origin, ends, stamps, is_return, base, begin, law)
    _pass(values, origin, ends, stamps, is_return, base, begin, law)
    return returns


@kernel
def _level(
    values: NDArray[np.float32],
    origin: NDArray[np.float64],
    ends: NDArray[np.float32],
    is_return: NDArray[np.bool_],
    base: float,
    law: _Law,
) -> None:
    """Bring the heights of the ground to the lowest returns."""
    last = len(values) - 1
    for k in range(len(ends)):
        far = np.hypot(ends[k, 0] - origin[0], ends[k, 1] - origin[1])
        if not is_return[k] or far > law.max_range or far < law.min_range:
            continue
        i, j = int(np.floor(ends[k, 0] / law.cell)), int(np.floor(ends[k, 1] / law.cell))
        i, j, z = i & last, j & last, ends[k, 2]
        ground, is_known = values[i, j, _GROUND], values[i, j, _IS_KNOWN] > 0.0
        if not is_known and far < _BESIDE_ROBOT and z > base + law.low:
            continue
        if not is_known or z < ground:
            values[i, j, _GROUND], values[i, j, _IS_KNOWN] = z, 1.0
        elif z < ground + _LOW:
            # The estimate of the height drifts: what rises slowly is the ground.
            values[i, j, _GROUND] = ground + np.float32(_SETTLING) * (z - ground)


@borrowing_kernel
def _ground_at(values: NDArray[np.float32], row: int, column: int) -> float:
    """Return the lowest ground of a cell and those around it [m], infinite if none is known."""
    last, lowest = len(values) - 1, np.inf
    for a in range(row - 1, row + 2):
        for b in range(column - 1, column + 2):
            i, j = a & last, b & last
            if values[i, j, _IS_KNOWN] > 0.0 and values[i, j, _GROUND] < lowest:
                lowest = np.float64(values[i, j, _GROUND])
    return lowest


@kernel
def _returns(
    values: NDArray[np.float32],
    origin: NDArray[np.float64],
    ends: NDArray[np.float32],
    stamps: NDArray[np.float64],
    is_return: NDArray[np.bool_],
    base: float,
    begin: float,
    law: _Law,
) -> NDArray[np.float64]:
    """Return the returns at body height, shape (k, 5), and mark their cells."""
    last, found, count = len(values) - 1, np.empty((len(ends), 5)), 0
    for k in range(len(ends)):
        far = np.hypot(ends[k, 0] - origin[0], ends[k, 1] - origin[1])
        if not is_return[k] or far > law.max_range or far < law.min_range:
            continue
        i, j = int(np.floor(ends[k, 0] / law.cell)), int(np.floor(ends[k, 1] / law.cell))
        ground = _ground_at(values, i, j)
        if ground == np.inf and far < _BESIDE_ROBOT:
            ground = base
        height = ends[k, 2] - ground
        if not law.low <= height <= law.high:
            continue
        stamp = np.float32(stamps[k] - begin)
        found[count, X], found[count, Y], found[count, HEIGHT] = ends[k, 0], ends[k, 1], height
        found[count, STAMP] = stamps[k]
        found[count, KIND] = _kind(values, i & last, j & last, stamp, law)
        count += 1
    # All of them are compared with what was known before any of them came.
    for point in found[:count]:
        i, j = int(np.floor(point[X] / law.cell)), int(np.floor(point[Y] / law.cell))
        stamp = np.float32(point[STAMP] - begin)
        u, v = i & last, j & last
        if point[KIND] != CAME:
            _stand(values, i, j, stamp)
        elif values[u, v, _CAME] == 0.0:
            values[u, v, _CAME] = stamp
        values[u, v, _HIT], values[u, v, _LEFT] = stamp, 0.0
    return found[:count].copy()


@borrowing_kernel
def _kind(values: NDArray[np.float32], i: int, j: int, stamp: np.float32, law: _Law) -> int:
    """Return the kind of a return from a cell."""
    came, stood = values[i, j, _CAME], values[i, j, _STOOD]
    if came > 0.0:
        return CAME if stamp - came < law.parking_time else STANDS
    if stood > 0.0 and stamp - stood < law.standing_memory:
        return STANDS
    is_free = values[i, j, _LOOKS] >= law.min_looks
    return CAME if is_free and stamp - values[i, j, _PASSED] < law.memory else UNKNOWN


@borrowing_kernel
def _stand(values: NDArray[np.float32], i: int, j: int, stamp: np.float32) -> None:
    """Mark a cell where something stands, and those beside it."""
    last = len(values) - 1
    if values[i & last, j & last, _STOOD] != stamp:
        for a in range(i - 1, i + 2):
            for b in range(j - 1, j + 2):
                values[a & last, b & last, _BESIDE] = stamp
    i, j = i & last, j & last
    values[i, j, _STOOD], values[i, j, _LOOKS], values[i, j, _CAME] = stamp, 0.0, 0.0


@borrowing_kernel
def _pass(
    values: NDArray[np.float32],
    origin: NDArray[np.float64],
    ends: NDArray[np.float32],
    stamps: NDArray[np.float64],
    is_return: NDArray[np.bool_],
    base: float,
    begin: float,
    law: _Law,
) -> None:
    """Count the beams that passed through cells at body height, but not those with returns."""
    last, first = len(values) - 1, np.float32(np.inf)
    for k in range(len(stamps)):
        first = min(first, np.float32(stamps[k] - begin))
    for k in range(0, len(ends), law.stride):
        dx, dy = ends[k, 0] - origin[0], ends[k, 1] - origin[1]
        dz, far = ends[k, 2] - origin[2], np.hypot(dx, dy)
        stop = min(far - law.margin if is_return[k] else far, law.max_range)
        if stop <= law.min_range:
            continue
        dx, dy, dz = dx / far, dy / far, dz / far
        # From cell to cell; corners may be left out, other beams do not.
        stamp, ground, is_known = np.float32(stamps[k] - begin), np.float32(base), False
        steps = int((stop - law.min_range) / law.cell) + 1
        x, y = origin[0] + law.min_range * dx, origin[1] + law.min_range * dy
        z = origin[2] + law.min_range * dz
        for step in range(steps):
            i, j = int(np.floor(x / law.cell)) & last, int(np.floor(y / law.cell)) & last
            x, y, height = x + law.cell * dx, y + law.cell * dy, z
            z += law.cell * dz
            if values[i, j, _IS_KNOWN] > 0.0:
                ground, is_known = values[i, j, _GROUND], True
            elif not is_known and law.min_range + step * law.cell > _BESIDE_ROBOT:
                continue
            height -= ground
            if height > law.high and dz > 0.0:
                break
            if not law.low <= height <= law.high or values[i, j, _HIT] >= first:
                continue
            # Beams of one plane count once: it may miss what is thin.
            looks = values[i, j, _LOOKS]
            if values[i, j, _PASSED] != stamp:
                since = stamp - values[i, j, _BESIDE]
                is_beside = values[i, j, _BESIDE] > 0.0 and since < law.standing_memory
                if looks >= law.min_looks or not is_beside:
                    values[i, j, _LOOKS] = looks + 1.0
                if values[i, j, _CAME] > 0.0:
                    values[i, j, _LEFT], values[i, j, _CAME] = stamp, 0.0
                values[i, j, _PASSED] = stamp
