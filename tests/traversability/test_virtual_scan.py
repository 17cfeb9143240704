"""The virtual scan: one dip at the right bearing, free and unknown sectors."""

import numpy as np
import pytest

from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.virtual_scan import VirtualScan, certain_log_odds, virtual_scan

GRID = PolarGrid()


def test_one_block_gives_one_dip_at_the_right_bearing():
    """A block to the left ends the range of the sector to the left, at its inner edge."""
    cells = np.full((GRID.n_sectors, GRID.n_rings), CellState.TRAVERSABLE, dtype=np.uint8)
    sector = int(np.argmin(np.abs(GRID.bearings - np.pi / 2)))  # To the left.
    cells[sector, 4:] = CellState.NON_TRAVERSABLE
    scan = virtual_scan(cells, GRID)
    assert scan.ranges[sector] == pytest.approx(GRID.ring_edges[4])
    assert np.isinf(np.delete(scan.ranges, sector)).all()
    assert (scan.finite() <= 10.0).all()


def test_the_nearest_range_is_that_of_a_known_obstacle():
    """Free and unknown sectors count as the largest range."""
    for ranges, nearest in (
        ([np.inf, np.nan, 0.6, 2.0], 0.6),
        ([np.inf, np.nan], 10.0),
        ([np.nan, 10.0], 10.0),
    ):
        scan = VirtualScan(np.array(ranges, dtype=np.float32), 10.0)
        assert scan.nearest == pytest.approx(nearest)


def test_a_sector_with_empty_cells_alone_is_unknown():
    """One free cell makes its sector free."""
    cells = np.zeros((GRID.n_sectors, GRID.n_rings), dtype=np.uint8)
    cells[3, 7] = CellState.TRAVERSABLE
    scan = virtual_scan(cells, GRID)
    assert np.isnan(np.delete(scan.ranges, 3)).all()
    assert np.isinf(scan.ranges[3])
    np.testing.assert_array_equal(scan.finite(), 10.0)


def test_log_odds_follow_from_ranges_where_there_is_no_classification():
    """Cells before the range are free, the one at it is blocked, those behind are unknown."""
    edges = GRID.ring_edges
    ranges = np.full(GRID.n_sectors, np.inf, np.float32)
    ranges[:3] = edges[4] + 0.01, 0.1, np.nan
    log_odds = VirtualScan(ranges, GRID.outer_radius).log_odds_of(GRID)
    assert (log_odds[0, :4] == -np.inf).all()
    assert log_odds[0, 4] == np.inf
    assert np.isnan(log_odds[0, 5:]).all()
    assert log_odds[1, 0] == np.inf  # Nearer than the first ring.
    assert np.isnan(log_odds[2]).all()
    assert (log_odds[3] == -np.inf).all()


def test_certain_log_odds_are_infinite():
    """Empty is NaN, free is minus infinity, blocked is infinity."""
    np.testing.assert_array_equal(certain_log_odds(np.array([0, 1, 2])), [np.nan, -np.inf, np.inf])


def test_cells_of_another_grid_are_refused():
    """The error names both shapes."""
    with pytest.raises(ValueError, match=r"expected shape \(32, 10\) of the grid, got \(32, 9\)"):
        virtual_scan(np.zeros((32, 9), np.uint8), GRID)


def test_a_range_of_an_edge_blocks_the_ring_that_begins_there():
    """Whichever way its float32 is rounded; nearer rings are free."""
    for rings in (5, 9, 10, 17):
        grid = PolarGrid(n_sectors=rings, n_rings=rings)
        ranges = grid.ring_edges[:-1].astype(np.float32)
        odds = VirtualScan(ranges, grid.outer_radius).log_odds_of(grid)
        np.testing.assert_array_equal(odds == np.inf, np.eye(rings, dtype=bool))
        np.testing.assert_array_equal(odds == -np.inf, np.tri(rings, k=-1, dtype=bool))
