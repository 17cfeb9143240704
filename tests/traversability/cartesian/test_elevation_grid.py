"""The elevation grid: ground, objects on it and no crowns, in cells with known answers."""

import numpy as np
import pytest

from tests.support.ground_cell_clouds import HERE, flat, sheet
from traversability.cartesian.elevation_grid import HIGHEST, LOWEST, MEAN, POINTS, ElevationGrid


def described(points, here=HERE, stamps=None, **sizes):
    """Return the elevation grid of a list of points, with the age that each has at time 0."""
    elevation = ElevationGrid(**sizes)
    elevation.describe(np.asarray(points, dtype=np.float32), np.asarray(here, float), stamps)
    return elevation


def test_a_cell_holds_its_ground_and_objects_on_it_and_no_crown():
    """Of four points above each other, two are ground, three below the crown."""
    points = np.array(
        [[0.05, 0.05, 1.0], [0.02, 0.08, 1.2], [0.07, 0.01, 1.9], [0.05, 0.05, 4.0]], np.float32
    )
    elevation = ElevationGrid()
    elevation.describe(points, HERE)
    own = elevation.table[0, 0]
    assert own[LOWEST] == np.float32(1.0)
    assert own[POINTS] == 2
    assert own[MEAN] == pytest.approx(1.1)
    assert own[HIGHEST] == np.float32(1.9)


def test_a_cell_is_stored_at_its_remainders():
    """A point left of and below the origin is found in the last row and column."""
    elevation = described([[-0.05, -0.15, 0.3]])
    assert np.argwhere(elevation.table[:, :, POINTS] > 0).tolist() == [[255, 254]]
    assert described([[25.65, 0.05, 0.3]], here=[25.6, 0.0]).table[0, 0, POINTS] == 1


def test_the_window_ends_two_cells_before_half_of_the_grid():
    """Points are taken while they lie less than n / 2 - 1 cells from the robot's cell."""
    inside = described([[1.39, 0.0, 0.0], [-1.39, 0.0, 0.0]], cell=0.1, cells=32)
    outside = described([[1.51, 0.0, 0.0], [0.0, -1.51, 0.0]], cell=0.1, cells=32)
    assert inside.table[:, :, POINTS].sum() == 2
    assert outside.table[:, :, POINTS].sum() == 0


@pytest.mark.parametrize(
    ("height", "in_ground", "in_highest"),
    [(0.24, True, True), (0.26, False, True), (1.19, False, True), (1.21, False, False)],
)
def test_the_ground_ends_at_25_cm_and_objects_at_120(height, in_ground, in_highest):
    """Heights are counted from the lowest point of the cell."""
    own = described([[0.05, 0.05, -2.0], [0.05, 0.05, height - 2.0]]).table[0, 0]
    assert own[POINTS] == 1 + in_ground
    assert own[MEAN] == pytest.approx(-2.0 + in_ground * height / 2)
    assert own[HIGHEST] == pytest.approx(height - 2.0 if in_highest else -2.0)


def test_the_age_of_a_cell_is_that_of_its_newest_point():
    """Crowns do not count, and cells without points are infinitely old."""
    points = [[0.05, 0.05, 0.0], [0.05, 0.05, 0.1], [0.05, 0.05, 3.0], [1.05, 0.05, 0.0]]
    elevation = described(points, stamps=-np.array([3.0, 2.0, 1.0, 5.0]))
    assert elevation.ages[0, 0] == 2.0
    assert elevation.ages[10, 0] == 5.0
    assert np.isinf(elevation.ages[5, 5])


@pytest.mark.parametrize(("cells_away", "known"), [(8, False), (9, True)])
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("side", [-1, 1])
def test_a_crown_is_left_out_where_ground_lies_within_eight_cells(cells_away, known, axis, side):
    """Farther ground shows nothing: the surface may be a terrace."""
    ground = np.array([0.05, 0.05, 0.0])
    ground[axis] += side * 0.1 * cells_away
    elevation = described([[0.05, 0.05, 1.3], ground])
    assert (elevation.table[0, 0, POINTS] > 0) == known


def test_a_cloud_replaces_the_one_before():
    """Nothing is remembered: a second description equals a fresh one."""
    ground = sheet(flat, half=3.0, spacing=0.05)
    elevation = described(ground)
    elevation.describe(ground[:500], np.array([1.0, 2.0]))
    fresh = described(ground[:500], here=[1.0, 2.0])
    np.testing.assert_array_equal(elevation.table, fresh.table)
    np.testing.assert_array_equal(elevation.ages, fresh.ages)
    np.testing.assert_array_equal(elevation.centre, [10, 20])
    assert elevation.table[:, :, LOWEST].min() == 0.0


def test_cells_that_were_hit_are_listed_once_crowns_too():
    """Points beyond the window and points that are no numbers hit none."""
    points = [[0.05, 0.05, 0.0], [0.05, 0.06, 0.1], [0.55, 0.05, 4.0], [99.0, 0.0, 0.0]]
    elevation = described([*points, [np.nan, 0.0, 0.0], [0.0, 0.0, np.inf], [-0.05, 0.05, 0.0]])
    assert elevation.hit.tolist() == [[0, 0], [5, 0], [255, 0]]
    assert elevation.table[5, 0, POINTS] == 0
    assert described(np.empty((0, 3))).hit.tolist() == []


def test_points_fall_into_the_cell_that_division_says():
    """On the edges of cells and beside them, too."""
    edges = (np.arange(-120, 120) * 0.1).astype(np.float32)
    beside = [np.nextafter(edges, np.float32(side * np.inf)) for side in (-1, 1)]
    elevation = ElevationGrid()
    for x in np.concatenate([edges, *beside]):
        elevation.describe(np.array([[x, -x, 0.0]], dtype=np.float32), HERE)
        expected = np.floor(np.array([x, -x], dtype=np.float64) / elevation.cell).astype(int) % 256
        np.testing.assert_array_equal(elevation.hit, [expected])


@pytest.mark.parametrize("here", [[0.0, 0.0], [-7.3, 12.9]])
def test_crowns_are_those_of_a_plain_search(here):
    """A cell is one if a cell within eight, whose lowest point counts, lies 1.2 m below its own."""
    rng = np.random.default_rng(3)
    middle, half = np.append(here, 0.1), np.array([1.5, 1.5, 0.1])
    points = rng.uniform(middle - half, middle + half, (150, 3))
    points[::3, 2] += rng.uniform(0.9, 1.5, 50)
    elevation = described(points, here=here, cells=64)
    lowest = elevation.table[:, :, LOWEST]
    shifts = [(a, b) for a in range(-8, 9) for b in range(-8, 9)]
    floor = np.min([np.roll(lowest, shift, (0, 1)) for shift in shifts], axis=0)
    is_crown = np.isfinite(lowest) & (lowest > floor + np.float32(1.2))
    assert 5 < is_crown.sum() < np.isfinite(lowest).sum() - 5
    np.testing.assert_array_equal(
        elevation.table[:, :, POINTS] == 0, ~np.isfinite(lowest) | is_crown
    )
