"""The point classifier separates a trunk from the ground."""

import numpy as np

from traversability.grid import PolarGrid
from traversability.points import POINT_FEATURES, fit_point_classifier, point_features

GRID = PolarGrid()


def scene(seed):
    """Return ground with one trunk, and which points are its own."""
    rng = np.random.default_rng(seed)
    ground = np.column_stack([rng.uniform(-6, 6, (5000, 2)), rng.normal(0, 0.01, 5000)])
    angle = rng.uniform(-np.pi, np.pi, 400)
    trunk = np.column_stack([0.15 * np.cos(angle), 0.15 * np.sin(angle), rng.uniform(0, 1.2, 400)])
    points = np.concatenate([ground, trunk + np.array([*rng.uniform(2, 4, 2), 0])]).astype(
        np.float32
    )
    bad = np.arange(len(points)) >= 5000
    order = rng.permutation(len(points))
    return points[order], bad[order]


def test_a_trunk_is_classified_as_an_obstacle():
    """F1 on a fresh scene is above 0.95."""
    points, bad = scene(0)
    features = point_features(points, GRID)
    assert features.shape == (len(points), len(POINT_FEATURES))
    assert np.isfinite(features).all()
    classifier = fit_point_classifier(features, bad, GRID, seed=0, trees=40)
    fresh, truth = scene(1)
    called = classifier.obstacles(fresh)
    assert 2 * (called & truth).sum() / (called.sum() + truth.sum()) > 0.95


def test_a_handful_of_points_has_no_neighbourhoods():
    """Their features are all 0."""
    assert not point_features(np.zeros((5, 3), dtype=np.float32), GRID).any()
