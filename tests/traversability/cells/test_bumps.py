"""Bumps of near cells: the highest points of their four quarters."""

import numpy as np
import pytest

from traversability.binning import polar_tables
from traversability.cells.bumps import rings_with_bumps, write_bumps
from traversability.cells.columns import (
    BUMP,
    BUMP_POINTS,
    BUMP_THIRD,
    MIN_DESCRIBED,
    make_workspace,
)
from traversability.cells.relief import FIRST, N_ABOVE, THIRD
from traversability.features import OWN_FEATURES
from traversability.grid import PolarGrid

GRID = PolarGrid()
COLUMNS = [BUMP, BUMP_THIRD, BUMP_POINTS]


@pytest.fixture
def cells():
    """Workspace whose cells all have enough points, and whose features are not zero."""
    found = make_workspace(GRID, len(OWN_FEATURES))
    found.counts[:] = MIN_DESCRIBED
    found.values[:] = 7.0
    return found


def tops_of(values):
    """Return the highest points of all quarters, zero but for some: by sector and ring of each."""
    tops = np.zeros((2 * GRID.n_sectors, 2 * GRID.n_rings, 4))
    for place, (first, third, above) in values.items():
        tops[place][[FIRST, THIRD, N_ABOVE]] = first, third, above
    return tops.reshape(-1, 4)


def test_a_cell_has_the_highest_bump_of_its_quarters_and_the_points_of_all(cells):
    """Its quarters are two neighbours in angle and two in distance."""
    quarters = {(10, 6): (0.1, 0.05, 3), (10, 7): (0.3, 0.02, 1)}
    quarters |= {(11, 6): (0.2, 0.04, 2), (11, 7): (0.0, 0.06, 5)}
    write_bumps(tops_of(quarters), 5, cells)
    np.testing.assert_allclose(cells.values[5, 3, COLUMNS], [0.3, 0.06, 11.0], rtol=1e-6)
    others = cells.values[:, :5, COLUMNS].copy()
    others[5, 3] = 0.0
    assert not others.any()


def test_far_cells_and_cells_of_few_points_are_left_as_they_are(cells):
    """So are all other features."""
    cells.counts[2, 1] = MIN_DESCRIBED - 1
    write_bumps(tops_of({(4, 2): (0.1, 0.1, 1), (4, 10): (0.1, 0.1, 1)}), 5, cells)
    assert (cells.values[2, 1] == 7.0).all()
    assert (cells.values[:, 5:] == 7.0).all()
    assert (np.delete(cells.values, COLUMNS, axis=2) == 7.0).all()


def test_rings_whose_middle_is_nearer_than_3_2_m_are_searched():
    """The first ring beyond ends the search; all may be near."""
    assert rings_with_bumps(np.array([0.5, 3.19, 3.2, 3.1])) == 2
    assert rings_with_bumps(np.array([0.5, 1.0])) == 2
    assert rings_with_bumps(np.array([4.0])) == 0
    middles = polar_tables(GRID).middles
    assert rings_with_bumps(middles) == (middles < 3.2).sum()
