"""The pass over points with relief: every point is in one layer, bumps are found in near rings."""

import numpy as np

from tests.support.polar_clouds import rough_ground
from traversability.binning import fill_quarters, polar_tables
from traversability.cells.bumps import rings_with_bumps
from traversability.cells.columns import MIN_DESCRIBED, make_workspace
from traversability.cells.relief import FIRST, N_ABOVE, SECOND, THIRD, examine_relief
from traversability.cells.shape import describe_cells
from traversability.features import OWN_FEATURES
from traversability.grid import PolarGrid

GRID = PolarGrid()


def examined(points):
    """Return the workspace after the pass, and the highest points of the quarters."""
    quarters = fill_quarters(points, GRID)
    tables, cells = polar_tables(GRID), make_workspace(GRID, len(OWN_FEATURES))
    describe_cells(quarters, tables.middles, tables.halves, 0.15, cells)
    rings = rings_with_bumps(tables.middles)
    return cells, examine_relief(quarters, rings, 0.15, cells), rings


def test_every_point_of_a_described_cell_is_in_one_layer():
    """The layers of a cell hold as many points as the cell, whether looked at or not."""
    cells, _, _ = examined(rough_ground())
    known = cells.counts >= MIN_DESCRIBED
    np.testing.assert_array_equal(cells.layers.sum(axis=2)[known], cells.counts[known])
    assert not cells.layers[~known].any()


def test_highest_points_are_in_order_and_of_near_rings():
    """The first is not below the second, nor that below the third; beyond the rings all is zero."""
    cells, tops, rings = examined(rough_ground())
    shape = (*cells.levels.shape, 4)
    assert (tops[:, FIRST] >= tops[:, SECOND]).all()
    assert (tops[:, SECOND] >= tops[:, THIRD]).all()
    assert ((tops[:, N_ABOVE] > 0) == (tops[:, FIRST] > 0.04)).all()
    assert tops.reshape(shape)[:, : 2 * rings].any()
    assert not tops.reshape(shape)[:, 2 * rings :].any()


def test_rings_are_searched_for_bumps_up_to_3_2_m():
    """As many rings as have their middle nearer."""
    middles = polar_tables(GRID).middles
    assert rings_with_bumps(middles) == (middles < 3.2).sum()
