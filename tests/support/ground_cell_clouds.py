"""Clouds of made ground, and their ground cells."""

import numpy as np

from traversability.cartesian.elevation_grid import ElevationGrid
from traversability.cartesian.features import GROUND_FEATURES, GroundFeatures
from traversability.cloud import PointCloud

HERE = np.zeros(2)


def column(name):
    """Return the place of a feature."""
    return GROUND_FEATURES.index(name)


def flat(x, y):
    """Return level ground."""
    return 0.0 * x


def sheet(height, half=11.0, spacing=0.025):
    """Return points of a surface around the origin, float32, shape (n, 3)."""
    axis = np.arange(-half + spacing / 2, half, spacing)
    x, y = (part.ravel() for part in np.meshgrid(axis, axis, indexing="ij"))
    return np.stack([x, y, height(x, y)], axis=1).astype(np.float32)


def trunk(x, y, radius=0.1, height=2.0):
    """Return points of an upright trunk, float32, shape (n, 3)."""
    turn, z = np.meshgrid(np.linspace(0, 2 * np.pi, 40), np.arange(0.0, height, 0.05))
    ring = [x + radius * np.cos(turn), y + radius * np.sin(turn), z]
    return np.stack([part.ravel() for part in ring], axis=1).astype(np.float32)


def described(points, here=HERE):
    """Return ground cells and features of a cloud's ground cells."""
    elevation, features = ElevationGrid(), GroundFeatures()
    elevation.describe(points, here)
    features.describe(elevation, here)
    return features.cells.copy(), features.values.copy()


def rocky(seed):
    """Return a labelled cloud of level ground with a block on it, and the block's middle."""
    rng = np.random.default_rng(seed)
    ground, middle = sheet(flat, spacing=0.05), rng.uniform([2.0, -3.0], [4.0, 3.0])
    low, high = [*(middle - 0.3), 0.0], [*(middle + 0.3), 0.4]
    points = np.concatenate([ground, rng.uniform(low, high, (400, 3))]).astype(np.float32)
    bad = (np.abs(points[:, :2] - middle) < 0.3).all(axis=1)
    return PointCloud(points, nontraversable=bad, forbidden=bad), middle
