"""Variations of clouds: cover on the ground, hidden directions, lost points."""

import numpy as np
import pytest

from andabata.datasets.cloud_variation import CloudVariation, _covered, _hidden, varied_cloud
from traversability.cloud import PointCloud

LASER = np.array([0.0, 0.0, 1.0])


def test_a_cloud_of_the_robot_itself_stays_as_it_is():
    """Without a variation nothing is drawn and nothing changes."""
    cloud = PointCloud(np.ones((5, 3), dtype=np.float32))
    rng = np.random.default_rng(0)
    assert varied_cloud(cloud, CloudVariation(), LASER, rng) is cloud
    assert rng.bit_generator.state == np.random.default_rng(0).bit_generator.state


def test_points_are_kept_by_their_share():
    """The others are lost, with all that belongs to them."""
    points = np.arange(30_000, dtype=np.float32).reshape(-1, 3)
    cloud = PointCloud(points, severity=points[:, 0])
    found = varied_cloud(cloud, CloudVariation(kept=0.3), LASER, np.random.default_rng(0))
    assert len(found) == pytest.approx(3000, abs=150)
    np.testing.assert_array_equal(found.severity, found.points[:, 0])


def test_a_hidden_direction_is_one_narrow_wedge():
    """What one direction hides lies within 0.02 to 0.25 rad, also where bearings wrap."""
    bearings = np.linspace(-np.pi, np.pi, 7200, endpoint=False)
    circle = np.stack([np.cos(bearings), np.sin(bearings), 0 * bearings], axis=1)
    points = (6.0 * circle).astype(np.float32)
    widths, wrapped = [], 0
    for seed in range(1500):
        hidden = _hidden(points, 1, np.random.default_rng(seed))
        if not hidden.any():
            continue
        wrapped += bool(hidden[0] and hidden[-1])
        edges = int((hidden != np.roll(hidden, 1)).sum())
        assert edges == 2
        widths.append(hidden.mean() * 2 * np.pi)
    assert wrapped > 5
    assert min(widths) == pytest.approx(0.02, abs=0.005)
    assert max(widths) == pytest.approx(0.25, abs=0.005)


def test_litter_has_its_height_and_its_wavelengths():
    """Litter has the set root mean square, is smooth over 3 cm and independent over 2 m."""
    x, y = np.meshgrid(np.arange(0, 6, 0.03), np.arange(0, 6, 0.5), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1).astype(np.float32)
    high, bare = np.array([3.0, 3.0, 1e4]), np.ones(len(points), bool)
    tops = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        covered = _covered(points, bare, high, 0.0, 0.02, rng)
        np.testing.assert_allclose(covered[:, :2], points[:, :2], atol=1e-4)
        tops.append(covered[:, 2].reshape(x.shape))
    height = np.array(tops)
    assert height.std() == pytest.approx(0.02, rel=0.1)
    for steps, low, most in ((1, 0.95, 1.0), (5, 0.3, 0.9), (67, -0.15, 0.15)):
        kept = (height[:, steps:] * height[:, :-steps]).mean() / height.var()
        assert low < kept < most
