"""Clouds of made ground for the polar grid."""

import numpy as np


def rough_ground(n=20_000, seed=0):
    """Slopes, a drop, a wall, a crown and gaps: something of everything."""
    rng = np.random.default_rng(seed)
    xy = rng.uniform(-11, 11, (n, 2))
    z = 0.2 * xy[:, 0] + np.sin(xy[:, 1]) * 0.3 + rng.normal(0, 0.03, n)
    z[xy[:, 0] > 3] -= 0.6
    z[np.hypot(xy[:, 0] + 4, xy[:, 1] - 2) < 0.5] += rng.uniform(0, 2.5)
    shadow = (np.abs(xy[:, 1]) < 0.8) & (xy[:, 0] < -5)
    return np.column_stack([xy, z])[~shadow].astype(np.float32)


def flat(height=-0.1, n=20_000):
    """Return level ground around the robot, float32, shape (n, 3)."""
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-10, 10, (n, 2)), np.full(n, height)])
    return points.astype(np.float32)
