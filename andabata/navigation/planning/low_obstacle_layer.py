"""Low obstacles: what stands out of the ground by centimetres, told by the points of several clouds.

A rock that no wheel may touch can be ten points of a cloud, too few to make a cell of the scan red.
But neighbouring points are measured within a fraction of a second, so that noise alone moves them
against each other, and they lie there again in every cloud. Not in the papers (assumption).
"""

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.kernel import kernel
from traversability.cartesian.elevation_grid import ANY_AGE, MEAN, POINTS, ElevationGrid, Wrapping

_ASIDE = 3
"""A cell is compared with those so many cells away on either side."""

_ALONG = np.array([[_ASIDE, 0], [0, _ASIDE], [2, 2], [2, -2]])


class LowObstacleLayerConfig(BaseModel):
    """Numbers of the bumps.

    Attributes:
        cells: Cells along an edge of the square that is remembered around the robot.
        nearest: Points nearer to the robot tell nothing [m].
        reach: Points further away tell nothing [m].
        most: What stands out further is no bump, but a thing or a crown above the ground [m]: cells
            of the scan tell it.
        enough: A cell has to have so many points.
        memory: What a cell has seen weighs no more than so many points.
        rise: A cell that stands out so far is a wall [m]: rocks of 6 cm make a mean of 2.
        roughness: A bump stands out so many times further than what is around it does.
        doubt: Ground whose squares have lower log odds is free, whatever stands out of it.
        keep: A bump that a new cloud does not show keeps such a share of its height: what was
            measured while dead reckoning drifted is smeared over its neighbours.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    cells: Wrapping = Field(default=256, ge=32, le=1024)
    nearest: float = Field(default=0.6, ge=0)
    reach: float = Field(default=4.0, gt=0)
    most: float = Field(default=0.25, gt=0)
    enough: float = Field(default=6.0, gt=0)
    memory: float = Field(default=100.0, gt=0)
    rise: float = Field(default=0.018, gt=0)
    roughness: float = Field(default=5.0, ge=0)
    doubt: float = Field(default=2.0, ge=0)
    keep: float = Field(default=0.7, ge=0, lt=1)


class LowObstacleLayer:
    """Remembers how far the ground stands out, in a square that moves with the robot, in ``odom``.

    Attributes:
        rises: Height of each cell over the ground on either side of it [m], and 0 where that is no
            bump; wrapped around, float32, shape (n, n).
        centre: The robot's cell at the last cloud, counted from the origin of ``odom``, shape (2,).
    """

    def __init__(self, cell: float, config: LowObstacleLayerConfig) -> None:
        """Begin without any.

        Args:
            cell: Edge of a cell [m].
            config: Numbers.
        """
        self._cell = cell
        self._config = config
        n = config.cells
        self._cells = np.zeros((n, n, 3), dtype=np.float32)
        self._sums, self.rises = self._cells[:, :, :2], self._cells[:, :, 2]
        self.centre = np.zeros(2, dtype=np.int64)

    def reset(self) -> None:
        """Forget everything."""
        self._cells[:] = 0.0
        self.centre[:] = 0

    def take(
        self, tiles: ElevationGrid, here: NDArray[np.float64], span: tuple[float, float] = ANY_AGE
    ) -> None:
        """Take in a cloud.

        Args:
            tiles: The cloud in ``odom``, as many as the square has cells, and as large.
            here: Position of the robot there [m], shape (2,).
            span: Cells that were last measured so long ago [s]: from the first age on, less than
                the second.
        """
        config = self._config
        follow(self._cells, self.centre, here, self._cell)
        due = (tiles.ages >= np.float32(span[0])) & (tiles.ages < np.float32(span[1]))
        limits = (config.nearest, config.reach, config.most, config.memory)
        _add(tiles.table, due, self._sums, self.centre, here, self._cell, limits)
        limits = (config.enough, config.rise, config.roughness, config.keep)
        _judge(self._sums, due, limits, self.rises)


@kernel
def follow(square, centre, here, cell):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Move a square to the robot and forget what it leaves behind; indices wrap around."""
    n = len(square)
    for axis in range(2):
        now = int(np.floor(here[axis] / cell))
        shift = now - centre[axis]
        for k in range(min(abs(shift), n)):
            line = (now + n // 2 - 1 - k if shift > 0 else now - n // 2 + k) & (n - 1)
            if axis == 0:
                square[line, :] = 0.0
            else:
                square[:, line] = 0.0
        centre[axis] = now


@kernel
def _add(table, due, sums, centre, here, cell, limits):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Add how far cells stand out of those on either side: points, and the sum over them.

    The mean of two cells on either side is the ground's height between them, on slopes too; of the
    four pairs the one in the middle counts, so that the next rock does no harm.
    """
    n = len(table)
    nearest, reach, most, memory = limits
    half = min(int(reach / cell), n // 2 - _ASIDE - 1)
    levels = np.empty(len(_ALONG))
    for i in range(centre[0] - half, centre[0] + half + 1):
        for j in range(centre[1] - half, centre[1] + half + 1):
            own = table[i & (n - 1), j & (n - 1)]
            far = np.hypot((i + 0.5) * cell - here[0], (j + 0.5) * cell - here[1])
            if not due[i & (n - 1), j & (n - 1)] or far < nearest or far > reach:
                continue
            known = 0
            for k in range(len(_ALONG)):
                a = table[(i + _ALONG[k, 0]) & (n - 1), (j + _ALONG[k, 1]) & (n - 1)]
                b = table[(i - _ALONG[k, 0]) & (n - 1), (j - _ALONG[k, 1]) & (n - 1)]
                if a[POINTS] > 0 and b[POINTS] > 0:
                    levels[known] = (a[MEAN] + b[MEAN]) / 2
                    known += 1
            if known == 0:
                continue
            rise = own[MEAN] - np.median(levels[:known])
            if abs(rise) > most:
                continue
            seen = sums[i & (n - 1), j & (n - 1)]
            seen[0] += own[POINTS]
            seen[1] += own[POINTS] * rise
            if seen[0] > memory:
                seen[1] *= np.float32(memory) / seen[0]
                seen[0] = memory


@kernel
def _judge(sums, due, limits, rises):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write how far bumps stand out: further than ``least``, and than what is around them."""
    n, around = len(sums), 2 * _ASIDE
    enough, least, roughness, keep = limits
    for i in range(n):
        for j in range(n):
            if not due[i, j]:
                continue
            points, total = sums[i, j]
            kept = np.float32(keep) * rises[i, j]
            rises[i, j] = kept if points > 0 and kept > least / 2 else np.float32(0.0)
            if points < enough or total < least * points:
                continue
            rough, count = 0.0, 0
            for a in range(i - around, i + around + 1):
                for b in range(j - around, j + around + 1):
                    far = max(abs(a - i), abs(b - j))
                    other = sums[a & (n - 1), b & (n - 1)]
                    if far >= _ASIDE and other[0] >= enough:
                        rough, count = rough + abs(other[1] / other[0]), count + 1
            if total > roughness * points * rough / max(count, 1):
                rises[i, j] = max(rises[i, j], total / points)
