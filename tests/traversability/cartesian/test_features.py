"""Features of ground cells: planes and steps with known answers, and labels."""

import numpy as np
import pytest

from tests.support.ground_cell_clouds import (
    HERE,
    column,
    described,
    flat,
    sheet,
    trunk,
)
from traversability.cartesian.elevation_grid import ElevationGrid
from traversability.cartesian.features import (
    MAX_RANGE,
    MIN_RANGE,
    GroundFeatures,
    label_ground_cells,
)
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid


@pytest.mark.parametrize("slope", [0.0, 0.1, 0.36])
@pytest.mark.parametrize("heading", [0.0, 0.6, 2.2])
def test_a_plane_has_its_slope_and_nothing_beside_it(slope, heading):
    """Slope is that of the plane, roughness, step, rise and drop are 0."""
    c, s = np.cos(heading), np.sin(heading)
    _, values = described(sheet(lambda x, y: slope * (c * x + s * y)))
    for window in ("near", "around", "wide"):
        assert values[:, column(f"filled_{window}")] == pytest.approx(1.0)
        assert values[:, column(f"slope_{window}")] == pytest.approx(slope, abs=2e-3)
        for name in ("roughness", "step", "rise", "drop"):
            assert values[:, column(f"{name}_{window}")] == pytest.approx(0.0, abs=2e-3)
        # Points lie half their spacing short of the edges of elevation.
        short = 0.0125 * slope * (abs(c) + abs(s))
        assert values[:, column(f"peak_{window}")] == pytest.approx(-short, abs=2e-3)


def test_a_step_shows_where_the_windows_cross_it_alone():
    """A step of 0.2 m leaves a range beside the plane near it, and none elsewhere."""
    cells, values = described(sheet(lambda x, y: np.where(x > 2.0, 0.2, 0.0)))
    middle = 0.2 * cells[:, 0] + 0.1
    beside = np.abs(middle - 2.0) < 0.15
    # The plane tilts with the step: in six rows of elevation, half of them up, half of it is left.
    step = values[:, column("step_near")]
    assert (step[beside] > 0.08).all()
    assert (step[np.abs(middle - 2.0) > 0.4] < 2e-3).all()
    assert (values[np.abs(middle - 2.0) > 1.0, column("step_wide")] < 2e-3).all()


def test_a_kerb_is_a_ledge_along_its_edge_and_nowhere_else():
    """A step of 8 cm has its height in the cells that it crosses; level ground has none."""
    cells, values = described(sheet(lambda x, y: np.where(x > 2.1, 0.08, 0.0)))
    middle = 0.2 * cells + 0.1
    inside = np.abs(middle[:, 1]) < 1.5
    for name in ("ledge", "ledge_both"):
        heights = values[:, column(name)]
        assert heights[inside & (np.abs(middle[:, 0] - 2.1) < 0.05)] == pytest.approx(
            0.08, abs=5e-3
        )
        assert (heights[np.abs(middle[:, 0] - 2.1) > 1.0] == 0.0).all()


def test_a_trunk_stands_out_of_its_own_cells_alone():
    """Its cells have its height, those beside keep a level plane."""
    cells, values = described(np.concatenate([sheet(flat), trunk(2.1, 1.1)]))
    away = np.hypot(*(0.2 * cells + 0.1 - [2.1, 1.1]).T)
    spread, slope = values[:, column("spread")], values[:, column("slope_near")]
    assert spread[away < 0.05].min() > 1.0
    assert (spread[away > 0.3] == 0).all()
    assert (np.abs(slope[away > 0.3]) < 2e-3).all()  # Tall elevation tilt no plane.


