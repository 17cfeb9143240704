"""Five features of each polar cell, in one pass over the cloud (Sanchez et al. 2023, section 3.3).

A point falls into its cell, its first and second moments are added up there, and the cell's
covariance gives the eigenvalues ``l1 >= l2 >= l3`` of a principal component analysis.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from traversability.grid import PolarGrid

FEATURES = ("roughness", "orientation", "planarity", "min_height", "height_difference")
"""Names of the features, in the order of the last axis of ``CellFeatures.values``."""


@dataclass(frozen=True)
class CellFeatures:
    """What is known about each cell.

    Attributes:
        values: Features in the order of ``FEATURES``, float32, shape (n_sectors, n_rings, 5); zero
            where a cell has fewer than three points.
        counts: Points of each cell, int32, shape (n_sectors, n_rings).
    """

    values: NDArray[np.float32]
    counts: NDArray[np.int32]


def cell_features(points: NDArray[np.float32], grid: PolarGrid) -> CellFeatures:
    """Return the features of each cell.

    * roughness: ``sqrt(l3)``, the deviation from the cell's plane [m];
    * orientation: ``|n_z|`` of the plane's normal, 1 on level ground and 0 on a wall;
    * planarity: ``(l2 - l3) / l1``, 1 for a disc and 0 for a line or a ball;
    * minimum height above the base plane [m];
    * height difference between the highest and the lowest point [m].

    The formulas of the first three are an assumption: the paper names the features only.

    Args:
        points: Points in ``base_footprint`` [m], float32, shape (n, 3). Those beyond the rings, too
            high for the robot or not finite are left out.
        grid: The cells.

    Raises:
        ValueError: If ``points`` has another shape.
    """
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"points: expected shape (n, 3), got {points.shape}")
    shape = (grid.n_sectors, grid.n_rings)
    counts = np.zeros(shape, dtype=np.int32)
    moments = np.zeros((*shape, 14))
    edges = grid.ring_edges
    _add_moments(points, edges * edges, grid.max_height, counts, moments)
    values = np.zeros((*shape, len(FEATURES)), dtype=np.float32)
    _describe(counts, moments, values)
    return CellFeatures(values, counts)


@njit(cache=True, nogil=True)
def cell_of(x, y, square_edges, n_sectors):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return sector and ring of a point, ring -1 where it is on none."""
    square = x * x + y * y
    if not (square_edges[0] <= square < square_edges[-1]):
        return 0, -1
    ring = 0
    while square >= square_edges[ring + 1]:
        ring += 1
    share = (np.arctan2(y, x) + np.pi) / (2 * np.pi)
    return min(int(share * n_sectors), n_sectors - 1), ring


@njit(cache=True, nogil=True)
def _add_moments(points, square_edges, max_height, counts, moments):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Add each point to its cell: origin (3), sums (3), products (6), lowest and highest (2).

    The cell's first point is the origin of its moments, so that nothing cancels far from the robot.
    """
    n_sectors = counts.shape[0]
    for k in range(len(points)):
        x, y, z = np.float64(points[k, 0]), np.float64(points[k, 1]), np.float64(points[k, 2])
        if not (z <= max_height and z > -np.inf):
            continue
        sector, ring = cell_of(x, y, square_edges, n_sectors)
        if ring < 0:
            continue
        m = moments[sector, ring]
        if counts[sector, ring] == 0:
            m[0], m[1], m[2], m[12], m[13] = x, y, z, z, z
        counts[sector, ring] += 1
        m[12], m[13] = min(m[12], z), max(m[13], z)
        x, y, z = x - m[0], y - m[1], z - m[2]
        m[3] += x
        m[4] += y
        m[5] += z
        m[6] += x * x
        m[7] += y * y
        m[8] += z * z
        m[9] += x * y
        m[10] += x * z
        m[11] += y * z


@njit(cache=True, nogil=True)
def _describe(counts, moments, values):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Turn each cell's moments into its features."""
    for sector in range(counts.shape[0]):
        for ring in range(counts.shape[1]):
            n = counts[sector, ring]
            if n < 3:
                continue
            m, out = moments[sector, ring], values[sector, ring]
            mx, my, mz = m[3] / n, m[4] / n, m[5] / n
            xx, yy, zz = m[6] / n - mx * mx, m[7] / n - my * my, m[8] / n - mz * mz
            xy, xz, yz = m[9] / n - mx * my, m[10] / n - mx * mz, m[11] / n - my * mz
            l1, l2, l3 = eigenvalues(xx, yy, zz, xy, xz, yz)
            out[0] = np.sqrt(l3)
            out[1] = np.sqrt(normal_z_squared(xx, yy, xy, l1, l2, l3))
            out[2] = (l2 - l3) / l1 if l1 > 0 else 0.0
            out[3], out[4] = m[12], m[13] - m[12]


@njit(cache=True, nogil=True)
def eigenvalues(xx, yy, zz, xy, xz, yz):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return the eigenvalues of a covariance, the largest first, in closed form.

    The largest comes from the trigonometric solution of the cubic; sum and product of the other two
    follow from trace and determinant, which keeps the smallest one exact on flat ground.
    """
    trace = xx + yy + zz
    q = trace / 3
    off = xy * xy + xz * xz + yz * yz
    a, b, c = xx - q, yy - q, zz - q
    p = np.sqrt(max((a * a + b * b + c * c + 2 * off) / 6, 0.0))
    if p <= 1e-15 * max(q, 1e-300):
        return max(q, 0.0), max(q, 0.0), max(q, 0.0)
    half_det = (a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)) / 2
    angle = np.arccos(min(max(half_det / (p * p * p), -1.0), 1.0)) / 3
    l1 = q + 2 * p * np.cos(angle)
    det = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz)
    rest = max(trace - l1, 0.0)
    product = max(det / l1, 0.0)
    root = np.sqrt(max(rest * rest - 4 * product, 0.0))
    l2 = (rest + root) / 2
    l3 = product / l2 if l2 > 0 else 0.0
    return l1, l2, min(l3, l2)


@njit(cache=True, nogil=True)
def normal_z_squared(xx, yy, xy, l1, l2, l3):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN201
    """Return the squared z of the unit eigenvector of ``l3`` from the eigenvalues alone.

    The identity of eigenvectors from eigenvalues: the characteristic polynomial of the minor
    without z, over the product of the gaps. Zero where the normal is undefined (a line, a ball).
    """
    gaps = (l1 - l3) * (l2 - l3)
    if gaps <= 1e-12 * l1 * l1:
        return 0.0
    minor = (xx - l3) * (yy - l3) - xy * xy
    return min(max(minor / gaps, 0.0), 1.0)
