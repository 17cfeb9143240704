"""The features: known answers, and the compiled kernels against plain numpy."""

import numpy as np
import pytest

from tests.support import plain_perception
from tests.support.polar_clouds import flat, rough_ground
from traversability.features import ALL_FEATURES, OWN_FEATURES, cell_features
from traversability.grid import PolarGrid

GRID = PolarGrid()
PAPER_CUT = PolarGrid(cut="base")
COLUMN = {name: k for k, name in enumerate(ALL_FEATURES)}


@pytest.mark.parametrize("grid", [GRID, PAPER_CUT, PolarGrid(n_sectors=64), PolarGrid(n_rings=7)])
@pytest.mark.parametrize("n", [400, 20_000])
def test_kernels_equal_numpy(grid, n):
    """Values and counts are those of the slow reference, on several grids."""
    points = rough_ground(n, seed=n)
    found = cell_features(points, grid)
    values, counts = plain_perception.describe(points, grid)
    np.testing.assert_array_equal(found.counts, counts)
    known = counts >= 5
    np.testing.assert_allclose(found.values[known], values[known], atol=1e-5)


def test_a_flat_plane_has_roughness_zero_and_orientation_one():
    """Level ground has a vertical normal, and no slope, step or bend."""
    found = cell_features(flat(), GRID)
    values = found.values[found.counts >= 5]
    for name, expected in (
        ("roughness", 0.0),
        ("orientation", 1.0),
        ("min_height", -0.1),
        ("height_difference", 0.0),
        ("slope_max", 0.0),
        ("step_max", 0.0),
        ("tilt", 0.0),
        ("bend", 0.0),
        ("rise_before", 0.0),
    ):
        np.testing.assert_allclose(values[:, COLUMN[name]], expected, atol=2e-6, err_msg=name)


def test_a_plane_of_20_degrees_has_that_slope_and_no_step():
    """The largest slope is that of the plane."""
    points = flat(n=60_000)
    points[:, 2] = np.tan(np.deg2rad(20.0)) * points[:, 0]
    found = cell_features(points, GRID)
    values = found.values[found.counts >= 20]
    slopes = np.rad2deg(np.arctan(values[:, COLUMN["slope_max"]]))
    assert np.quantile(np.abs(slopes - 20.0), 0.95) < 0.5
    assert np.quantile(values[:, COLUMN["step_max"]], 0.95) < 0.01


def test_a_wall_has_orientation_zero():
    """Its normal is level, its height difference that of the wall."""
    rng = np.random.default_rng(0)
    points = np.column_stack(
        [np.full(500, 3.0), rng.uniform(-0.2, 0.2, 500), rng.uniform(0, 1.2, 500)]
    )
    found = cell_features(points.astype(np.float32), GRID)
    known = found.counts >= 5
    np.testing.assert_allclose(found.values[known][:, 1], 0.0, atol=1e-4)
    assert found.values[known][:, COLUMN["height_difference"]].min() > 1.0


def test_a_drop_shows_as_a_gap_behind_its_edge():
    """The cell before the edge has a gap, other cells have none."""
    points = flat(0.0, 60_000)
    edge, height = 3.0, 0.72
    beyond = points[:, 0] > edge
    shadow = edge * height / (height - 0.3)  # Where the beam over the edge meets ground 0.3 m down.
    points = points[~(beyond & (points[:, 0] < shadow))]
    gap = cell_features(points, GRID).values[..., COLUMN["gap_after_mean"]]
    before_edge = gap[16, np.searchsorted(GRID.ring_edges, edge) - 1]
    assert before_edge > 0.25
    assert gap[0, 4:9].max() < 0.1


def test_a_low_rock_on_a_slope_is_a_bump_and_the_slope_is_none():
    """A rock of 7 cm is a bump as high, with its points, in its cell alone."""
    points = flat(0.0, 120_000)
    points[:, 2] = np.tan(np.deg2rad(12.0)) * points[:, 0]
    on_rock = (np.abs(points[:, 0] - 2.0) < 0.07) & (np.abs(points[:, 1] - 0.2) < 0.07)
    plain = cell_features(points, GRID).values
    points[on_rock, 2] += 0.07
    values = cell_features(points, GRID).values
    cell = (16, int(np.searchsorted(GRID.ring_edges, 2.0)) - 1)
    assert plain[..., COLUMN["bump"]].max() < 0.01
    assert 0.05 < values[cell][COLUMN["bump_third"]] <= values[cell][COLUMN["bump"]] < 0.075
    assert values[cell][COLUMN["bump_points"]] == on_rock.sum()
    assert np.count_nonzero(values[..., COLUMN["bump_points"]]) == 1


