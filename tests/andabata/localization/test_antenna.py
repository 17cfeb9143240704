"""Lever arm of the antenna: known answers."""

import numpy as np
from scipy.spatial.transform import Rotation

from andabata.localization.antenna import remove_lever_arm

FIXES = np.array([[1.0, 5.0, 6.0, 7.0, 0.5, 1.0], [2.0, 8.0, 6.0, 7.0, 0.5, 1.0]])


def test_the_lever_arm_is_turned_into_the_map_and_subtracted():
    """With the base facing north, an antenna ahead of it lies north: the base is south of it."""
    quaternion = Rotation.from_euler("z", np.pi / 2).as_quat()
    moved = remove_lever_arm(FIXES, quaternion, np.array([1.0, 0.2, 0.5]))
    np.testing.assert_allclose(moved[:, 1:4] - FIXES[:, 1:4], [[0.2, -1.0, -0.5]] * 2, atol=1e-12)
    np.testing.assert_array_equal(moved[:, [0, 4, 5]], FIXES[:, [0, 4, 5]])
    assert FIXES[0, 1] == 5.0


def test_without_a_lever_arm_fixes_are_unchanged():
    """Without an antenna, or without fixes, the very same rows come back."""
    quaternion = np.array([0, 0, 0, 1.0])
    assert remove_lever_arm(FIXES, quaternion, None) is FIXES
    empty = FIXES[:0]
    assert remove_lever_arm(empty, quaternion, np.ones(3)) is empty
