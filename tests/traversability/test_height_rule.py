"""The quantile rule: obstacles stand out of their own cell, by hand."""

import numpy as np
import pytest

from traversability.binning import fill_quarters
from traversability.grid import PolarGrid
from traversability.height_rule import RULE_HEIGHT, RULE_QUANTILE, quantile_rule

GRID = PolarGrid()


def column_of(heights, x=2.0, y=0.1):
    """Return points of one place at some heights [m], float32, shape (n, 3)."""
    heights = np.asarray(heights, dtype=np.float32)
    return np.column_stack([np.full_like(heights, x), np.full_like(heights, y), heights])


@pytest.mark.parametrize(
    ("quantile", "level"), [(0.0, 0.0), (0.24, 0.0), (0.25, 0.1), (0.5, 0.2), (1.0, 0.4)]
)
def test_the_level_is_the_quantile_of_the_cells_heights(quantile, level):
    """Of five heights the quantile of a quarter is the second lowest, whatever their order."""
    heights = np.array([0.4, 0.0, 0.3, 0.1, 0.2])
    found = quantile_rule(0.15, quantile, GRID)(column_of(heights))
    np.testing.assert_array_equal(found, heights > level + 0.15)


@pytest.mark.parametrize("quantile", [0.0, 0.25, 0.6, 1.0])
def test_levels_are_those_of_sorted_cells(quantile):
    """A cloud of many cells, with heights that repeat, as by sorting each cell."""
    rng = np.random.default_rng(4)
    points = np.column_stack([rng.uniform(-4, 4, (2, 3000)).T, rng.integers(0, 90, 3000) / 100])
    points = points.astype(np.float32)
    bins = fill_quarters(points, GRID).bins
    sector, ring = np.divmod(bins, 2 * GRID.n_rings)
    cells = sector // 2 * GRID.n_rings + ring // 2
    expected = np.zeros(3000, dtype=np.bool_)
    for cell in np.unique(cells[bins >= 0]):
        own = np.flatnonzero((cells == cell) & (bins >= 0))
        ranked = np.sort(points[own, 2])
        level = ranked[int(quantile * (len(own) - 1))]
        expected[own] = points[own, 2] > level + np.float32(0.2)
    np.testing.assert_array_equal(quantile_rule(0.2, quantile, GRID)(points), expected)


def test_a_point_is_an_obstacle_above_the_height_and_not_at_it():
    """Half a metre over the level is no obstacle with a height of half a metre."""
    found = quantile_rule(0.5, 0.25, GRID)(column_of([-1.0, -1.0, -0.5, -0.4375]))
    assert found.tolist() == [False, False, False, True]


def test_each_cell_has_its_own_level():
    """A step between two cells is no obstacle, an object in either is one."""
    low, high = column_of([0.0, 0.0, 0.0, 0.5]), column_of([1.0, 1.0, 1.0, 0.5], x=-2.0)
    found = quantile_rule(0.2, 0.5, GRID)(np.concatenate([low, high]))
    assert found.tolist() == [False, False, False, True] + 4 * [False]


def test_quarters_of_a_cell_share_their_level():
    """Points of two quarters of one cell are ranked together."""
    near, far = GRID.ring_edges[5] * 1.01, GRID.ring_edges[6] * 0.99
    points = np.concatenate([column_of([0.0, 0.0, 0.0], x=near), column_of([0.3], x=far)])
    assert quantile_rule(0.2, 0.25, GRID)(points).tolist() == [False, False, False, True]


def test_points_outside_of_the_grid_and_above_its_cut_are_no_obstacles():
    """They belong to no cell, and change no level."""
    inside = column_of([0.0, 0.0, 0.0, 0.3])
    others = np.concatenate([column_of([9.0]), column_of([0.3], x=11.0), column_of([0.3], x=0.1)])
    rule = quantile_rule(RULE_HEIGHT, RULE_QUANTILE, GRID)
    assert rule(np.concatenate([others, inside])).tolist() == [False] * 6 + [True]
    assert rule(others[1:]).tolist() == [False, False]
