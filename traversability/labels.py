"""True states of cells from labelled points (Sanchez et al. 2023, section 3.4)."""

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
"""Points of a thing that make a near cell non-traversable, however small their share is.

Assumption: a rock that stops a wheel fills less than 15 % of a cell, and a robot that drives by the
paper's rule alone meets it.
"""

OBJECT_RANGE = 3.2
"""Cells that begin nearer than this are near [m]."""


class CellState(IntEnum):
    """State of a cell: white, green and red in the paper's pictures."""

    EMPTY = 0
    TRAVERSABLE = 1
    NON_TRAVERSABLE = 2


def nontraversable(cloud: PointCloud) -> NDArray[np.bool_]:
    """Return the labels of a cloud's points, shape (n,).

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
) -> NDArray[np.uint8]:
    """Return the true state of each cell.

    Args:
        points: Points in ``base_footprint`` [m], shape (n, 3).
        nontraversable: Whether each belongs to something the robot must not drive on, shape (n,).
        grid: The cells; its height limit and least number of points hold here too.
        min_share: Share of non-traversable points from which a cell is non-traversable.
        objects: Whether each point belongs to a thing rather than to the ground, shape (n,): a few
            of them are enough in near cells. None keeps to the paper's share everywhere.

    Returns:
        ``CellState`` of each cell, uint8, shape (n_sectors, n_rings).

    Raises:
        ValueError: If there is not one label a point.
    """
    if nontraversable.shape != (len(points),):
        expected = (len(points),)
        raise ValueError(f"nontraversable: expected shape {expected}, got {nontraversable.shape}")
    quarters = fill_quarters(points, grid)
    counts = np.zeros((2, grid.n_sectors, grid.n_rings), dtype=np.int64)
    _count(quarters.bins[: len(points)], nontraversable, counts)
    total = counts.sum(axis=0)
    bad = counts[1] >= min_share * total
    if objects is not None:
        _count(quarters.bins[: len(points)], objects, counts)
        bad |= (counts[1] >= MIN_OBJECT_POINTS) & (grid.ring_edges[:-1] < OBJECT_RANGE)
    states = np.where(bad, CellState.NON_TRAVERSABLE, CellState.TRAVERSABLE)
    states[total < grid.min_points] = CellState.EMPTY
    return states.astype(np.uint8)


def object_points(cloud: PointCloud) -> NDArray[np.bool_]:
    """Return which points of a labelled cloud belong to things, shape (n,).

    A cloud that does not tell them from steep ground has all that forbid it.
    """
    return nontraversable(cloud) if cloud.severity is None else np.isposinf(cloud.severity)


def beyond_doubt(cloud: PointCloud, grid: PolarGrid) -> NDArray[np.bool_]:
    """Return which cells are no borderline cases, shape (n_sectors, n_rings).

    Surely red are cells with 30 % of points more than a margin beyond the limits, surely green
    those with less than 5 % of points within a margin of them or beyond. Without ``severity`` the
    shares alone decide.
    """
    bad = nontraversable(cloud)
    severity = np.where(bad, np.inf, -np.inf) if cloud.severity is None else cloud.severity
    surely = label_cells(cloud.points, severity > 1, grid, 0.30)
    maybe = label_cells(cloud.points, severity > -1, grid, 0.05)
    return (surely == CellState.NON_TRAVERSABLE) | (maybe == CellState.TRAVERSABLE)


@kernel
def _count(bins, nontraversable, counts):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Count good and bad points of each cell."""
    counts[:] = 0
    rings = counts.shape[2]
    for k in range(len(bins)):
        if bins[k] >= 0:
            sector, ring = divmod(bins[k], 2 * rings)
            counts[int(nontraversable[k]), sector // 2, ring // 2] += 1
