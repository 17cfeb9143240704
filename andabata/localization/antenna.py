"""Lever arm of the satellite antenna."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


def remove_lever_arm(
    fixes: NDArray[np.float64],
    quaternion: NDArray[np.float64],
    antenna: NDArray[np.float64] | None,
) -> NDArray[np.float64]:
    """Return fixes of the base's origin from fixes of the antenna.

    The present attitude is used for late fixes, too: at half a radian per second, a lever arm of a
    metre and 0.15 s, the error is 8 cm, a tenth of a fix's own.

    Args:
        fixes: Rows of stamp [s], x, y, z of the antenna in the map [m], and more, shape (k, 4+).
        quaternion: Rotation from base to map, x, y, z, w.
        antenna: Position of the antenna in the base frame [m], shape (3,); None for its origin.
    """
    if antenna is None or not len(fixes):
        return fixes
    moved = fixes.copy()
    moved[:, 1:4] -= Rotation.from_quat(quaternion).apply(antenna)
    return moved
