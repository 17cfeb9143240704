"""Virtual 2D scan: the free distance in every sector, from the states of polar cells."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from traversability.grid import PolarGrid
from traversability.labels import CellState


@dataclass(frozen=True)
class VirtualScan:
    """Free distance in every sector around the vehicle.

    Attributes:
        ranges: Inner edge of each sector's nearest non-traversable cell [m]; ``inf`` is free to the
            last ring, NaN is unknown (all cells of the sector are empty). float32, shape
            (n_sectors,), sector 0 centred on bearing ``-pi + pi / n_sectors``, then
            counter-clockwise (REP-117).
        max_range: Last ring edge [m].
        log_odds: Log odds of each cell for being non-traversable, minus those of the threshold:
            from 0 on a cell is classified so. NaN is not classified, which all cells behind the
            first non-traversable one of a sector may be. float32, shape (n_sectors, n_rings), or
            None without a classification.
    """

    ranges: NDArray[np.float32]
    max_range: float
    log_odds: NDArray[np.float32] | None = None

    def finite(self) -> NDArray[np.float32]:
        """Return ranges for the policy, free and unknown ones as ``max_range`` [m], shape (n,)."""
        return np.where(np.isfinite(self.ranges), self.ranges, np.float32(self.max_range))

    @property
    def nearest(self) -> float:
        """Smallest range [m]; free and unknown sectors count as ``max_range``."""
        return float(self.finite().min())

    def known(self) -> NDArray[np.float32]:
        """Return ranges with free ones as ``max_range`` and unknown ones as NaN [m], shape (n,)."""
        return np.where(np.isposinf(self.ranges), np.float32(self.max_range), self.ranges)

    def log_odds_of(self, grid: PolarGrid) -> NDArray[np.float32]:
        """Return the log odds of cells, or those that follow from the ranges if there are none.

        Args:
            grid: Polar grid of the cells.

        Returns:
            Log odds as in ``log_odds``; infinite where they follow from ranges. float32, shape
            (n_sectors, n_rings).
        """
        if self.log_odds is not None:
            return self.log_odds
        # As ranges are: the float64 of an edge may lie beyond its float32, in the next ring.
        edges = grid.ring_edges.astype(np.float32)
        near, far = edges[:-1], edges[1:]
        ranges = self.ranges[:, None]
        blocked = (ranges >= near) & (ranges < far)
        blocked[:, 0] |= self.ranges < near[0]
        cells = np.where(blocked, CellState.NON_TRAVERSABLE, CellState.EMPTY)
        return certain_log_odds(np.where(ranges >= far, CellState.TRAVERSABLE, cells))


def certain_log_odds(cells: NDArray[np.integer]) -> NDArray[np.float32]:
    """Return infinite log odds for cells that are known for certain, NaN where they are empty.

    Args:
        cells: ``CellState`` of each cell, any shape.

    Returns:
        float32, the same shape.
    """
    odds = np.full(cells.shape, np.nan, dtype=np.float32)
    odds[cells == CellState.TRAVERSABLE] = -np.inf
    odds[cells == CellState.NON_TRAVERSABLE] = np.inf
    return odds


def virtual_scan(cells: NDArray[np.uint8], grid: PolarGrid) -> VirtualScan:
    """Return the free distance in every sector around the vehicle.

    A sector ends at the inner edge of its nearest non-traversable cell; without one it is free to
    the last ring, and unknown when all of its cells are empty.

    Args:
        cells: ``CellState`` of each cell in ``base_footprint``, uint8, shape (n_sectors, n_rings).
        grid: Polar grid of the cells.

    Raises:
        ValueError: If the shape of the cells is not that of the grid.

    Source: Sanchez et al. 2023, section 3.2; the inner edge is an assumption.
    """
    if cells.shape != (grid.n_sectors, grid.n_rings):
        expected = (grid.n_sectors, grid.n_rings)
        raise ValueError(f"cells: expected shape {expected} of the grid, got {cells.shape}")
    blocked = cells == CellState.NON_TRAVERSABLE
    ranges = np.where(blocked.any(axis=1), grid.ring_edges[blocked.argmax(axis=1)], np.inf)
    ranges[(cells == CellState.EMPTY).all(axis=1)] = np.nan
    return VirtualScan(ranges.astype(np.float32), grid.outer_radius, certain_log_odds(cells))
