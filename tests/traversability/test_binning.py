"""Quarters: every point in the right one, against the arc tangent, and sums by hand."""

import numpy as np
import pytest

from tests.support import plain_perception
from tests.support.polar_clouds import flat
from traversability.binning import (
    COUNT,
    FURTHEST,
    HIGHEST,
    LOWEST,
    NEAREST,
    XY,
    YZ,
    ZZ,
    fill_quarters,
    make_quarters,
    polar_tables,
)
from traversability.grid import PolarGrid

GRID = PolarGrid()


@pytest.mark.parametrize(
    "grid",
    [
        GRID,
        PolarGrid(n_sectors=7, n_rings=3),
        PolarGrid(n_sectors=128),
        # First rings narrower than a bin of squared distance would be with as few as of the others.
        PolarGrid(n_rings=40, inner_radius=0.2),
    ],
)
def test_quarters_are_those_of_the_arc_tangent(grid):
    """The tables give what bearing and distance give, for every point of 300,000."""
    points = np.random.default_rng(1).uniform(-11, 11, (300_000, 3)).astype(np.float32)
    quarters = fill_quarters(points, grid.model_copy(update={"max_height": 1e3}))
    sector, ring = plain_perception.bin_points(points, grid)
    expected = np.where(sector >= 0, sector * 2 * grid.n_rings + ring, -1)
    np.testing.assert_array_equal(quarters.bins[: len(points)], expected)


def test_points_on_the_axes_fall_into_the_sector_that_begins_there():
    """Ahead, to the left and to the right: sectors 16, 24 and 8 of 32."""
    points = np.array([[2, 0, 0], [0, 2, 0], [0, -2, 0]], dtype=np.float32)
    bins = fill_quarters(points, GRID).bins[:3]
    np.testing.assert_array_equal(bins // (2 * GRID.n_rings), [32, 48, 16])


@pytest.mark.parametrize(("bearing_deg", "sector"), [(-170, 0), (-100, 7), (-10, 15), (10, 16)])
@pytest.mark.parametrize("side", [1, -1])
def test_sectors_go_counter_clockwise_from_behind(bearing_deg, sector, side):
    """The mirrored point lies in the mirrored sector."""
    bearing = side * np.deg2rad(bearing_deg)
    points = np.array([[2 * np.cos(bearing), 2 * np.sin(bearing), 0]], dtype=np.float32)
    found = fill_quarters(points, GRID).bins[0] // (4 * GRID.n_rings)
    assert found == (sector if side > 0 else 31 - sector)


def test_tables_are_computed_once_per_grid():
    """Equal grids share their tables."""
    assert polar_tables(GRID) is polar_tables(PolarGrid())


def test_ring_edges_belong_to_the_ring_that_begins_there():
    """A point on the inner edge counts, one on the outer edge does not."""
    grid = PolarGrid(inner_radius=1.0, outer_radius=4.0, n_rings=1)  # Half rings at 1, 2 and 4 m.
    points = np.zeros((5, 3), dtype=np.float32)
    points[:, 0] = 0.999, 1.0, 2.0, 3.999, 4.0
    bins = fill_quarters(points, grid).bins[:5]
    assert np.where(bins < 0, -1, bins % 2).tolist() == [-1, 0, 1, 1, -1]


def test_sums_are_those_of_the_points_of_a_quarter():
    """Count, products and extents of two points, by hand."""
    points = np.array([[2.0, 0.0625, 0.5], [2.0, 0.125, -0.25]], dtype=np.float32)
    quarters = fill_quarters(points, GRID)
    assert quarters.bins[0] == quarters.bins[1]
    own = quarters.sums.reshape(-1, 14)[quarters.bins[0]]
    assert own[COUNT] == 2
    assert own[[XY, YZ, ZZ]].tolist() == [0.375, 0.0, 0.3125]
    assert own[[LOWEST, HIGHEST]].tolist() == [-0.25, 0.5]
    assert own[[NEAREST, FURTHEST]].tolist() == [4.00390625, 4.015625]
    assert quarters.sums[..., COUNT].sum() == 2


@pytest.mark.parametrize("side", [1, -1])
def test_heights_from_a_kilometre_on_are_no_measurement(side):
    """Such a point is on no quarter, whatever the cut; one just under is."""
    points = np.array([[2.0, 0.1, side * 999.0], [2.0, 0.1, side * 1001.0]], dtype=np.float32)
    quarters = fill_quarters(points, PolarGrid(max_height=1e4))
    assert (quarters.bins[:2] >= 0).tolist() == [True, False]


@pytest.mark.parametrize(("cut", "kept"), [("base", 1), ("ground", 2)])
def test_heights_are_cut_over_the_base_or_over_the_ground(cut, kept):
    """On ground 0.3 m up, a point at 1.4 m is above the base's cut and below the ground's."""
    points = np.array([[2.0, 0.1, 0.3], [2.0, 0.1, 1.4], [2.0, 0.1, 1.6]], dtype=np.float32)
    quarters = fill_quarters(points, PolarGrid(cut=cut))
    assert (quarters.bins[:3] >= 0).sum() == kept
    assert quarters.sums[..., COUNT].sum() == kept


def test_points_above_the_cut_leave_nothing_in_the_sums():
    """Sums are those of the points below the cut alone, to the last bit."""
    points = flat(0.1)
    points[::7, 2] += np.float32(1.5)
    found = fill_quarters(points, GRID)
    below = fill_quarters(points[points[:, 2] < 1.3], GRID)
    np.testing.assert_array_equal(found.sums, below.sums)
    assert (found.bins[: len(points) : 7] == -1).all()


def test_straight_behind_is_in_the_last_sector():
    """A bearing of pi exactly lies beyond no edge."""
    points = np.array([[-2, 0, 0], [-2, -1e-3, 0]], dtype=np.float32)
    assert (fill_quarters(points, GRID).bins[:2] // (2 * GRID.n_rings)).tolist() == [63, 0]


@pytest.mark.parametrize("count", [0, 1, 513])
def test_points_column_by_column_are_not_copied(count):
    """Any number of them gives what they give row by row."""
    points = np.random.default_rng(2).uniform(-9, 9, (count, 3)).astype(np.float32)
    columns = np.ascontiguousarray(points.T)
    found, expected = fill_quarters(columns.T, GRID), fill_quarters(points, GRID)
    assert count == 0 or np.shares_memory(found.columns, columns)
    np.testing.assert_array_equal(found.bins[:count], expected.bins[:count])
    np.testing.assert_array_equal(found.sums, expected.sums)


def test_the_ground_is_followed_along_its_slope():
    """A bank of 20 degrees is ground as far as the last ring."""
    points = flat(0.0)
    points[:, 2] = np.tan(np.deg2rad(20)) * np.hypot(points[:, 0], points[:, 1])
    inside = np.hypot(points[:, 0], points[:, 1]).astype(np.float64)
    quarters = fill_quarters(points, GRID)
    expected = (inside > 0.61) & (inside < 9.99)
    assert (quarters.bins[: len(points)][expected] >= 0).all()


def test_memory_is_used_again_and_forgets():
    """A short cloud after a long one gives what it gives alone, in the same arrays."""
    memory = fill_quarters(flat(), GRID, make_quarters(GRID, 20_000))
    short = flat(0.2, 50)
    again, fresh = fill_quarters(short, GRID, memory), fill_quarters(short, GRID)
    assert again.sums is memory.sums
    np.testing.assert_array_equal(again.sums, fresh.sums)
    np.testing.assert_array_equal(again.bins[:50], fresh.bins[:50])
