"""Point classifier of the paper's reference [24]: trees on the neighbourhood of every point.

A baseline for the cell classifier. Each point is described by a principal component analysis of its
nearest neighbours and by its height over the lowest points around it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from terrain.kernel import kernel
from traversability.binning import LOWEST, fill_quarters
from traversability.cells.covariance import Covariance, eigenvalues, normal_z_squared
from traversability.grid import PolarGrid
from traversability.trees.fitting import flatten_random
from traversability.trees.flat import Trees, add_leaves

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
"""Features of a point: of its 12 and of its 48 nearest neighbours, heights over the ground [m], and
the distance from the robot [m]."""

_ROUGHNESS, _ORIENTATION, _PLANARITY, _HEIGHT_DIFFERENCE, _SPACING = range(5)
_WIDE_ROUGHNESS, _WIDE_ORIENTATION, _WIDE_HEIGHT_DIFFERENCE = range(5, 8)
_OVER_LOWEST_NEAR, _OVER_LOWEST_AROUND, _DISTANCE = range(8, 11)

_N_NEAR, _N_WIDE = 12, 48
"""Number of neighbours in the near and in the wide neighbourhood."""

_WIDE_STRIDE = 4
"""Share of points among which wide neighbourhoods are sought: one of so many."""


def point_features(points: NDArray[np.float32], grid: PolarGrid) -> NDArray[np.float32]:
    """Return the features of each point, float32, shape (n, 11); all 0 with 48 points or fewer.

    Args:
        points: Points in ``base_footprint`` [m], finite, float32, shape (n, 3).
        grid: Polar grid whose quarters hold the lowest points around each point.
    """
    n = len(points)
    out = np.zeros((n, len(POINT_FEATURES)), dtype=np.float32)
    if n <= _N_WIDE:
        return out
    spacings, near = cKDTree(points).query(points, _N_NEAR)
    # Wide neighbourhoods come from a thinned cloud: as wide, at a quarter of the work.
    thinned = points[::_WIDE_STRIDE] if n > _WIDE_STRIDE * _N_WIDE else points
    _, wide = cKDTree(thinned).query(points, _N_WIDE // _WIDE_STRIDE)
    _describe_near(points, near, spacings, out)
    _describe_wide(thinned, wide, out)
    # Heights over the lowest point of the own quarter, and of it and its eight neighbours.
    quarters = fill_quarters(points, grid)
    lowest = quarters.sums[..., LOWEST]
    around = _lowest_around(lowest)
    bins = quarters.bins[:n]
    known = bins >= 0
    z = points[known, 2]
    out[known, _OVER_LOWEST_NEAR] = z - lowest.ravel()[bins[known]]
    out[known, _OVER_LOWEST_AROUND] = z - around.ravel()[bins[known]]
    out[:, _DISTANCE] = np.hypot(points[:, 0], points[:, 1])
    return out


def _lowest_around(lowest: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lowest z of each quarter's 3 x 3 neighbourhood, shape as given.

    Args:
        lowest: Lowest z of each quarter [m], shape (2 n_sectors, 2 n_rings); the sectors form a
            circle.
    """
    padded = np.pad(lowest, ((0, 0), (1, 1)), constant_values=np.inf)
    rows = np.minimum(np.minimum(padded[:, :-2], padded[:, 1:-1]), padded[:, 2:])
    return np.minimum(np.minimum(np.roll(rows, 1, 0), rows), np.roll(rows, -1, 0))


@kernel
def _describe_near(
    points: NDArray[np.float32],
    neighbours: NDArray[np.int64],
    spacings: NDArray[np.float64],
    out: NDArray[np.float32],
) -> None:
    """Write the five features of the near neighbourhoods.

    Args:
        points: Points [m], shape (n, 3).
        neighbours: Indices of each point's nearest neighbours, itself among them, shape (n, k).
        spacings: Distances to them [m], ascending, shape (n, k).
        out: Output, shape (n, 11).
    """
    for k in range(len(neighbours)):
        covariance, height = _moments(points, neighbours[k])
        axes = eigenvalues(covariance)
        out[k, _ROUGHNESS] = np.sqrt(axes.l3)
        out[k, _ORIENTATION] = np.sqrt(normal_z_squared(covariance, axes))
        out[k, _PLANARITY] = (axes.l2 - axes.l3) / axes.l1 if axes.l1 > 0 else 0.0
        out[k, _HEIGHT_DIFFERENCE] = height
        out[k, _SPACING] = spacings[k, neighbours.shape[1] - 1]


