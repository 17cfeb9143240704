"""The point classifier of the paper's reference [24]: trees on every point's neighbourhood.

It stands beside the cell classifier for comparison. Each point is described by a principal
component analysis of its nearest neighbours and by its height over what lies around it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from terrain.kernel import kernel
from traversability.binning import LOWEST, fill_quarters
from traversability.cell_shape import eigenvalues, normal_z_squared
from traversability.grid import PolarGrid
from traversability.tree_fitting import flatten_random
from traversability.trees import Trees, add_leaves

POINT_FEATURES = (
    "roughness",
    "orientation",
    "planarity",
    "height_difference",
    "spacing",
    "wide_roughness",
    "wide_orientation",
    "wide_height_difference",
    "over_lowest_near",
    "over_lowest_around",
    "distance",
)
"""Features of a point: of its 12 and of its 48 nearest neighbours, and heights over the ground."""

_NEAR, _WIDE = 12, 48


def point_features(points: NDArray[np.float32], grid: PolarGrid) -> NDArray[np.float32]:
    """Return the features of each point, float32, shape (n, 11).

    Args:
        points: In ``base_footprint`` [m], finite, float32, shape (n, 3).
        grid: Whose quarters tell the ground around a point.
    """
    n = len(points)
    out = np.zeros((n, len(POINT_FEATURES)), dtype=np.float32)
    if n <= _WIDE:
        return out
    tree = cKDTree(points)
    gaps, near = tree.query(points, _NEAR)
    every = points[::4] if n > 4 * _WIDE else points
    _, wide = cKDTree(every).query(points, _WIDE // 4)
    quarters = fill_quarters(points, grid)
    _describe(points, near, gaps, out, 0)
    _describe(every, wide, gaps, out, 5)
    lowest = quarters.sums[..., LOWEST]
    around = _lowest_around(lowest)
    bins = quarters.bins[:n]
    known = bins >= 0
    z = points[known, 2]
    out[known, 8] = z - lowest.ravel()[bins[known]]
    out[known, 9] = z - around.ravel()[bins[known]]
    out[:, 10] = np.hypot(points[:, 0], points[:, 1])
    return out


def _lowest_around(lowest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lowest of each quarter's 3 x 3 neighbourhood."""
    padded = np.pad(lowest, ((0, 0), (1, 1)), constant_values=np.inf)
    rows = np.minimum(np.minimum(padded[:, :-2], padded[:, 1:-1]), padded[:, 2:])
    return np.minimum(np.minimum(np.roll(rows, 1, 0), rows), np.roll(rows, -1, 0))


@kernel
def _describe(points, neighbours, gaps, out, first):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the features of each row of neighbours: with ``first`` 0 all five, else three."""
    for k in range(len(neighbours)):
        n = neighbours.shape[1]
        x0, y0, z0 = points[neighbours[k, 0]]
        x = y = z = xx = yy = zz = xy = xz = yz = 0.0
        low, high = np.inf, -np.inf
        for j in range(n):
            a, b, c = points[neighbours[k, j]]
            a, b, c = a - x0, b - y0, c - z0
            x, y, z = x + a, y + b, z + c
            xx, yy, zz = xx + a * a, yy + b * b, zz + c * c
            xy, xz, yz = xy + a * b, xz + a * c, yz + b * c
            low, high = min(low, c), max(high, c)
        x, y, z = x / n, y / n, z / n
        xx, yy, zz = xx / n - x * x, yy / n - y * y, zz / n - z * z
        xy, xz, yz = xy / n - x * y, xz / n - x * z, yz / n - y * z
        l1, l2, l3 = eigenvalues(xx, yy, zz, xy, xz, yz)
        out[k, first] = np.sqrt(l3)
        out[k, first + 1] = np.sqrt(normal_z_squared(xx, yy, xy, l1, l2, l3))
        if first:
            out[k, first + 2] = high - low
        else:
            out[k, 2] = (l2 - l3) / l1 if l1 > 0 else 0.0
            out[k, 3], out[k, 4] = high - low, gaps[k, n - 1]


@dataclass(frozen=True)
class PointClassifier:
    """What tells obstacle points from others.

    Attributes:
        trees: On ``POINT_FEATURES``.
        threshold: A point is an obstacle from this probability on.
        grid: See ``point_features``.
    """

    trees: Trees
    threshold: float
    grid: PolarGrid

    def obstacles(self, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return whether each point belongs to something the robot must not drive on, (n,)."""
        features = point_features(points, self.grid)
        sums = np.full(len(points), self.trees.base)
        rows = np.arange(len(points))
        add_leaves(
            features,
            rows,
            len(rows),
            self.trees.laid_out(POINT_FEATURES),
            0,
            len(self.trees.roots),
            sums,
        )
        return self.trees.probability(sums) >= self.threshold


def fit_point_classifier(
    features: NDArray[np.float32],
    bad: NDArray[np.bool_],
    grid: PolarGrid,
    seed: int,
    trees: int = 50,
    depth: int = 14,
) -> PointClassifier:
    """Grow a random forest on points; its threshold has the best F1 out of bag.

    Args:
        features: Of ``point_features``, shape (n, 11).
        bad: Whether each point is non-traversable, shape (n,).
        grid: See ``point_features``.
        seed: Of bootstrap and splits.
        trees: Number of trees.
        depth: Deepest split.
    """
    from sklearn.ensemble import RandomForestClassifier

    model = RandomForestClassifier(
        trees, max_depth=depth, min_samples_leaf=5, oob_score=True, random_state=seed, n_jobs=1
    )
    model.fit(features, bad)
    probability = model.oob_decision_function_[:, 1]
    thresholds = np.arange(0.2, 0.7, 0.02)
    called = probability[:, None] >= thresholds
    f1 = 2 * (called & bad[:, None]).sum(axis=0) / (called.sum(axis=0) + bad.sum())
    return PointClassifier(
        flatten_random(model, POINT_FEATURES), float(thresholds[f1.argmax()]), grid
    )
