"""Is a cloud level? The ground around the robot tells."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

_REACH = 5.0
_SQUARE = 0.5
_ROUNDS = 12
_CLOSE = 0.10
_FEWEST = 12


def ground_plane(points: NDArray[np.float32]) -> tuple[NDArray[np.float64], float] | None:
    """Return the plane of the ground within 5 m: its upward unit normal and its height.

    The lowest points of half-metre squares are fitted again and again, those that stand higher than
    10 cm above the plane counting less and less, until what stands on the ground is out.

    Args:
        points: In ``base_footprint`` or in a frame that should be level [m], shape (n, 3).

    Returns:
        Normal, shape (3,), and z of the plane under the origin [m], or None with too few points.
    """
    near = points[np.hypot(points[:, 0], points[:, 1]) < _REACH].astype(np.float64)
    near = near[np.isfinite(near).all(axis=1)]
    lowest = _lowest_of_squares(near)
    if len(lowest) < _FEWEST:
        return None
    design = np.column_stack([lowest[:, :2], np.ones(len(lowest))])
    weight = np.ones(len(lowest))
    for _ in range(_ROUNDS):
        root = np.sqrt(weight)[:, None]
        fit, *_ = np.linalg.lstsq(design * root, lowest[:, 2] * root[:, 0], rcond=None)
        above = lowest[:, 2] - design @ fit
        weight = 1.0 / (1.0 + (np.maximum(above, 0.3 * np.abs(above)) / _CLOSE) ** 2)
    normal = np.array([-fit[0], -fit[1], 1.0])
    return normal / np.linalg.norm(normal), float(fit[2])


def _lowest_of_squares(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the lowest point of each square that has any."""
    if not len(points):
        return points
    squares = np.floor(points[:, :2] / _SQUARE).astype(np.int64)
    order = np.lexsort((points[:, 2], squares[:, 1], squares[:, 0]))
    first = np.ones(len(order), dtype=bool)
    first[1:] = (np.diff(squares[order], axis=0) != 0).any(axis=1)
    return points[order[first]]


def tilt_of(normal: NDArray[np.float64]) -> float:
    """Return the angle between a plane's normal and the vertical [rad]."""
    return float(np.arccos(np.clip(normal[2], -1.0, 1.0)))


def levelled(
    points: NDArray[np.float32], plane: tuple[NDArray[np.float64], float]
) -> NDArray[np.float32]:
    """Return the points turned and shifted so that the plane becomes z = 0.

    Args:
        points: [m], shape (n, 3).
        plane: Of ``ground_plane``.
    """
    normal, height = plane
    turn, _ = Rotation.align_vectors([[0.0, 0.0, 1.0]], [normal])
    moved = points - np.array([0.0, 0.0, height], dtype=np.float32)
    return moved @ turn.as_matrix().T.astype(np.float32)
