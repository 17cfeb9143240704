"""Samples of made cells."""

import numpy as np

from traversability.dataset import CellSamples
from traversability.features import ALL_FEATURES
from traversability.forest_training import ForestConfig
from traversability.grid import PolarGrid

GRID = PolarGrid()
SMALL = ForestConfig(trees=12, screen_trees=20, screen_loss=0.02)


def cells(n=4000, seed=0):
    """Return labelled cells of 20 worlds whose labels depend on three features."""
    rng = np.random.default_rng(seed)
    features = rng.normal(size=(n, len(ALL_FEATURES))).astype(np.float32)
    blocked = features[:, 0] + 0.5 * features[:, 4] + features[:, 30] + rng.normal(0, 0.3, n) > 1
    world = np.arange(n) // (n // 20)
    ring = rng.integers(0, GRID.n_rings, n).astype(np.int32)
    return CellSamples(features, blocked, blocked | True, 0, ring, world.astype(np.int32), world)
