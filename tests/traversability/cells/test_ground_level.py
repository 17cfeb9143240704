"""The local ground: it is the ground on slopes, and stays under plants near ground that is seen."""

import numpy as np
import pytest

from tests.support.polar_clouds import flat
from traversability.binning import COUNT, X, Y, fill_quarters, polar_tables
from traversability.cells.columns import make_workspace
from traversability.cells.ground_level import MAX_GRADE
from traversability.cells.shape import describe_cells
from traversability.features import OWN_FEATURES
from traversability.grid import PolarGrid

GRID = PolarGrid()


def ground_under(points):
    """Return places and levels of the quarters with enough points, and the scatter of each."""
    quarters = fill_quarters(points.astype(np.float32), GRID)
    tables, cells = polar_tables(GRID), make_workspace(GRID, len(OWN_FEATURES))
    describe_cells(quarters, tables.middles, tables.halves, 0.15, cells)
    n = quarters.sums[..., COUNT]
    known = n >= 8
    x, y = quarters.sums[known][:, X] / n[known], quarters.sums[known][:, Y] / n[known]
    return np.column_stack([x, y]), cells.levels[known], cells.scatter[known]


@pytest.mark.parametrize("grade", [0.0, 0.1, 0.25])
def test_on_a_plane_the_ground_is_the_plane(grade):
    """Up to the steepest grade of the cones nothing lies over the ground, and nothing scatters."""
    points = flat(0.0, 100_000).astype(float)
    points[:, 2] = grade * points[:, 0]
    places, levels, scatter = ground_under(points)
    near = np.hypot(*places.T) < 7
    np.testing.assert_allclose(levels[near], grade * places[near, 0], atol=0.02)
    assert scatter[near].max() < 0.02


def test_noise_is_scatter_and_lowers_the_ground_by_no_more_than_its_spread():
    """With 3 cm of noise the ground lies 3 to 6 cm under the mean, however many the points."""
    rng = np.random.default_rng(0)
    points = flat(0.0, 200_000).astype(float)
    points[:, 2] += rng.normal(0, 0.03, len(points))
    places, levels, scatter = ground_under(points)
    middle = (np.hypot(*places.T) > 2) & (np.hypot(*places.T) < 7)
    assert np.median(scatter[middle]) == pytest.approx(0.03, abs=0.004)
    assert -0.06 < np.median(levels[middle]) < -0.03


def test_under_plants_the_ground_is_that_before_them():
    """A dense field 0.5 m high hides its ground; the ground under its edge is known all the same.

    It rises by no more than the grade of the cones from the last ground that is seen.
    """
    points = flat(0.0, 100_000).astype(float)
    field = points[:, 0] > 3.0
    points[field, 2] = 0.5
    places, levels, _ = ground_under(points)
    ahead = (np.abs(places[:, 1]) < 1.0) & (places[:, 0] > 3.4)
    bound = MAX_GRADE * 1.5 * (places[ahead, 0] - 2.8)
    assert (levels[ahead] <= np.minimum(bound, 0.5) + 1e-6).all()
    beside = ahead & (places[:, 0] < 3.9)
    assert beside.any()
    assert (levels[beside] < 0.3).all()


def test_a_drop_lowers_the_ground_before_it_no_further_than_the_cones_reach():
    """Half a metre of depth is felt 1.7 m away and no further."""
    points = flat(0.0, 100_000).astype(float)
    points[points[:, 0] > 4.0, 2] = -0.5
    places, levels, _ = ground_under(points)
    far, near = places[:, 0] < 4.0 - 0.5 / MAX_GRADE - 0.5, np.abs(places[:, 0] - 3.7) < 0.25
    np.testing.assert_allclose(levels[far], 0.0, atol=1e-6)
    assert (levels[near & (np.abs(places[:, 1]) < 1)] < -0.2).all()


def test_ground_steeper_than_17_degrees_stands_above_itself_by_the_rest():
    """From the innermost ground that is seen on, uphill, the ground rises by 0.3 m in a metre."""
    points = flat(0.0, 100_000).astype(float)
    points[:, 2] = 0.5 * points[:, 0]
    places, levels, _ = ground_under(points)
    ahead = (np.abs(places[:, 1]) < 0.8) & (places[:, 0] > 2) & (places[:, 0] < 6)
    rises = np.polyfit(places[ahead, 0], levels[ahead], 1)[0]
    assert rises == pytest.approx(0.3, abs=0.03)
    assert MAX_GRADE == 0.3
