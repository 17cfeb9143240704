"""Ground plane of a cloud, and levelling of clouds by it."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

_MAX_RANGE = 5.0
"""Distance within which the ground is sought [m]."""

_CELL = 0.5
"""Edge of the grid cells whose lowest points are fitted [m]."""

_N_ITERATIONS = 12
"""Number of fits, each with the weights of the one before."""

_SCALE = 0.10
"""Height above the plane at which a point has half its weight [m]."""

_MIN_CELLS = 12
"""Number of grid cells with points that make a plane."""


def ground_plane(points: NDArray[np.float32]) -> tuple[NDArray[np.float64], float] | None:
    """Fit the ground plane within 5 m and return its upward unit normal and its height.

    The lowest points of half-metre grid cells are fitted by iteratively reweighted least squares:
    the higher a point lies above the plane, the less it counts, so that objects drop out.

    Args:
        points: Points in ``base_footprint`` or in a frame that should be level [m], float32, shape
            (n, 3).

    Returns:
        Normal, shape (3,), and z of the plane under the origin [m], or None with too few points.
    """
    near = points[np.hypot(points[:, 0], points[:, 1]) < _MAX_RANGE].astype(np.float64)
    near = near[np.isfinite(near).all(axis=1)]
    lowest = _lowest_of_cells(near)
    if len(lowest) < _MIN_CELLS:
        return None
    design = np.column_stack([lowest[:, :2], np.ones(len(lowest))])
    weight = np.ones(len(lowest))
    for _ in range(_N_ITERATIONS):
        root = np.sqrt(weight)[:, None]
        fit, *_ = np.linalg.lstsq(design * root, lowest[:, 2] * root[:, 0], rcond=None)
        above = lowest[:, 2] - design @ fit
        # Cauchy weights; points below the plane count for more, since they are ground for certain.
        weight = 1.0 / (1.0 + (np.maximum(above, 0.3 * np.abs(above)) / _SCALE) ** 2)
    normal = np.array([-fit[0], -fit[1], 1.0])
    return normal / np.linalg.norm(normal), float(fit[2])


def _lowest_of_cells(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lowest point of each grid cell that has any, shape (m, 3)."""
    if not len(points):
        return points
    cells = np.floor(points[:, :2] / _CELL).astype(np.int64)
    order = np.lexsort((points[:, 2], cells[:, 1], cells[:, 0]))
    first = np.ones(len(order), dtype=bool)
    first[1:] = (np.diff(cells[order], axis=0) != 0).any(axis=1)
    return points[order[first]]


def tilt_of(normal: NDArray[np.float64]) -> float:
    """Return the angle between a plane's upward unit normal and the vertical [rad]."""
    return float(np.arccos(np.clip(normal[2], -1.0, 1.0)))


def levelled(
    points: NDArray[np.float32],
    plane: tuple[NDArray[np.float64], float],
    pivot: NDArray[np.float64] | None = None,
) -> NDArray[np.float32]:
    """Return the points turned and shifted so that the plane becomes z = 0.

    Args:
        points: Points [m], float32, shape (n, 3).
        plane: Normal and height of ``ground_plane``.
        pivot: Point that keeps its x, its y and its distance from the plane [m], such as the
            sensor, shape (3,); None for the plane's point under the origin.

    Returns:
        float32, shape (n, 3).
    """
    normal, height = plane
    foot = np.array([0.0, 0.0, height])
    centre = foot if pivot is None else pivot
    turn, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [normal])
    moved = points - centre.astype(np.float32)
    place = np.array([centre[0], centre[1], normal @ (centre - foot)], dtype=np.float32)
    return moved @ turn.as_matrix().T.astype(np.float32) + place
