"""Ground layer: log odds of the classifier, remembered up to a limit, with a price for misses."""

import numpy as np
import pytest

from andabata.models import shipped_ground_classifier
from andabata.navigation.planning.ground_layer import GroundLayer, GroundLayerConfig
from tests.support.situations import ORIGIN, constant_classifier
from traversability.cartesian.elevation_grid import ElevationGrid

MIDDLES = 0.2 * ((np.arange(256) + 128) % 256 - 128) + 0.1
RANGES = np.hypot(MIDDLES[:, None], MIDDLES[None, :])


def ground(rng, noise=0.006):
    """Return points of level ground around the origin, float32, shape (n, 3)."""
    x, y = rng.uniform(-5.5, 5.5, (2, 60_000))
    return np.stack([x, y, rng.normal(0, noise, len(x))], axis=1).astype(np.float32)


def trunk(x, y, rng):
    """Return points of an upright trunk, float32, shape (n, 3)."""
    turn, z = rng.uniform(0, 2 * np.pi, 1500), rng.uniform(0, 1.5, 1500)
    return np.stack([x + 0.1 * np.cos(turn), y + 0.1 * np.sin(turn), z], 1).astype(np.float32)


def elevation_of(points, position=ORIGIN):
    """Return the elevation grid of a cloud."""
    elevation = ElevationGrid()
    elevation.describe(points, position)
    return elevation


def layer_of(classifier=None, **settings):
    """Return an empty layer."""
    return GroundLayer(
        256, classifier or shipped_ground_classifier(), GroundLayerConfig(**settings)
    )


def test_log_odds_are_remembered_up_to_a_limit_and_certain_ones_override_them():
    """Free ground is certain after some clouds, and a trunk that appears there is blocked."""
    rng, config = np.random.default_rng(2), GroundLayerConfig()
    plain, blocked = ground(rng), np.concatenate([ground(rng), trunk(2.1, 0.1, rng)])
    layer = layer_of()
    for _ in range(6):
        layer.update(elevation_of(plain), ORIGIN)
    assert np.abs(layer.log_odds).max() <= config.max_log_odds
    assert layer.log_odds[10, 0] == -config.max_log_odds
    layer.update(elevation_of(blocked), ORIGIN)
    assert layer.log_odds[10, 0] > 2.0
    layer.update(elevation_of(np.empty((0, 3), dtype=np.float32)), ORIGIN)
    assert layer.log_odds[10, 0] > 2.0  # Nothing seen, nothing forgotten.


def test_the_memory_weighs_what_was_known_before():
    """New log odds are those of the cloud and half of those before."""
    elevation = elevation_of(ground(np.random.default_rng(0)))
    layer = layer_of(constant_classifier(-0.5), miss_cost=1.0, memory=0.5, max_log_odds=50.0)
    found = []
    for _ in range(3):
        layer.update(elevation, ORIGIN)
        found.append(float(layer.log_odds[10, 0]))
    sums = -0.5 * np.array([1.0, 1.5, 1.75])
    np.testing.assert_allclose(found, sums, rtol=1e-5)


def test_both_limits_hold():
    """Log odds are bounded on either side by the largest."""
    elevation = elevation_of(ground(np.random.default_rng(0)))
    for log_odds in (-30.0, 30.0):
        layer = layer_of(constant_classifier(log_odds), max_log_odds=2.5)
        layer.update(elevation, ORIGIN)
        assert layer.log_odds[10, 0] == np.sign(log_odds) * 2.5
        assert layer.max_log_odds == 2.5


def test_a_miss_cost_moves_near_log_odds_by_its_logarithm():
    """Up to the near range log odds rise by the logarithm; beyond it they stay as they are."""
    elevation = elevation_of(ground(np.random.default_rng(3), noise=0.02))
    found = []
    for cost in (1.0, 5.0):
        layer = layer_of(miss_cost=cost, near_range=3.0, max_log_odds=50.0)
        layer.update(elevation, ORIGIN)
        found.append(layer.log_odds.copy())
    seen, change = found[0] != 0, found[1] - found[0]
    assert change[seen & (RANGES < 2.99)] == pytest.approx(np.log(5.0), abs=1e-5)
    assert change[seen & (RANGES > 3.01)] == pytest.approx(0.0, abs=1e-6)


def test_cells_have_the_size_that_the_classifier_knows():
    """A ground cell is two by two cells of the elevation grid, and lies where its points do."""
    layer = layer_of()
    assert layer.cell == pytest.approx(2 * shipped_ground_classifier().cell)
    position = np.array([-30.0, 17.0])
    cloud = ground(np.random.default_rng(1))
    cloud[:, :2] += position.astype(np.float32)
    cloud = cloud[cloud[:, 0] > position[0] + 2.0]
    layer.update(elevation_of(cloud, position), position)
    np.testing.assert_array_equal(layer.centre, [-150, 85])
    i, j = np.nonzero(layer.log_odds)
    x = (((i + 150 + 128) % 256 - 128) + 0.5) * 0.2
    y = (((j - 85 + 128) % 256 - 128) + 0.5) * 0.2
    assert x.min() > 1.9
    assert 4.9 < x.max() < 5.7
    assert y.max() > 4.9
    assert y.min() < -4.9


def test_the_layer_forgets_what_the_robot_leaves_behind():
    """Cells within the square are kept, those beyond it are unknown again; so are all by reset."""
    layer = layer_of()
    layer.update(elevation_of(ground(np.random.default_rng(4))), ORIGIN)
    assert layer.log_odds.any()
    layer.follow(np.array([20.0, 0.0]))
    assert layer.log_odds.any()
    layer.follow(np.array([60.0, 0.0]))
    assert not layer.log_odds.any()
    layer.update(elevation_of(ground(np.random.default_rng(4))), ORIGIN)
    layer.reset()
    assert not layer.log_odds.any()


def test_only_cells_of_the_asked_ages_are_classified_as_in_the_whole_cloud():
    """Half of the ground was measured a second before the other half."""
    rng = np.random.default_rng(6)
    points = np.concatenate([ground(rng), trunk(2.1, 0.1, rng), trunk(-2.1, 0.1, rng)])
    stamps = np.where(points[:, 0] < 0.4, -1.5, -0.5)
    elevation = ElevationGrid()
    elevation.describe(points, ORIGIN, stamps)
    whole, parts = layer_of(), layer_of()
    whole.update(elevation, ORIGIN)
    parts.update(elevation, ORIGIN, (1.0, 2.0))
    assert not parts.log_odds[MIDDLES > 0.4].any()
    assert parts.log_odds[MIDDLES < 0.4].any()
    parts.update(elevation, ORIGIN, (0.0, 1.0))
    assert np.array_equal(parts.log_odds, whole.log_odds)