@kernel
def _describe_wide(
    points: NDArray[np.float32], neighbours: NDArray[np.int64], out: NDArray[np.float32]
) -> None:
    """Write the three features of the wide neighbourhoods.

    Args:
        points: Thinned points [m], shape (m, 3).
        neighbours: Indices of the nearest thinned points of each point, shape (n, k).
        out: Output, shape (n, 11).
    """
    for k in range(len(neighbours)):
        covariance, height = _moments(points, neighbours[k])
        axes = eigenvalues(covariance)
        out[k, _WIDE_ROUGHNESS] = np.sqrt(axes.l3)
        out[k, _WIDE_ORIENTATION] = np.sqrt(normal_z_squared(covariance, axes))
        out[k, _WIDE_HEIGHT_DIFFERENCE] = height


@kernel
def _moments(points: NDArray[np.float32], chosen: NDArray[np.int64]) -> tuple[Covariance, float]:
    """Return the covariance [m2] and the height difference [m] of some points."""
    n = len(chosen)
    # Counted from the first point, so that float32 differences lose nothing far from the origin.
    x0, y0, z0 = points[chosen[0]]
    x = y = z = xx = yy = zz = xy = xz = yz = 0.0
    low, high = np.inf, -np.inf
    for j in range(n):
        a, b, c = points[chosen[j]]
        a, b, c = a - x0, b - y0, c - z0
        x, y, z = x + a, y + b, z + c
        xx, yy, zz = xx + a * a, yy + b * b, zz + c * c
        xy, xz, yz = xy + a * b, xz + a * c, yz + b * c
        low, high = min(low, c), max(high, c)
    x, y, z = x / n, y / n, z / n
    xx, yy, zz = xx / n - x * x, yy / n - y * y, zz / n - z * z
    xy, xz, yz = xy / n - x * y, xz / n - x * z, yz / n - y * z
    return Covariance(xx, yy, zz, xy, xz, yz), high - low


@dataclass(frozen=True)
class PointClassifier:
    """Random forest that classifies points as obstacles or not.

    Attributes:
        trees: Trees on ``POINT_FEATURES``.
        threshold: Probability from which on a point is an obstacle.
        grid: Polar grid; see ``point_features``.
    """

    trees: Trees
    threshold: float
    grid: PolarGrid

    def obstacles(self, points: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Return which points belong to something non-traversable, bool, shape (n,).

        Args:
            points: Points in ``base_footprint`` [m], finite, float32, shape (n, 3).
        """
        features = point_features(points, self.grid)
        sums = np.full(len(points), self.trees.base)
        rows, nodes = np.arange(len(points)), self.trees.laid_out(POINT_FEATURES)
        add_leaves(features, rows, len(rows), nodes, 0, nodes.n_trees, sums)
        return self.trees.probability(sums) >= self.threshold


def fit_point_classifier(
    features: NDArray[np.float32],
    blocked: NDArray[np.bool_],
    grid: PolarGrid,
    seed: int,
    trees: int = 50,
    depth: int = 14,
) -> PointClassifier:
    """Fit a random forest to labelled points; its threshold has the best F1 out of bag.

    Args:
        features: Features of ``point_features``, shape (n, 11).
        blocked: True for points that belong to something non-traversable, shape (n,).
        grid: Polar grid; see ``point_features``.
        seed: Seed of bootstrap and splits.
        trees: Number of trees.
        depth: Largest number of splits from the root to a leaf.
    """
    from sklearn.ensemble import RandomForestClassifier

    model = RandomForestClassifier(
        trees, max_depth=depth, min_samples_leaf=5, oob_score=True, random_state=seed, n_jobs=1
    )
    model.fit(features, blocked)
    probability = model.oob_decision_function_[:, 1]
    thresholds = np.arange(0.2, 0.7, 0.02)
    called = probability[:, None] >= thresholds
    hits = (called & blocked[:, None]).sum(axis=0)
    f1 = 2 * hits / (called.sum(axis=0) + blocked.sum())
    threshold = float(thresholds[f1.argmax()])
    return PointClassifier(flatten_random(model, POINT_FEATURES), threshold, grid)
