"""True maps of small pieces of ground, for tests."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from worlds.traversability_map import Reason, TraversabilityMap
from worlds.truth import TruthConfig, build_truth


def truth_of(
    heights: np.ndarray, objects: Sequence[SceneObject] = (), cell: float = 0.2
) -> TraversabilityMap:
    """Return the true map of heights and objects, without a border."""
    config = TruthConfig(border=0.0)
    return build_truth(Heightfield(heights.astype(np.float32), cell), tuple(objects), config)


def slope(angle_deg: float, n: int = 101, cell: float = 0.2) -> np.ndarray:
    """Return heights that rise along x [m]."""
    return np.repeat((np.arange(n) * cell * np.tan(np.deg2rad(angle_deg)))[:, None], n, axis=1)


def solid_at(truth: TraversabilityMap, x: ArrayLike, y: ArrayLike) -> np.ndarray:
    """Return True at each place [m] with a solid object."""
    return np.isin(truth.reason_at(np.asarray(x), np.asarray(y)), (Reason.SOLID, Reason.LOW))


def map_of_blocks(blocks=(), n=200, cell=0.1):
    """Return a true map of ``n`` cells a side with forbidden rectangles (x0, x1, y0, y1) [m]."""
    x, y = np.meshgrid(*[(np.arange(n) + 0.5) * cell] * 2, indexing="ij")
    clearance = np.full((n, n), 5.0)
    for x0, x1, y0, y1 in blocks:
        aside, along = np.maximum(x0 - x, x - x1), np.maximum(y0 - y, y - y1)
        away = np.hypot(np.maximum(aside, 0), np.maximum(along, 0))
        clearance = np.minimum(clearance, away)
    reason = np.where(clearance > 0, Reason.FREE, Reason.SOLID).astype(np.uint8)
    severity = np.full((n, n), -5.0, dtype=np.float32)
    return TraversabilityMap(cell, 0.0, 0.0, reason, severity, clearance.astype(np.float32))
