"""Planes around quarters: known answers on planes, with a post, a pit and something far away."""

import numpy as np
import pytest

from traversability.binning import (
    COUNT,
    FURTHEST,
    HIGHEST,
    LOWEST,
    NEAREST,
    X,
    Y,
    Z,
    polar_tables,
)
from traversability.cells import columns
from traversability.cells.quarter_planes import (
    GRADIENT_X,
    GRADIENT_Y,
    HIGH,
    LEVEL,
    LOW,
    MEAN_X,
    MEAN_Y,
    MEAN_Z,
    WEIGHT,
    ground_shape,
    mean_points,
)
from traversability.grid import PolarGrid

GRID = PolarGrid()
TABLES = polar_tables(GRID)
SECTOR, RING = 5, 6


def level_sums(a=0.0, b=0.0, c=0.0, points=8):
    """Return sums of quarters full of points at their middles on the plane z = a x + b y + c."""
    n, m = 2 * GRID.n_sectors, 2 * GRID.n_rings
    bearings = -np.pi + (np.arange(n) + 0.5) * 2 * np.pi / n
    r = np.broadcast_to(TABLES.halves, (n, m))
    x, y = r * np.cos(bearings)[:, None], r * np.sin(bearings)[:, None]
    z = a * x + b * y + c
    sums = np.zeros((n, m, 14))
    sums[..., COUNT] = points
    for column, value in ((X, x), (Y, y), (Z, z)):
        sums[..., column] = points * value
    sums[..., LOWEST] = sums[..., HIGHEST] = z
    sums[..., NEAREST] = sums[..., FURTHEST] = r * r
    return sums


def lift(sums, i, j, by):
    """Raise all points of a quarter."""
    sums[i, j, Z] += by * sums[i, j, COUNT]
    sums[i, j, [LOWEST, HIGHEST]] += by


def shape(sums, sector=SECTOR, ring=RING):
    """Return the features of a cell and the planes around its quarters."""
    means = np.zeros((*sums.shape[:2], 6))
    planes = np.full((*sums.shape[:2], 3), np.nan)
    mean_points(sums, means)
    out = np.full(44, np.nan, dtype=np.float32)
    ground_shape(sums, means, planes, sector, ring, TABLES.middles, out)
    i, j = 2 * sector, 2 * ring
    return out, planes[i : i + 2, j : j + 2]


def test_a_quarters_mean_has_the_weight_of_its_points_up_to_four():
    """Two points weigh two, eight as much as four; a quarter without points stays as it was."""
    sums = np.zeros((2, 2, 14))
    sums[0, 0, [COUNT, X, Y, Z, LOWEST, HIGHEST]] = 2, 4.0, 2.0, 0.6, 0.2, 0.4
    sums[1, 1, [COUNT, X, Y, Z, LOWEST, HIGHEST]] = 8, 8.0, -8.0, 0.8, -0.1, 0.3
    means = np.full((2, 2, 6), 7.0)
    mean_points(sums, means)
    order = [WEIGHT, MEAN_X, MEAN_Y, MEAN_Z, LOW, HIGH]
    assert means[0, 0][order].tolist() == pytest.approx([2, 2.0, 1.0, 0.3, 0.2, 0.4])
    assert means[1, 1][order].tolist() == pytest.approx([4, 1.0, -1.0, 0.1, -0.1, 0.3])
    assert means[0, 1].tolist() == [0.0, *[7.0] * 5]


@pytest.mark.parametrize(("a", "b"), [(0.0, 0.0), (0.2, 0.0), (0.0, -0.3), (0.2, 0.1)])
def test_on_a_plane_slope_and_level_are_the_planes(a, b):
    """Nothing is above or below it; the level at the origin is the plane's own there."""
    found, planes = shape(level_sums(a, b, 0.7))
    steepness = np.hypot(a, b)
    for column in (columns.SLOPE_MAX, columns.SLOPE_MEAN):
        assert found[column] == pytest.approx(steepness, rel=0.1, abs=1e-6)
    np.testing.assert_allclose(planes[..., GRADIENT_X], a, rtol=0.1, atol=5e-3)
    np.testing.assert_allclose(planes[..., GRADIENT_Y], b, rtol=0.1, atol=5e-3)
    np.testing.assert_allclose(planes[..., LEVEL], 0.7, atol=0.15 * steepness + 1e-9)
    for column in (columns.STEP_MAX, columns.ABOVE_PLANE, columns.BELOW_PLANE):
        assert found[column] == pytest.approx(0.0, abs=0.1 * steepness * 0.5 + 1e-6)


