"""Own features of cells: known answers."""

import numpy as np
import pytest

from tests.support.polar_clouds import flat, rough_ground
from traversability.binning import fill_quarters, polar_tables
from traversability.cells import columns
from traversability.cells.columns import MIN_DESCRIBED, make_workspace
from traversability.cells.shape import describe_cells
from traversability.features import OWN_FEATURES
from traversability.grid import PolarGrid

GRID = PolarGrid()


def test_columns_are_those_of_the_names():
    """Each constant is the place of its feature in ``OWN_FEATURES``."""
    for place, name in enumerate(OWN_FEATURES):
        assert getattr(columns, name.upper()) == place


def described(points, cells=None):
    """Return the workspace after a cloud, and the cells that are described."""
    cells = cells or make_workspace(GRID, len(OWN_FEATURES))
    quarters = fill_quarters(points, GRID)
    tables = polar_tables(GRID)
    describe_cells(quarters, tables.middles, tables.halves, 0.15, cells)
    return cells, cells.counts >= MIN_DESCRIBED


def test_cells_of_three_points_are_described_and_others_are_left_alone():
    """Three points make a plane, as far as the middle of their ring; two points have none."""
    cells = make_workspace(GRID, len(OWN_FEATURES))
    cells.values.fill(7.0)
    triangle = np.array([[2.0, 0.1, 0.0], [2.02, 0.1, 0.01], [2.0, 0.12, 0.0]])
    pair = np.array([[-2.0, 0.1, 0.0], [-2.02, 0.1, 0.01]])
    _, known = described(np.concatenate([triangle, pair]).astype(np.float32), cells)
    assert (known.sum(), cells.counts.sum()) == (1, 5)
    assert (cells.values[~known] == 7.0).all()
    assert cells.values[known][0, columns.HEIGHT_DIFFERENCE] == pytest.approx(0.01)
    ring = np.argwhere(known)[0, 1]
    middle = (GRID.ring_edges[ring] + GRID.ring_edges[ring + 1]) / 2
    assert cells.values[known][0, columns.DISTANCE] == pytest.approx(middle)


def test_a_workspace_that_was_used_before_gives_what_a_new_one_gives():
    """Nothing of the cloud before is left in a cell that is described."""
    used, _ = described(rough_ground())
    points = flat(0.2, 2_000)
    again, known = described(points, used)
    fresh, _ = described(points)
    np.testing.assert_array_equal(again.counts, fresh.counts)
    np.testing.assert_array_equal(again.values[known], fresh.values[known])


def test_a_slope_is_a_plane_around_every_quarter():
    """Steepness is that of the slope; no mean point lies off the plane, and no point is a bump."""
    points = flat(0.0, 60_000)
    points[:, 2] = 0.2 * points[:, 0] - 0.1 * points[:, 1]
    cells, known = described(points)
    near = np.zeros_like(known)
    near[:, 3:8] = known[:, 3:8]  # The outer rings have too few points, the inner ones are small.
    values = cells.values[near]
    steepness = np.hypot(0.2, 0.1)
    for column in (columns.TILT, columns.SLOPE_MAX, columns.SLOPE_MEAN):
        np.testing.assert_allclose(values[:, column], steepness, rtol=0.05)
    assert np.quantile(values[:, columns.STEP_MAX], 0.95) < 0.01
    assert cells.values[known][:, columns.BUMP].max() < 0.03
    assert not cells.values[known][:, columns.BUMP_POINTS].any()


@pytest.mark.parametrize(("run", "expected"), [(0.03, 0.01 / 0.03), (0.01, 0.01 / 0.02)])
def test_a_rise_is_height_over_the_distance_of_mean_points_from_2_cm_on(run, expected):
    """Two cells on both sides of a ring's edge, the outer one 1 cm higher."""
    edge = GRID.ring_edges[6]
    across = np.array([-0.001, 0.0, 0.001])
    inner, outer = (
        np.column_stack([np.full(3, edge + side * run / 2), 0.5 + across, np.full(3, height)])
        for side, height in ((-1, 0.0), (1, 0.01))
    )
    points = np.concatenate([inner, outer])
    points[:, 0] = np.sqrt(points[:, 0] ** 2 - points[:, 1] ** 2)  # At that distance.
    cells, known = described(points.astype(np.float32))
    assert np.argwhere(known)[:, 1].tolist() == [5, 6]
    before, after = cells.values[known]
    assert before[columns.RISE_AFTER] == pytest.approx(expected, rel=0.01)
    assert after[columns.RISE_BEFORE] == pytest.approx(expected, rel=0.01)
    assert before[columns.RISE_BEFORE] == after[columns.RISE_AFTER] == 0.0
