"""Labels of cells: the 15 % rule, empty cells, objects and borderline cases."""

import numpy as np
import pytest

from traversability.binning import fill_quarters
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid
from traversability.labels import (
    CellState,
    beyond_doubt,
    label_cells,
    nontraversable,
    object_points,
)

GRID = PolarGrid()


def cell_points(n, sector=16, ring=5, seed=0):
    """Return points of one cell, float32, shape (n, 3)."""
    rng = np.random.default_rng(seed)
    r = rng.uniform(GRID.ring_edges[ring] * 1.001, GRID.ring_edges[ring + 1] * 0.999, n)
    bearing = GRID.bearings[sector] + rng.uniform(-0.09, 0.09, n)
    return np.column_stack([r * np.cos(bearing), r * np.sin(bearing), np.zeros(n)]).astype("f4")


@pytest.mark.parametrize(
    ("points", "bad", "state"),
    [
        (4, 4, CellState.EMPTY),
        (5, 0, CellState.TRAVERSABLE),
        (100, 14, CellState.TRAVERSABLE),
        (100, 15, CellState.NON_TRAVERSABLE),
        (20, 3, CellState.NON_TRAVERSABLE),
    ],
)
def test_a_cell_is_blocked_from_15_percent_of_its_points_on(points, bad, state):
    """Cells with fewer than five points are empty, whatever they show."""
    cloud = cell_points(points)
    flags = np.arange(points) < bad
    cells = label_cells(cloud, flags, GRID)
    assert cells[16, 5] == state
    assert (np.delete(cells.ravel(), 16 * GRID.n_rings + 5) == CellState.EMPTY).all()


def test_an_overhang_is_not_projected():
    """Points above the cut have no vote."""
    cloud = cell_points(100)
    cloud[:50, 2] = 1.3
    assert label_cells(cloud, np.arange(100) < 50, GRID)[16, 5] == CellState.TRAVERSABLE


def test_cells_near_the_limits_are_in_doubt():
    """Beyond doubt are cells a margin beyond the limits, on either side."""
    points = np.concatenate([cell_points(100, sector=s) for s in (2, 3, 4, 5)])
    severity = np.repeat([-5.0, -0.5, 0.5, 5.0], 100).astype(np.float32)
    cloud = PointCloud(points, severity=severity, nontraversable=severity > 0)
    clear = beyond_doubt(cloud, GRID)[[2, 3, 4, 5], 5]
    np.testing.assert_array_equal(clear, [True, False, False, True])


@pytest.mark.parametrize(("count", "ring", "state"), [(4, 2, 1), (5, 2, 2), (5, 9, 1)])
def test_five_points_of_an_object_block_a_near_cell_alone(count, ring, state):
    """A low rock is less than 15 % of a cell; far cells keep to the paper's rule."""
    cloud = cell_points(100, ring=ring)
    objects = np.arange(100) < count
    assert label_cells(cloud, objects, GRID)[16, ring] == CellState.TRAVERSABLE
    assert label_cells(cloud, objects, GRID, objects=objects)[16, ring] == state


def test_objects_are_the_points_of_infinite_severity():
    """Without severity they look like steep ground, and all bad points are objects."""
    severity = np.float32([np.inf, 5.0, -np.inf, -1.0])
    cloud = PointCloud(np.zeros((4, 3), np.float32), nontraversable=severity > 0, severity=severity)
    assert object_points(cloud).tolist() == [True, False, False, False]
    plain = PointCloud(cloud.points, nontraversable=severity > 0)
    assert object_points(plain).tolist() == [True, True, False, False]


def test_clouds_without_labels_are_refused():
    """Errors name the column, and what came."""
    points = cell_points(10)
    with pytest.raises(ValueError, match="nontraversable: expected labelled points, got none"):
        nontraversable(PointCloud(points))
    with pytest.raises(ValueError, match=r"nontraversable: expected shape \(10,\), got \(9,\)"):
        label_cells(points, np.zeros(9, bool), GRID)


def test_quarters_that_are_known_give_the_same_labels():
    """The quarters of a cloud are found once for several labels of it."""
    rng = np.random.default_rng(5)
    points = rng.uniform(-8, 8, (4000, 3)).astype(np.float32) * np.float32([1, 1, 0.1])
    flags = rng.random(4000) < 0.2
    bins = fill_quarters(points, GRID).bins[:4000]
    found = label_cells(points, flags, GRID, bins=bins)
    np.testing.assert_array_equal(found, label_cells(points, flags, GRID))
    assert len(np.unique(found)) == 3