def test_the_ground_of_a_slope_is_not_cut_away_and_a_crown_is():
    """Counts are those without the crown."""
    points = flat(0.0, 40_000)
    points[:, 2] = np.tan(np.deg2rad(20.0)) * points[:, 0]
    crown = points[:4000] + np.float32([0, 0, 2.0])
    both = np.concatenate([points, crown])
    ahead = slice(12, 20)
    kept, alone = (cell_features(cloud, GRID).counts[ahead] for cloud in (both, points))
    np.testing.assert_array_equal(kept, alone)
    assert (alone > 0).all()
    assert (cell_features(points, PAPER_CUT).counts[ahead, -1] == 0).all()


def test_own_features_do_not_change_when_the_robot_turns_by_a_sector():
    """The cells move on by one sector."""
    points = rough_ground(seed=1)
    angle = 2 * np.pi / GRID.n_sectors
    c, s = np.cos(angle), np.sin(angle)
    turned = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]], dtype=np.float32)
    before, after = cell_features(points, GRID), cell_features(turned.astype(np.float32), GRID)
    same = np.roll(before.counts, 1, axis=0) == after.counts
    assert same.mean() > 0.97  # Rounding moves points over edges here and there.
    own = slice(0, len(OWN_FEATURES))
    difference = np.abs(np.roll(before.values, 1, axis=0) - after.values)[same][:, own]
    assert np.quantile(difference, 0.95) < 1e-4


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e30, -1e30])
def test_points_that_are_no_measurement_are_left_out(bad):
    """A cloud with bad points equals the one without."""
    points = rough_ground(4000)
    for column in range(3):
        spoilt = points.copy()
        spoilt[::7, column] = bad
        found = cell_features(spoilt, GRID)
        expected = cell_features(np.delete(points, np.s_[::7], axis=0), GRID)
        np.testing.assert_array_equal(found.counts, expected.counts)
        np.testing.assert_array_equal(found.values, expected.values)


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.zeros((7, 3)), np.full((50, 3), 2.0)])
def test_no_points_and_one_place_give_finite_features(points):
    """Neither divides by zero."""
    found = cell_features(points.astype(np.float32), GRID)
    assert np.isfinite(found.values).all()
    assert found.counts.sum() == (50 if len(points) == 50 else 0)


def test_the_input_is_not_changed_and_its_shape_and_type_are_checked():
    """Errors name shape and type."""
    points = rough_ground(1000)
    copy = points.copy()
    cell_features(points, GRID)
    np.testing.assert_array_equal(points, copy)
    with pytest.raises(ValueError, match=r"expected float32 of shape \(n, 3\), got float32 \("):
        cell_features(points[:, :2], GRID)
    with pytest.raises(ValueError, match=r"float64"):
        cell_features(points.astype(np.float64), GRID)


def test_neighbours_features_come_from_the_side_of_their_name():
    """Sector 16 begins ahead: its left neighbour is 17; before is inwards, after is outwards."""
    values = cell_features(rough_ground(), GRID).values
    counts = cell_features(rough_ground(), GRID).counts
    assert (counts[15:19, 3:8] >= 3).all()
    own = values[..., COLUMN["height_difference"]]
    for name, ring in (("two_before", 3), ("before", 4), ("after", 6), ("two_after", 7)):
        assert values[16, 5, COLUMN[f"{name}:height_difference"]] == own[16, ring]
    for name, ring in (("", 5), ("before_", 4), ("after_", 6)):
        sides = own[[15, 17], ring]
        assert values[16, 5, COLUMN[f"{name}sides_low:height_difference"]] == sides.min()
        assert values[16, 5, COLUMN[f"{name}sides_high:height_difference"]] == sides.max()
    next_sides = values[16, 5, COLUMN["next_sides_high:height_difference"]]
    assert next_sides == own[[14, 18], 5].max()