def test_the_highest_point_stands_out_further_than_the_mean_of_its_cell():
    """A rock of a few centimetres is a few points, which the mean of a cell hides."""
    pebble = np.array([[2.05, 1.05, 0.06]], dtype=np.float32)
    cells, values = described(np.concatenate([sheet(flat), pebble]))
    row = values[(cells == [10, 5]).all(axis=1)][0]
    for window in ("near", "around", "wide"):
        assert row[column(f"peak_{window}")] == pytest.approx(0.06, abs=5e-3)
        assert row[column(f"rise_{window}")] < 0.01


def test_features_do_not_depend_on_position_and_height():
    """A shift by whole ground cells changes nothing, wherever the frame begins."""
    rng = np.random.default_rng(0)
    points = rng.uniform([-5, -5, 0], [5, 5, 0.3], (20_000, 3)).astype(np.float32)
    cells, values = described(points)
    shift = np.array([12.8, -3.2])
    shift_in_cells = np.round(shift / 0.2).astype(int)
    moved = points + np.array([*shift, 7.0], dtype=np.float32)
    others, same = described(moved, shift)
    lookup = {tuple(place): row for place, row in zip(cells + shift_in_cells, values, strict=True)}
    shared = [k for k, place in enumerate(others) if tuple(place) in lookup]
    assert len(shared) > 0.99 * len(cells)
    theirs = np.array([lookup[tuple(others[k])] for k in shared])
    # Rounding moves a few points across the edges of elevation.
    assert np.mean(np.abs(same[shared] - theirs) < 1e-3) > 0.98


def test_cells_are_described_as_far_as_the_polar_grid_goes():
    """Cells lie between the shortest and the longest range."""
    cells, _ = described(sheet(flat))
    ranges = np.hypot(*(0.2 * cells + 0.1).T)
    assert PolarGrid().outer_radius == MAX_RANGE
    assert ranges.max() == pytest.approx(MAX_RANGE, abs=0.2)
    assert len(cells) == pytest.approx(np.pi * (MAX_RANGE**2 - MIN_RANGE**2) / 0.04, rel=0.01)


def test_ground_without_points_has_no_cells_and_no_plane():
    """One point makes one cell, whose plane is unknown."""
    assert len(described(np.empty((0, 3), dtype=np.float32))[0]) == 0
    cells, values = described(np.array([[2.05, 0.05, 0.0]], dtype=np.float32))
    assert cells.tolist() == [[10, 0]]
    assert values[0, column("slope_near")] == -1
    assert described(np.array([[10.5, 0.0, 0.0]], dtype=np.float32))[0].size == 0


def test_points_that_are_no_numbers_are_left_out():
    """NaN and infinity change nothing."""
    good = sheet(flat)
    bad = np.concatenate([good, np.full((7, 3), np.nan, np.float32), [[np.inf, 0, 0]]])
    cells, values = described(bad.astype(np.float32))
    expected = described(good)
    assert np.array_equal(cells, expected[0])
    assert np.array_equal(values, expected[1])


def test_a_cell_is_marked_by_one_of_its_elevation_cells_and_by_no_crown():
    """A thin trunk marks its ground cell, and no other."""
    ground = sheet(flat, spacing=0.05)
    wood, crown = trunk(2.05, 1.05, radius=0.03), ground[::3] + np.float32([0, 0, 2.5])
    points = np.concatenate([ground, wood, crown])
    marked = np.repeat([False, True, True], [len(ground), len(wood), len(crown)])
    cells, _ = described(points)
    elevation = ElevationGrid()
    elevation.describe(points, HERE)
    found = label_ground_cells(PointCloud(points), marked, 0.15, elevation, cells)
    assert cells[found].tolist() == [[10, 5]]
    none = np.zeros(len(points), dtype=bool)
    assert not label_ground_cells(PointCloud(points), none, 0.15, elevation, cells).any()


