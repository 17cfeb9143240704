"""One compiled pass gives what the parts give one by one."""

import numpy as np
import pytest

from andabata.models import shipped_forest
from traversability.features import cell_features
from traversability.forest import Forest
from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.scanner import TraversabilityScanner
from traversability.virtual_scan import virtual_scan


@pytest.fixture(scope="module")
def scanner():
    return TraversabilityScanner(shipped_forest())


def random_cloud(rng):
    """Return ground with steps and things, cut out and thinned at random."""
    n = int(rng.integers(50, 6000))
    xy = rng.uniform(-10.5, 10.5, (n, 2))
    wave = rng.uniform(0.2, 1.0, 2)
    z = rng.uniform(0, 0.5) * np.sin(wave[0] * xy[:, 0]) + rng.normal(0, 0.03, n)
    z += rng.choice([0, 0.1, 0.4]) * (np.sin(wave[1] * xy[:, 1]) > 0.6)
    for _ in range(rng.integers(0, 8)):
        near = np.hypot(*(xy - rng.uniform(-8, 8, 2)).T) < rng.uniform(0.1, 1)
        z[near] += rng.uniform(0, 1.5, near.sum())
    return np.column_stack([xy, z])[xy @ rng.normal(size=2) < rng.uniform(1, 30)].astype("f4")


def test_virtual_scans_of_1000_random_clouds_are_identical(scanner):
    rng = np.random.default_rng(0)
    forest, reds = shipped_forest(), 0
    for _ in range(1000):
        points = random_cloud(rng)
        states = forest.classify(cell_features(points, forest.grid), forest.grid)
        reds += int((states == CellState.NON_TRAVERSABLE).sum())
        np.testing.assert_array_equal(scanner.cells(points), states)
        expected = virtual_scan(states, forest.grid).ranges
        np.testing.assert_array_equal(scanner.scan(points).ranges, expected)
    assert reds > 1000


def test_nothing_is_remembered_from_cloud_to_cloud(scanner):
    rng = np.random.default_rng(1)
    first, second = random_cloud(rng), random_cloud(rng)
    fresh = scanner.cells(first)
    scanner.cells(second)
    np.testing.assert_array_equal(scanner.cells(first), fresh)
    assert not np.shares_memory(scanner.cells(first), fresh)


def test_no_points_are_unknown_and_never_free(scanner):
    scan = scanner.scan(np.zeros((0, 3), dtype=np.float32))
    assert np.isnan(scan.ranges).all()


@pytest.mark.parametrize("sectors", [64, 128])
def test_other_numbers_of_sectors(sectors):
    scanner = TraversabilityScanner(shipped_forest(), PolarGrid(n_sectors=sectors))
    rng = np.random.default_rng(2)
    r, bearing = rng.uniform(0.5, 10.0, 120_000), rng.uniform(-np.pi, np.pi, 120_000)
    xy = np.column_stack([r * np.cos(bearing), r * np.sin(bearing)])
    points = np.column_stack([xy, rng.normal(0, 0.01, len(xy))]).astype(np.float32)
    points[np.hypot(xy[:, 0] - 4, xy[:, 1]) < 0.5, 2] += 0.5
    ranges = scanner.scan(points).ranges
    assert ranges.shape == (sectors,)
    ahead = sectors // 2
    assert np.isfinite(ranges[[ahead - 1, ahead]]).all()
    assert ranges[[ahead - 1, ahead]].min() > 2.0
    assert np.isinf(ranges[0])


def test_a_forest_without_a_screen_works(scanner):
    forest = shipped_forest()
    bare = Forest(forest.trees, forest.thresholds, forest.grid)
    points = random_cloud(np.random.default_rng(3))
    expected = bare.classify(cell_features(points, bare.grid), bare.grid)
    np.testing.assert_array_equal(TraversabilityScanner(bare).cells(points), expected)


def test_odds_tell_how_red_a_cell_is(scanner):
    """From 0 on it is called red; without exits they are the forest's probability."""
    forest = shipped_forest()
    whole = Forest(forest.trees, forest.thresholds, forest.grid)
    points = random_cloud(np.random.default_rng(5))
    for one in (forest, whole):
        scan = TraversabilityScanner(one).scan(points)
        states = TraversabilityScanner(one).cells(points)
        judged = ~np.isnan(scan.log_odds)
        np.testing.assert_array_equal(scan.log_odds[judged] >= 0, states[judged] == 2)
        assert (states[judged] > 0).all()
        np.testing.assert_array_equal(virtual_scan_of(scan).ranges, scan.ranges)
    cells = cell_features(points, whole.grid)
    probability = whole.predict_proba(cells.values[judged])
    threshold = np.broadcast_to(whole.thresholds.of_rings(whole.grid), judged.shape)[judged]
    logit = [np.log(p) - np.log1p(-p) for p in (probability, threshold)]
    np.testing.assert_allclose(scan.log_odds[judged], logit[0] - logit[1], atol=1e-4)


def virtual_scan_of(scan):
    """Return the virtual scan of the cells that the odds call red and green."""
    cells = np.where(np.isnan(scan.log_odds), 0, np.where(scan.log_odds >= 0, 2, 1))
    return virtual_scan(cells.astype(np.uint8), shipped_forest().grid)
