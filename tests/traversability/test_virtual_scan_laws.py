"""Laws of the virtual scan: obstacles never lengthen it, and cells follow from its ranges."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tests.support.properties import law
from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.virtual_scan import VirtualScan, virtual_scan

STATES = [CellState.EMPTY, CellState.TRAVERSABLE, CellState.NON_TRAVERSABLE]


@st.composite
def grids_and_cells(draw):
    """Return a grid and the states of its cells."""
    shape = draw(st.integers(4, 48)), draw(st.integers(1, 15))
    cells = draw(arrays(np.uint8, shape, elements=st.sampled_from([int(s) for s in STATES])))
    return PolarGrid(n_sectors=shape[0], n_rings=shape[1]), cells


@law
@given(grids_and_cells())
def test_a_range_is_an_edge_or_free_or_unknown(given_cells):
    """NaN where all is empty, infinite without an obstacle, else its inner edge."""
    grid, cells = given_cells
    ranges = virtual_scan(cells, grid).ranges
    for row, found in zip(cells, ranges, strict=True):
        blocked = np.flatnonzero(row == CellState.NON_TRAVERSABLE)
        if (row == CellState.EMPTY).all():
            assert np.isnan(found)
        elif not len(blocked):
            assert np.isposinf(found)
        else:
            assert found == np.float32(grid.ring_edges[blocked[0]])


@law
@given(grids_and_cells(), st.data())
def test_one_more_obstacle_never_lengthens_a_range(given_cells, data):
    """It shortens that of its sector, or nothing; other sectors stay as they are."""
    grid, cells = given_cells
    sector = data.draw(st.integers(0, grid.n_sectors - 1))
    ring = data.draw(st.integers(0, grid.n_rings - 1))
    more = cells.copy()
    more[sector, ring] = CellState.NON_TRAVERSABLE
    before, after = virtual_scan(cells, grid).finite(), virtual_scan(more, grid).finite()
    assert after[sector] <= before[sector]
    assert after[sector] <= np.float32(grid.ring_edges[ring])
    others = np.arange(grid.n_sectors) != sector
    np.testing.assert_array_equal(after[others], before[others])


@law
@given(grids_and_cells(), st.integers(0, 47))
def test_cells_that_turn_turn_the_scan(given_cells, turn):
    """By as many sectors."""
    grid, cells = given_cells
    turned = virtual_scan(np.roll(cells, turn, axis=0), grid).ranges
    np.testing.assert_array_equal(turned, np.roll(virtual_scan(cells, grid).ranges, turn))


@law
@given(grids_and_cells())
def test_cells_from_ranges_give_the_same_ranges(given_cells):
    """What a scan without log odds says of cells is a scan again, but where it is unknown."""
    grid, cells = given_cells
    ranges = virtual_scan(cells, grid).ranges
    odds = VirtualScan(ranges, grid.outer_radius).log_odds_of(grid)
    states = np.full(odds.shape, CellState.EMPTY, dtype=np.uint8)
    states[odds == np.inf], states[odds == -np.inf] = (
        CellState.NON_TRAVERSABLE,
        CellState.TRAVERSABLE,
    )
    np.testing.assert_array_equal(virtual_scan(states, grid).ranges, ranges)
