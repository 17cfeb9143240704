"""From points to labels and ranges: the 15 % rule, empty cells, one dip at the right bearing."""

import numpy as np
import pytest

from traversability.cloud import PointCloud
from traversability.grid import PolarGrid
from traversability.labels import CellState, beyond_doubt, label_cells
from traversability.scores import PAPER, CellScores, range_errors
from traversability.virtual_scan import virtual_scan

GRID = PolarGrid()


def cell_points(n, sector=16, ring=5, seed=0):
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
def test_the_rule_of_fifteen_percent(points, bad, state):
    cloud = cell_points(points)
    flags = np.arange(points) < bad
    cells = label_cells(cloud, flags, GRID)
    assert cells[16, 5] == state
    assert (np.delete(cells.ravel(), 16 * GRID.n_rings + 5) == CellState.EMPTY).all()


def test_an_overhang_is_not_projected():
    cloud = cell_points(100)
    cloud[:50, 2] = 1.3
    assert label_cells(cloud, np.arange(100) < 50, GRID)[16, 5] == CellState.TRAVERSABLE


def test_the_first_ring_lets_the_papers_collision_rule_fire():
    assert GRID.ring_edges[0] < 0.72
    assert GRID.ring_edges[-1] == 10.0


def test_one_block_gives_one_dip_at_the_right_bearing():
    cells = np.full((GRID.n_sectors, GRID.n_rings), CellState.TRAVERSABLE, dtype=np.uint8)
    sector = int(np.argmin(np.abs(GRID.bearings - np.pi / 2)))  # To the left.
    cells[sector, 4:] = CellState.NON_TRAVERSABLE
    scan = virtual_scan(cells, GRID)
    assert scan.ranges[sector] == pytest.approx(GRID.ring_edges[4])
    assert np.isinf(np.delete(scan.ranges, sector)).all()
    assert (scan.finite() <= 10.0).all()


def test_a_sector_without_a_judged_cell_is_unknown():
    cells = np.zeros((GRID.n_sectors, GRID.n_rings), dtype=np.uint8)
    cells[3, 7] = CellState.TRAVERSABLE
    scan = virtual_scan(cells, GRID)
    assert np.isnan(np.delete(scan.ranges, 3)).all()
    assert np.isinf(scan.ranges[3])
    np.testing.assert_array_equal(scan.finite(), 10.0)


def test_the_papers_counts_give_the_figures_under_their_right_names():
    assert PAPER.accuracy == pytest.approx(0.793, abs=5e-4)
    assert PAPER.precision == pytest.approx(0.806, abs=5e-4)
    assert PAPER.recall == pytest.approx(0.618, abs=5e-4)
    assert PAPER.specificity == pytest.approx(0.905, abs=5e-4)
    assert PAPER.balanced_accuracy == pytest.approx(0.762, abs=5e-4)
    assert PAPER.f1_red == pytest.approx(0.700, abs=5e-4)
    assert PAPER.iou_red == pytest.approx(0.538, abs=5e-4)


def test_empty_cells_are_not_scored():
    truth = np.array([0, 1, 2, 2, 1], dtype=np.uint8)
    called = np.array([2, 1, 2, 1, 2], dtype=np.uint8)
    assert CellScores.of(truth, called) == CellScores(tp=1, tn=1, fp=1, fn=1)


def test_a_range_is_wrong_when_it_is_off_by_more_than_a_ring():
    truth = np.full((4, GRID.n_rings), CellState.TRAVERSABLE, dtype=np.uint8)
    truth[:, 5] = CellState.NON_TRAVERSABLE
    found = np.full_like(truth, CellState.TRAVERSABLE)
    for sector, ring in enumerate((5, 6, 7, 3)):
        found[sector, ring] = CellState.NON_TRAVERSABLE
    assert range_errors(truth, found, GRID) == {"too_long": 0.25, "too_short": 0.25}


def test_cells_near_the_limits_are_in_doubt():
    points = np.concatenate([cell_points(100, sector=s) for s in (2, 3, 4, 5)])
    severity = np.repeat([-5.0, -0.5, 0.5, 5.0], 100).astype(np.float32)
    cloud = PointCloud(points, severity=severity, nontraversable=severity > 0)
    clear = beyond_doubt(cloud, GRID)[[2, 3, 4, 5], 5]
    np.testing.assert_array_equal(clear, [True, False, False, True])
