"""One compiled pass gives what the parts give one by one."""

from dataclasses import fields, replace

import numpy as np
import pytest

from andabata.models import shipped_forest
from traversability.features import ALL_FEATURES, cell_features
from traversability.forest import Forest, Screen
from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.scanner import TraversabilityScanner
from traversability.trees.flat import Trees
from traversability.virtual_scan import virtual_scan


@pytest.fixture(scope="module")
def scanner():
    """Return a scanner with the shipped forest."""
    return TraversabilityScanner(shipped_forest())


def random_cloud(rng):
    """Return ground with steps and objects, cut out and thinned at random."""
    n = int(rng.integers(50, 6000))
    xy = rng.uniform(-10.5, 10.5, (n, 2))
    wave = rng.uniform(0.2, 1.0, 2)
    z = rng.uniform(0, 0.5) * np.sin(wave[0] * xy[:, 0]) + rng.normal(0, 0.03, n)
    z += rng.choice([0, 0.1, 0.4]) * (np.sin(wave[1] * xy[:, 1]) > 0.6)
    for _ in range(rng.integers(0, 8)):
        near = np.hypot(*(xy - rng.uniform(-8, 8, 2)).T) < rng.uniform(0.1, 1)
        z[near] += rng.uniform(0, 1.5, near.sum())
    return np.column_stack([xy, z])[xy @ rng.normal(size=2) < rng.uniform(1, 30)].astype("f4")


def test_virtual_scans_of_200_random_clouds_are_identical(scanner):
    """Cells and ranges are those of the stages one by one."""
    rng = np.random.default_rng(0)
    forest, n_blocked = shipped_forest(), 0
    for _ in range(200):
        points = random_cloud(rng)
        states = forest.classify(cell_features(points, forest.grid), forest.grid)
        n_blocked += int((states == CellState.NON_TRAVERSABLE).sum())
        np.testing.assert_array_equal(scanner.cells(points), states)
        expected = virtual_scan(states, forest.grid).ranges
        np.testing.assert_array_equal(scanner.scan(points).ranges, expected)
    assert n_blocked > 1000


def test_nothing_is_remembered_from_cloud_to_cloud(scanner):
    """A cloud gives the same after another one, in memory of its own."""
    rng = np.random.default_rng(1)
    first, second = random_cloud(rng), random_cloud(rng)
    fresh = scanner.cells(first)
    scanner.cells(second)
    np.testing.assert_array_equal(scanner.cells(first), fresh)
    assert not np.shares_memory(scanner.cells(first), fresh)


def test_no_points_are_unknown_and_never_free(scanner):
    """Without points all ranges are NaN."""
    scan = scanner.scan(np.zeros((0, 3), dtype=np.float32))
    assert np.isnan(scan.ranges).all()


@pytest.mark.parametrize("sectors", [64, 128])
def test_other_numbers_of_sectors(sectors):
    """A forest for 32 sectors classifies 64 and 128, and finds the block ahead."""
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


def test_a_grid_that_the_forest_was_not_trained_for_is_refused():
    """The number of rings is part of what the trees learnt."""
    with pytest.raises(ValueError, match="expected the 10 rings"):
        TraversabilityScanner(shipped_forest(), PolarGrid(n_rings=8))


def test_a_forest_without_a_screen_works(scanner):
    """All cells go to the trees then."""
    forest = shipped_forest()
    bare = Forest(forest.trees, forest.thresholds, forest.grid)
    points = random_cloud(np.random.default_rng(3))
    expected = bare.classify(cell_features(points, bare.grid), bare.grid)
    np.testing.assert_array_equal(TraversabilityScanner(bare).cells(points), expected)


def test_log_odds_are_those_of_the_forest_over_its_threshold(scanner):
    """From 0 on a cell is blocked; without exits they are the logit of the probability."""
    forest = shipped_forest()
    whole = Forest(forest.trees, forest.thresholds, forest.grid)
    points = random_cloud(np.random.default_rng(5))
    for one in (forest, whole):
        scan = TraversabilityScanner(one).scan(points)
        states = TraversabilityScanner(one).cells(points)
        known = ~np.isnan(scan.log_odds)
        np.testing.assert_array_equal(scan.log_odds[known] >= 0, states[known] == 2)
        assert (states[known] > 0).all()
        np.testing.assert_array_equal(virtual_scan_of(scan).ranges, scan.ranges)
    cells = cell_features(points, whole.grid)
    probability = whole.predict_proba(cells.values[known])
    threshold = np.broadcast_to(whole.thresholds.of_rings(whole.grid), known.shape)[known]
    logit = [np.log(p) - np.log1p(-p) for p in (probability, threshold)]
    np.testing.assert_allclose(scan.log_odds[known], logit[0] - logit[1], atol=1e-4)


def virtual_scan_of(scan):
    """Return the virtual scan of the cells that the log odds make blocked and free."""
    cells = np.where(np.isnan(scan.log_odds), 0, np.where(scan.log_odds >= 0, 2, 1))
    return virtual_scan(cells.astype(np.uint8), shipped_forest().grid)


def test_a_screen_of_deep_trees_is_walked_whole():
    """Trees deeper than complete ones are laid out otherwise; all of them count."""
    forest = shipped_forest()

    class Deep(Trees):
        """Trees that are never filled up."""

        def laid_out(self, names):
            """Return linked nodes."""
            column = np.array([names.index(name) for name in self.features])
            splits = np.where(self.feature >= 0, column[self.feature], 0)
            return self._linked(self.cut.astype(np.float32), splits)

    deep = Deep(**{field.name: getattr(forest.screen.trees, field.name) for field in fields(Trees)})
    changed = replace(forest, screen=Screen(deep, forest.screen.limit))
    points = random_cloud(np.random.default_rng(6))
    expected = changed.classify(cell_features(points, forest.grid), forest.grid)
    assert changed.screen.trees.laid_out(ALL_FEATURES).depth == 0
    np.testing.assert_array_equal(TraversabilityScanner(changed).cells(points), expected)
