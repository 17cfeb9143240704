"""Attitude of a body on its wheels: known answers on planes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from andabata.machine.wheel_contact import fit_wheel_plane, quaternion

WHEELS = np.array([[x, y] for x in (0.2, -0.2) for y in (0.23, -0.23)])
CELL = 0.1


def plane(slope_x, slope_y, n=41):
    """Return heights of a plane through the origin."""
    lines = (np.arange(n) - (n - 1) / 2) * CELL
    x, y = np.meshgrid(lines, lines, indexing="ij")
    return (slope_x * x + slope_y * y + 1.0).astype(np.float32)


@pytest.mark.parametrize("yaw", [0.0, 0.7, np.pi / 2, -2.0])
def test_on_a_plane_the_body_stands_normal_to_it(yaw):
    """Height is the plane's, and the body's up axis is the plane's normal."""
    c, s = np.cos(yaw), np.sin(yaw)
    height, roll, pitch = fit_wheel_plane(plane(0.2, -0.1), CELL, 0.5, -0.3, c, s, WHEELS)
    assert height == pytest.approx(1.0 + 0.1 + 0.03, abs=1e-6)
    up = Rotation.from_euler("ZYX", [yaw, pitch, roll]).apply([0, 0, 1])
    normal = np.array([-0.2, 0.1, 1.0]) / np.linalg.norm([-0.2, 0.1, 1.0])
    np.testing.assert_allclose(up, normal, atol=1e-6)


def test_uphill_ahead_is_a_negative_pitch_and_uphill_left_a_positive_roll():
    """Signs follow REP-103."""
    _, roll, pitch = fit_wheel_plane(plane(0.2, 0.0), CELL, 0.0, 0.0, 1.0, 0.0, WHEELS)
    assert (roll, pitch) == pytest.approx((0.0, -np.arctan(0.2)), abs=1e-6)
    _, roll, pitch = fit_wheel_plane(plane(0.0, 0.2), CELL, 0.0, 0.0, 1.0, 0.0, WHEELS)
    assert (roll, pitch) == pytest.approx((np.arctan(0.2), 0.0), abs=1e-6)


def test_beyond_the_border_the_ground_continues_level():
    """A body outside of the ground stands at the height of its border."""
    height, _, _ = fit_wheel_plane(plane(0.2, 0.0), CELL, 50.0, 0.0, 1.0, 0.0, WHEELS)
    assert height == pytest.approx(1.4, abs=1e-6)


@pytest.mark.parametrize("angles", [(0.0, 0.0, 2.0), (0.1, -0.2, -3.0), (-0.4, 0.3, 0.5)])
def test_quaternions_are_scipys(angles):
    """The quaternion equals scipy's for intrinsic z-y-x angles."""
    expected = Rotation.from_euler("ZYX", angles[::-1]).as_quat()
    found = np.array(quaternion(*angles))
    np.testing.assert_allclose(found * np.sign(found @ expected), expected, atol=1e-12)