@pytest.mark.parametrize(
    ("marked", "share", "expected"), [(4, 0.5, 0), (5, 0.5, 1), (1, 0.15, 0), (2, 0.15, 1)]
)
def test_an_elevation_cell_is_marked_from_its_share_of_points_on(marked, share, expected):
    """The share itself is enough, less is not."""
    points = np.tile(np.array([[2.05, 1.05, 0.0]], np.float32), (10, 1))
    elevation = ElevationGrid()
    elevation.describe(points, HERE)
    found = label_ground_cells(
        PointCloud(points), np.arange(10) < marked, share, elevation, np.array([[10, 5]])
    )
    assert found.tolist() == [bool(expected)]


def test_a_crown_without_ground_under_it_is_left_out():
    """A cell that only a crown fills, beside ground, is as if it had no points."""
    ground = sheet(flat)
    hole = (np.abs(ground[:, :2] - [2.0, 1.0]) < 0.3).all(axis=1)
    crown = ground[hole] + np.float32([0, 0, 2.5])
    beside, expected = described(np.concatenate([ground[~hole], crown])), described(ground[~hole])
    assert np.array_equal(beside[0], expected[0])
    assert np.array_equal(beside[1], expected[1])


def test_the_sign_and_axis_of_rise_and_drop_are_those_of_the_heights():
    """One raised elevation cell rises over the plane, one lowered cell drops below it."""
    ground = sheet(flat)
    for height, name in ((0.08, "rise_near"), (-0.08, "drop_near")):
        inside = (ground[:, 0] > 2.0) & (ground[:, 0] < 2.1) & (ground[:, 1] > 1.0)
        inside &= ground[:, 1] < 1.1
        bent = ground.copy()
        bent[inside, 2] = height
        cells, values = described(bent)
        row = values[(cells == [10, 5]).all(axis=1)][0]
        plane_takes = height / 36  # The near window has 36 cells; a little more by the tilt.
        assert row[column(name)] == pytest.approx(height - plane_takes, abs=0.006)


def test_the_spread_is_within_one_elevation_cell_and_the_height_within_all():
    """Two flat elevation cells at different heights have a height, and no spread."""
    points = np.array([[2.05, 1.05, 0.0], [2.15, 1.05, 0.3], [2.05, 1.15, 0.07]], np.float32)
    cells, values = described(points)
    row = values[(cells == [10, 5]).all(axis=1)][0]
    assert row[column("points")] == 3
    assert row[column("tiles")] == 3
    assert row[column("spread")] == 0
    assert row[column("height")] == pytest.approx(0.3)
    assert row[column("range")] == pytest.approx(np.hypot(2.1, 1.1))


@pytest.mark.parametrize(("count", "known"), [(4, False), (5, True)])
def test_a_plane_needs_five_flat_elevation_cells(count, known):
    """With four of them the slope is unknown, -1."""
    places = np.array([[0, 0], [1, 1], [0, 1], [1, 0], [2, 2]])[:count]
    points = np.column_stack([0.1 * places + [2.05, 1.05], np.zeros(count)]).astype(np.float32)
    cells, values = described(points)
    row = values[(cells == [10, 5]).all(axis=1)][0]
    assert (row[column("slope_near")] >= 0) == known
    assert row[column("filled_near")] == pytest.approx(count / 36)


def test_cells_are_due_by_the_age_of_their_newest_points():
    """The span holds its first age and not its last; neighbours come along, and are not due."""
    ground = sheet(flat, half=3.0, spacing=0.05)
    old = ground[:, 0] < 1.0
    elevation, features = ElevationGrid(), GroundFeatures()
    elevation.describe(ground, HERE, np.where(old, -2.0, -1.0))
    features.describe(elevation, HERE, (1.0, 2.0))
    x = 0.2 * features.cells[:, 0] + 0.1
    np.testing.assert_array_equal(features.due, x > 1.0)
    assert x.min() == pytest.approx(0.9)  # One row of neighbours.
    features.describe(elevation, HERE, (2.0, 3.0))
    np.testing.assert_array_equal(features.due, 0.2 * features.cells[:, 0] + 0.1 < 1.0)
