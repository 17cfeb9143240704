"""Heights over the ground: what plants, tufts and kerbs look like in the features."""

import numpy as np
import pytest

from tests.support.polar_clouds import flat
from traversability.binning import COUNT
from traversability.cells.columns import SCATTER, SCATTER_LEAST, SMOOTH_STEP, make_workspace
from traversability.cells.heights import _write_scatter
from traversability.cells.quarter_planes import MEAN_Z
from traversability.features import ALL_FEATURES, cell_features
from traversability.grid import PolarGrid

GRID = PolarGrid()
AHEAD = (16, int(np.searchsorted(GRID.ring_edges, 3.5)) - 1)


def feature(points, name, grid=GRID):
    """Return one feature of all cells, and the numbers of points."""
    found = cell_features(points.astype(np.float32), grid)
    return found.values[..., ALL_FEATURES.index(name)], found.counts


def field(height, stopped=0.6, begin=3.0):
    """Return level ground of which ``stopped`` of the points beyond an edge end in plants."""
    rng = np.random.default_rng(1)
    points = flat(0.0, 200_000).astype(float)
    hit = (points[:, 0] > begin) & (rng.random(len(points)) < stopped)
    points[hit, 2] = rng.uniform(0, height, hit.sum())
    return points


def test_level_ground_has_no_cover_and_no_scatter():
    """All shares, heights and steps are zero, also where the ground slopes."""
    for grade in (0.0, 0.2):
        points = flat(0.0, 100_000).astype(float)
        points[:, 2] = grade * points[:, 0]
        for name in ("cover_67", "cover_100", "cover_over_quartile", "smooth_step"):
            values, counts = feature(points, name)
            inner = counts >= 20
            inner[:, 8:] = False
            assert np.quantile(values[inner], 0.99) < 0.01, name


@pytest.mark.parametrize(
    ("name", "above"), [("cover_67", 0.10), ("cover_100", 0.15), ("cover_200", 0.30)]
)
def test_covers_are_the_shares_of_points_above_their_heights(name, above):
    """Of plants of half a metre that stop 60 % of the points, evenly up to the top."""
    values, _ = feature(field(0.5), name)
    assert values[AHEAD] == pytest.approx(0.6 * (1 - above / 0.5), abs=0.04)


def test_heights_are_quantiles_in_limits():
    """The upper decile of plants of half a metre is at five sixths of it."""
    values, _ = feature(field(0.5), "height_high")
    assert values[AHEAD] == pytest.approx(0.5 * 5 / 6 / 0.15, abs=0.15)
    values, _ = feature(field(0.5), "height_median")
    assert values[AHEAD] == pytest.approx(0.5 / 6 / 0.15, abs=0.15)


def test_a_robot_that_crosses_higher_plants_sees_lower_ones():
    """Plants of twice the height look the same to a robot with twice the limit."""
    tall = PolarGrid(max_traversable_vegetation=0.3)
    for name in ("cover_67", "cover_100", "cover_300", "height_high", "cover_over_quartile"):
        low, _ = feature(field(0.3), name)
        high, _ = feature(field(0.6), name, tall)
        assert low[AHEAD] == pytest.approx(high[AHEAD], abs=0.03), name


def test_a_kerb_is_a_smooth_step_and_plants_are_none():
    """Two smooth parts 10 cm apart are a step of that height; plants of 0.5 m have none."""
    kerb = flat(0.0, 200_000).astype(float)
    kerb[kerb[:, 0] > 3.6, 2] = 0.10
    step, _ = feature(kerb, "smooth_step")
    assert 0.02 < step[AHEAD] < 0.10  # The plane through both parts takes up some of it.
    plants, _ = feature(field(0.5), "smooth_step")
    assert plants[AHEAD] < 0.01
    scatter, _ = feature(field(0.5), "scatter")
    assert scatter[AHEAD] > 0.1


def test_dense_plants_lie_over_the_ground_that_is_extrapolated_from_before_them():
    """No ground of the field is seen: its cells lie their height over the way, as far as it goes.

    A slope that bends gradually is followed and lies over nothing.
    """
    points = flat(0.0, 200_000).astype(float)
    rng = np.random.default_rng(2)
    beyond = points[:, 0] > 3.0
    points[beyond, 2] = rng.uniform(0.2, 0.5, beyond.sum())
    over, _ = feature(points, "mean_over_way")
    assert over[16, AHEAD[1] + 1 :] == pytest.approx(0.35, abs=0.05)
    bend = flat(0.0, 200_000).astype(float)
    bend[:, 2] = 0.006 * np.clip(bend[:, 0], 0, None) ** 2
    low, counts = feature(bend, "low_over_way")
    assert np.abs(low[16][counts[16] >= 20]).max() < 0.12


def test_a_slope_goes_on_behind_a_gap():
    """Where some rings have no points the ground is extrapolated from the last one before them."""
    points = flat(0.0, 200_000).astype(float)
    points[:, 2] = 0.1 * points[:, 0]
    away = np.hypot(points[:, 0], points[:, 1])
    seen = (away < 2.5) | (away > 4.0)
    over, counts = feature(points[seen], "low_over_way")
    known = counts[16] >= 20
    behind = np.flatnonzero(known & (GRID.ring_edges[:-1] > 3.9))
    assert len(behind) > 2
    assert np.abs(over[16][behind]).max() < 0.05


@pytest.mark.parametrize("sector", [5, 0, GRID.n_sectors - 1])
def test_a_step_is_the_distance_of_neighbouring_means_less_the_scatter_of_both(sector):
    """All quarters 0.3 m over level planes, one beside the cell 0.1 m lower than them."""
    ring, cells = 6, make_workspace(GRID, 44)
    sums = np.zeros((2 * GRID.n_sectors, 2 * GRID.n_rings, 14))
    sums[..., COUNT] = 5
    cells.planes[:], cells.means[:], cells.scatter[:] = 0.0, 0.0, 0.01
    cells.means[..., MEAN_Z] = 0.3
    cells.scatter[2 * sector, 2 * ring] = 0.03
    sums[2 * sector, 2 * ring, COUNT] = 15
    out = np.zeros(44, dtype=np.float32)
    _write_scatter(sums, sector, ring, cells, out)
    assert out[SMOOTH_STEP] == 0.0
    assert out[SCATTER_LEAST] == pytest.approx(0.01)
    assert out[SCATTER] == pytest.approx(np.sqrt((15 * 0.03**2 + 15 * 0.01**2) / 30))
    for beside, spread in (((2 * sector - 1, 2 * ring), 0.03), ((2 * sector, 2 * ring - 1), 0.03)):
        cells.means[(*beside, MEAN_Z)] = 0.2
        _write_scatter(sums, sector, ring, cells, out)
        assert out[SMOOTH_STEP] == pytest.approx(0.1 - spread - 0.01)
        sums[(*beside, COUNT)] = 2  # Too few points make no mean.
        _write_scatter(sums, sector, ring, cells, out)
        assert out[SMOOTH_STEP] == 0.0
    after = ((2 * sector + 2) % len(sums), 2 * ring + 1)
    cells.means[(*after, MEAN_Z)] = 0.5
    _write_scatter(sums, sector, ring, cells, out)
    assert out[SMOOTH_STEP] == pytest.approx(0.2 - 0.02)
