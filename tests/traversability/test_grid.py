"""The polar grid: its edges and bearings."""

import numpy as np
import pytest
from pydantic import ValidationError

from traversability.grid import PolarGrid

GRID = PolarGrid()


def test_the_first_ring_begins_within_the_papers_collision_range():
    """The first edge is nearer than 0.72 m, the last one is 10 m."""
    assert GRID.ring_edges[0] < 0.72
    assert GRID.ring_edges[-1] == 10.0


def test_ring_edges_grow_geometrically():
    """Each edge is the same number of times the one before; both radii are edges."""
    edges = GRID.ring_edges
    assert edges.shape == (GRID.n_rings + 1,)
    np.testing.assert_allclose(edges[1:] / edges[:-1], (10 / 0.6) ** 0.1)
    assert (edges[0], edges[-1]) == (0.6, 10.0)


def test_bearings_go_counter_clockwise_from_behind():
    """Sector 0 begins at -pi; half of the sectors later begins the one to the left of ahead."""
    width = 2 * np.pi / 32
    np.testing.assert_allclose(
        GRID.bearings[[0, 15, 16]], [-np.pi + width / 2, -width / 2, width / 2]
    )
    np.testing.assert_allclose(np.diff(GRID.bearings), width)


def test_kept_arrays_cannot_be_written():
    """Edges and bearings are shared by all grids of one size."""
    for array in (GRID.ring_edges, GRID.bearings):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


def test_a_first_edge_beyond_the_last_one_is_refused():
    """The error names both radii."""
    with pytest.raises(ValidationError, match=r"inner_radius: expected less than outer_radius"):
        PolarGrid(inner_radius=10.0)


def test_rings_that_cannot_be_told_apart_are_refused():
    """The error names the first ring; a hundred rings from 0.1 to 10 m are none of them."""
    assert PolarGrid(inner_radius=0.1, n_rings=100).n_rings == 100
    with pytest.raises(ValidationError, match=r"first ring .* 0\.001 to 0\.0011 m of 100 rings"):
        PolarGrid(inner_radius=0.001, n_rings=100)
