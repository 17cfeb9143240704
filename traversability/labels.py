"""Labels of polar cells from labelled points (Sanchez et al. 2023, section 3.4)."""

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel
from traversability.binning import fill_quarters
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid

MIN_SHARE = 0.15
"""Share of non-traversable points that makes a cell non-traversable (paper: 15 %)."""

MIN_OBJECT_POINTS = 5
"""Number of points of objects that make a near cell non-traversable, however small their share.

Assumption: a rock that stops a wheel fills less than 15 % of a cell, and a robot that drives by the
paper's rule alone collides with it.
"""

OBJECT_RANGE = 3.2
"""Distance within which a cell has to begin to be near [m]."""


class CellState(IntEnum):
    """State of a cell: white (unknown), green (free) and red (blocked) in the paper's pictures."""

    EMPTY = 0
    TRAVERSABLE = 1
    NON_TRAVERSABLE = 2


def nontraversable(cloud: PointCloud) -> NDArray[np.bool_]:
    """Return the labels of a cloud's points, bool, shape (n,).

    Args:
        cloud: Labelled cloud.

    Raises:
        ValueError: If the cloud has none.
    """
    if cloud.nontraversable is None:
        raise ValueError("nontraversable: expected labelled points, got none")
    return cloud.nontraversable


def label_cells(
    points: NDArray[np.float32],
    nontraversable: NDArray[np.bool_],
    grid: PolarGrid,
    min_share: float = MIN_SHARE,
    objects: NDArray[np.bool_] | None = None,
    bins: NDArray[np.int32] | None = None,
) -> NDArray[np.uint8]:
    """Return the true state of each cell.

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        nontraversable: True for points of something the robot must not drive on, shape (n,).
        grid: Polar grid of cells; its height limit and smallest number of points apply here, too.
        min_share: Share of non-traversable points from which on a cell is non-traversable.
        objects: True for points of objects rather than of the ground, shape (n,): a few of them are
            enough in near cells. None applies the paper's share everywhere.
        bins: Quarter of each point, as in ``Quarters``, shape (n,); None finds them.

    Returns:
        ``CellState`` of each cell, uint8, shape (n_sectors, n_rings).

    Raises:
        ValueError: If the number of labels is not that of the points.
    """
    if nontraversable.shape != (len(points),):
        expected = (len(points),)
        raise ValueError(f"nontraversable: expected shape {expected}, got {nontraversable.shape}")
    if bins is None:
        bins = fill_quarters(points, grid).bins[: len(points)]
    counts = _counts(bins, nontraversable, grid)
    total = counts.sum(axis=0)
    blocked = counts[1] >= min_share * total
    if objects is not None:
        counts = _counts(bins, objects, grid)
        blocked |= (counts[1] >= MIN_OBJECT_POINTS) & (grid.ring_edges[:-1] < OBJECT_RANGE)
    states = np.where(blocked, CellState.NON_TRAVERSABLE, CellState.TRAVERSABLE)
    states[total < grid.min_points] = CellState.EMPTY
    return states.astype(np.uint8)


def object_points(cloud: PointCloud) -> NDArray[np.bool_]:
    """Return which points of a labelled cloud belong to objects, bool, shape (n,).

    In a cloud without ``severity``, objects and steep ground are not distinguished: all
    non-traversable points are returned.

    Args:
        cloud: Labelled cloud.
    """
    return nontraversable(cloud) if cloud.severity is None else np.isposinf(cloud.severity)


def beyond_doubt(cloud: PointCloud, grid: PolarGrid) -> NDArray[np.bool_]:
    """Return which cells are no borderline cases, bool, shape (n_sectors, n_rings).

    Surely blocked are cells with 30 % of points more than a margin beyond the limits, surely free
    those with less than 5 % of points within a margin of them or beyond. Without ``severity`` the
    shares alone decide.

    Args:
        cloud: Labelled cloud in ``base_footprint``.
        grid: Polar grid of cells.
    """
    blocked = nontraversable(cloud)
    severity = np.where(blocked, np.inf, -np.inf) if cloud.severity is None else cloud.severity
    surely = label_cells(cloud.points, severity > 1, grid, 0.30)
    maybe = label_cells(cloud.points, severity > -1, grid, 0.05)
    return (surely == CellState.NON_TRAVERSABLE) | (maybe == CellState.TRAVERSABLE)


def _counts(
    bins: NDArray[np.int32], marked: NDArray[np.bool_], grid: PolarGrid
) -> NDArray[np.int64]:
    """Return the numbers of unmarked and of marked points, shape (2, n_sectors, n_rings)."""
    quarters = np.zeros((2, 4 * grid.n_sectors * grid.n_rings), dtype=np.int64)
    _count(bins, marked, quarters)
    # A quarter is half a sector by half a ring.
    parts = quarters.reshape(2, grid.n_sectors, 2, grid.n_rings, 2)
    return np.asarray(parts.sum(axis=(2, 4)))


@kernel
def _count(bins: NDArray[np.int32], marked: NDArray[np.bool_], counts: NDArray[np.int64]) -> None:
    """Add the points of each quarter to its numbers of unmarked and of marked points.

    Args:
        bins: Quarter of each point, or -1; see ``Quarters``.
        marked: True for marked points, shape (n,).
        counts: Numbers, unmarked points first, shape (2, 4 n_cells).
    """
    for k in range(len(bins)):
        if bins[k] >= 0:
            counts[np.uint64(marked[k]), np.uint64(bins[k])] += 1