def test_one_raised_quarter_is_a_step_for_all_four_and_above_its_own_plane():
    """0.2 m: the step is most of it, the second largest hardly less; other cells see none."""
    sums = level_sums()
    lift(sums, 2 * SECTOR, 2 * RING, 0.2)
    found, _ = shape(sums)
    assert 0.15 < found[columns.STEP_SECOND] <= found[columns.STEP_MAX] < 0.25
    assert 0.1 < found[columns.ABOVE_PLANE] < 0.2
    assert found[columns.HIGHEST_AROUND] == pytest.approx(0.2)
    assert found[columns.LOWEST_AROUND] == pytest.approx(0.2)
    far, _ = shape(sums, SECTOR + 3, RING)
    assert far[columns.STEP_MAX] == far[columns.HIGHEST_AROUND] == 0.0


def test_a_pit_is_below_its_plane():
    """0.2 m deep: what is around rises as high over it."""
    sums = level_sums()
    lift(sums, 2 * SECTOR + 1, 2 * RING + 1, -0.2)
    found, _ = shape(sums)
    assert 0.1 < found[columns.BELOW_PLANE] < 0.2
    assert found[columns.HIGHEST_AROUND] == pytest.approx(0.2)
    assert found[columns.LOWEST_AROUND] == pytest.approx(0.2)


def test_the_worst_and_the_mean_of_four_quarters():
    """Three quarters without points leave the one: both are its own."""
    sums = level_sums(0.2, 0.0)
    for i, j in ((0, 1), (1, 0), (1, 1)):
        sums[2 * SECTOR + i, 2 * RING + j, COUNT] = 0
    found, planes = shape(sums)
    assert found[columns.SLOPE_MAX] == pytest.approx(found[columns.SLOPE_MEAN])
    assert found[columns.STEP_MAX] == pytest.approx(found[columns.STEP_MEAN])
    assert found[columns.STEP_SECOND] == 0.0
    assert np.isnan(planes[..., LEVEL]).tolist() == [[False, True], [True, True]]


def test_sectors_are_a_circle():
    """The first sector's window goes on in the last one's."""
    sums = level_sums()
    lift(sums, -1, 2 * RING, 0.3)
    found, _ = shape(sums, 0)
    assert found[columns.HIGHEST_AROUND] == pytest.approx(0.3)


def test_only_quarters_within_reach_belong_to_the_plane():
    """Outwards all that begin within 0.3 m of the own one, and one more."""
    ring, reach = 1, 0.3
    own = TABLES.halves[2 * ring + 1]
    for j in range(2 * ring + 2, 2 * GRID.n_rings):
        sums = level_sums()
        lift(sums, 2 * SECTOR, j, 0.3)
        found, _ = shape(sums, SECTOR, ring)
        assert (found[columns.HIGHEST_AROUND] > 0) == (TABLES.halves[j - 1] < own + reach), j


@pytest.mark.parametrize(("ring", "reach"), [(GRID.n_rings - 1, 1), (2, 2)])
def test_sideways_a_plane_reaches_to_the_next_column_or_further_where_they_are_narrow(ring, reach):
    """At 9 m a column is wider than the reach, at 1.2 m two of them are within it."""
    for step in range(1, 5):
        sums = level_sums()
        lift(sums, 2 * SECTOR + 1 + step, 2 * ring + 1, 0.3)
        found, _ = shape(sums, SECTOR, ring)
        assert (found[columns.HIGHEST_AROUND] > 0) == (step <= reach), step


def test_the_outermost_ring_has_planes():
    """Nothing lies behind it."""
    found, _ = shape(level_sums(0.2, 0.1, 0.7), ring=GRID.n_rings - 1)
    assert found[columns.SLOPE_MEAN] == pytest.approx(np.hypot(0.2, 0.1), rel=0.1)


def test_a_cell_smaller_than_the_reach_fits_two_of_its_planes():
    """Opposite corners are computed; the two others have a copy of the plane before."""
    small = int(np.flatnonzero(TABLES.middles * 2 * np.pi / GRID.n_sectors < 0.3)[0])
    sums = level_sums(0.2, 0.1)
    _, planes = shape(sums, SECTOR, small)
    np.testing.assert_array_equal(planes[0, 1], planes[0, 0])
    np.testing.assert_array_equal(planes[1, 0], planes[0, 0])
    large = int(np.flatnonzero(TABLES.middles * 2 * np.pi / GRID.n_sectors > 0.4)[0])
    _, planes = shape(sums, SECTOR, large)
    assert len({tuple(plane) for plane in planes.reshape(-1, 3).tolist()}) == 4
