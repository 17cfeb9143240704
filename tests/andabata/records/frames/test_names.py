"""Names of frames: namespaces, bases, the world, and rotations by convention."""

import numpy as np
import pytest

from andabata.records.frames.names import (
    is_base,
    is_world,
    local_name,
    namespace_of,
    rotation_by_name,
)


@pytest.mark.parametrize(
    ("name", "tail", "robot"),
    [
        ("base_link", "base_link", ""),
        ("/base_link", "base_link", ""),
        ("base_footprint/", "base_footprint", ""),
        ("husky1/base_footprint", "base_footprint", "husky1"),
        ("/fleet/husky1/base_link", "base_link", "fleet/husky1"),
        (" base_link ", "base_link", ""),
    ],
)
def test_slashes_and_namespaces_change_no_meaning(name, tail, robot):
    """Slashes and spaces around a name are ignored, and a namespace is split off."""
    assert local_name(name) == tail
    assert namespace_of(name) == robot
    assert is_base(name)


def test_other_names_are_no_base():
    """Case and suffixes count; frames of the world are known by name."""
    assert not any(map(is_base, ("Base_Link", "camera_base_link", "lidar", "", "base")))
    assert all(map(is_world, ("map", "/odom", "husky1/odom", "camera_init", "odom_combined")))
    assert not any(map(is_world, ("lidar_map", "base_link", "os_lidar")))


def test_optical_and_ned_axes_point_left_and_down():
    """Axes of optical and NED frames follow REP-103; other names imply nothing."""
    optical, ned = rotation_by_name("x_optical_frame")[0], rotation_by_name("x_ned")[0]
    np.testing.assert_allclose(optical.apply([-1, 0, 0]), [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(ned.apply([0, -1, 0]), [0, 1, 0], atol=1e-12)
    assert rotation_by_name("os_sensor") is None
