"""Mover detector: compact clusters of returns from places that were free a moment ago.

Vegetation is the trap: leaves stop some beams and let others through. A cluster counts if it has
several returns, the size of a body, and more returns of what came than of what stands about it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.navigation.free_space_grid import CAME, HEIGHT, KIND, STAMP, STANDS, X, Y
from terrain.kernel import borrowing_kernel, kernel

_COUNT, _SX, _SY, _SXX, _SXY, _SYY, _NEWEST, _TOP, _BOTTOM, _OTHERS = range(10)
"""Columns of a cluster: number of returns of what came, sums of their places from the laser and of
their products [m, m2], newest stamp [s], largest and least height [m], and number of returns of
what stands in and beside its cells."""

_UNLABELLED = -1
"""Label of a cell with returns of what came that is in no cluster yet."""

_SPREAD = 12.0
"""Square of the ratio of a uniform distribution's width to its standard deviation."""

_FRONT = np.pi / 4
"""Mean distance of a round body's visible front from its middle, in radii."""


class MoverDetectorConfig(BaseModel):
    """Settings of the mover detector, all of them assumptions.

    Attributes:
        min_hits: Fewest returns of a mover.
        min_top: Least height of its highest return [m].
        min_extent: Least difference of heights of its returns [m].
        max_size: Largest horizontal extent [m].
        min_share: Least share of what came in the returns of what is known, in and beside its
            cells.
        radius_range: Smallest and largest radius that is reported [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    min_hits: int = Field(default=10, ge=1)
    min_top: float = Field(default=1.0, ge=0)
    min_extent: float = Field(default=0.5, ge=0)
    max_size: float = Field(default=1.2, gt=0)
    min_share: float = Field(default=0.6, ge=0, le=1)
    radius_range: tuple[float, float] = (0.15, 0.6)


class DetectorLaw(NamedTuple):
    """Numbers of ``MoverDetectorConfig`` for compiled code, and the edge of a cell [m]."""

    cell: float
    min_hits: float
    min_top: float
    min_extent: float
    max_size: float
    min_share: float
    smallest: float
    largest: float

    @classmethod
    def of(cls, config: MoverDetectorConfig, cell: float) -> "DetectorLaw":
        """Return the numbers of settings, for cells of some edge [m]."""
        return cls(
            cell,
            config.min_hits,
            config.min_top,
            config.min_extent,
            config.max_size,
            config.min_share,
            *config.radius_range,
        )


@kernel
def detect_movers(
    returns: NDArray[np.float64],
    origin: NDArray[np.float64],
    complete: tuple[float, float],
    law: DetectorLaw,
) -> NDArray[np.float64]:
    """Return x, y, radius of the movers among returns at body height [m], shape (c, 3).

    Args:
        returns: Returns as ``FreeSpaceGrid.update`` gives them, shape (k, 5).
        origin: Place of the laser [m], shape (3,).
        complete: Times after which, and up to which, the newest return of a cluster counts [s]: the
            laser has passed it, and it did not count before.
        law: Numbers of the settings.
    """
    cells, labels = _labels(returns, origin, law.cell)
    table = _clusters(returns, origin, cells, labels)
    discs, count = np.empty((len(table), 3)), 0
    for row in table:
        if row[_COUNT] < law.min_hits or not complete[0] < row[_NEWEST] <= complete[1]:
            continue
        is_tall = row[_TOP] >= law.min_top and row[_TOP] - row[_BOTTOM] >= law.min_extent
        if not is_tall or row[_COUNT] < law.min_share * (row[_COUNT] + row[_OTHERS]):
            continue
        x, y, radius = _disc(row, law)
        if radius > 0.0:
            discs[count] = origin[0] + x, origin[1] + y, radius
            count += 1
    return discs[:count].copy()


@kernel
def _labels(
    returns: NDArray[np.float64], origin: NDArray[np.float64], cell: float
) -> tuple[NDArray[np.int64], NDArray[np.int16]]:
    """Return the cell of each return, shape (k, 2), and the cluster of each cell, from 1 on.

    Cells with returns of what came are in one cluster if they touch, at a corner, too.
    """
    cells = np.empty((len(returns), 2), dtype=np.int64)
    for c in range(2):
        for k in range(len(returns)):
            cells[k, c] = int(np.floor(returns[k, c] / cell))
    first = np.zeros(2, dtype=np.int64)
    size = np.ones(2, dtype=np.int64)
    for c in range(2):
        if len(cells):
            first[c] = cells[:, c].min() - 1
            size[c] = cells[:, c].max() + 2 - first[c]
    labels = np.zeros((size[0], size[1]), dtype=np.int16)
    for k in range(len(returns)):
        cells[k] -= first
        if returns[k, KIND] == CAME:
            labels[cells[k, 0], cells[k, 1]] = _UNLABELLED
    stack, count = np.empty((len(returns) + 1, 2), dtype=np.int64), 0
    for k in range(len(returns)):
        if labels[cells[k, 0], cells[k, 1]] == _UNLABELLED:
            count += 1
            _flood(cells[k, 0], cells[k, 1], count, labels, stack)
    return cells, labels


@borrowing_kernel
def _flood(i: int, j: int, label: int, labels: NDArray[np.int16], stack: NDArray[np.int64]) -> None:
    """Label the cells that touch one of them, and so on.

    Args:
        i: Row of the first cell.
        j: Column of it.
        label: Label.
        labels: Labels, changed in place; no cell at the border has returns.
        stack: Memory for as many cells as there are.
    """
    labels[i, j], stack[0, 0], stack[0, 1], size = label, i, j, 1
    while size > 0:
        size -= 1
        row, column = stack[size, 0], stack[size, 1]
        for a in range(row - 1, row + 2):
            for b in range(column - 1, column + 2):
                if labels[a, b] == _UNLABELLED:
                    labels[a, b], stack[size, 0], stack[size, 1] = label, a, b
                    size += 1


@kernel
def _clusters(
    returns: NDArray[np.float64],
    origin: NDArray[np.float64],
    cells: NDArray[np.int64],
    labels: NDArray[np.int16],
) -> NDArray[np.float64]:
    """Return the clusters, shape (c, 10)."""
    count = 0
    for k in range(len(cells)):
        count = max(count, int(labels[cells[k, 0], cells[k, 1]]))
    table = np.zeros((count, 10))
    table[:, _NEWEST], table[:, _TOP], table[:, _BOTTOM] = -np.inf, -np.inf, np.inf
    for k in range(len(cells)):
        i, j = cells[k, 0], cells[k, 1]
        if returns[k, KIND] == CAME:
            _add(table[labels[i, j] - 1], returns[k], origin)
        elif returns[k, KIND] == STANDS:
            label = _label_beside(labels, i, j)
            if label > 0:
                table[label - 1, _OTHERS] += 1.0
    return table


@borrowing_kernel
def _label_beside(labels: NDArray[np.int16], i: int, j: int) -> int:
    """Return the cluster of a cell or of one beside it, 0 for none."""
    label = 0
    for a in range(i - 1, i + 2):
        for b in range(j - 1, j + 2):
            label = max(label, int(labels[a, b]))
    return label


@borrowing_kernel
def _add(
    cluster: NDArray[np.float64], point: NDArray[np.float64], origin: NDArray[np.float64]
) -> None:
    """Add a return to a cluster.

    Args:
        cluster: Columns of the cluster, changed in place, shape (10,).
        point: Return, shape (5,).
        origin: Place of the laser [m], shape (3,).
    """
    x, y = point[X] - origin[0], point[Y] - origin[1]
    cluster[_COUNT] += 1.0
    cluster[_SX] += x
    cluster[_SY] += y
    cluster[_SXX] += x * x
    cluster[_SXY] += x * y
    cluster[_SYY] += y * y
    cluster[_NEWEST] = max(cluster[_NEWEST], point[STAMP])
    cluster[_TOP] = max(cluster[_TOP], point[HEIGHT])
    cluster[_BOTTOM] = min(cluster[_BOTTOM], point[HEIGHT])


@kernel
def _disc(row: NDArray[np.float64], law: DetectorLaw) -> tuple[float, float, float]:
    """Return centre from the laser and radius of a cluster's disc [m], radius 0 if too large.

    The laser sees the front of a body: as wide as the body, and before its middle.
    """
    n = row[_COUNT]
    x, y = row[_SX] / n, row[_SY] / n
    xx, xy, yy = row[_SXX] / n - x * x, row[_SXY] / n - x * y, row[_SYY] / n - y * y
    far = np.hypot(x, y)
    u, v = x / far, y / far
    # Variances along the line of sight and across it.
    along = u * u * xx + 2.0 * u * v * xy + v * v * yy
    across = v * v * xx - 2.0 * u * v * xy + u * u * yy
    if _SPREAD * max(along, across) > law.max_size * law.max_size:
        return 0.0, 0.0, 0.0
    radius = min(max(0.5 * np.sqrt(_SPREAD * max(across, 0.0)), law.smallest), law.largest)
    return x + _FRONT * radius * u, y + _FRONT * radius * v, radius
