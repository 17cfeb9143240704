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
