"""Clicks on the ground: where a ray from the camera meets it."""

import numpy as np
import pytest

from andabata.viewer.ground_click import ground_hit, plane_hit


def test_a_ray_meets_a_slope_where_it_has_sunk_to_it(make_ground):
    """On z = 0.2 x, a ray straight down ends at its own place, a slanted one further on."""
    world = make_ground(lambda x, y: 0.2 * x)
    down = ground_hit(np.array([3.0, 1.0, 9.0]), np.array([0.0, 0.0, -2.0]), world)
    assert down == pytest.approx([3.0, 1.0])
    # 5 - t = 0.2 t at t = 25 / 6.
    slanted = ground_hit(np.array([0.0, 0.0, 5.0]), np.array([1.0, 0.0, -1.0]), world)
    assert slanted == pytest.approx([25 / 6, 0.0], abs=0.1)


def test_the_sky_and_what_is_beyond_the_world_is_nowhere(make_ground):
    """No goal comes of it."""
    world = make_ground()
    assert ground_hit(np.array([0.0, 0.0, 2.0]), np.array([1.0, 0.0, 0.1]), world) is None
    assert ground_hit(np.array([0.0, 0.0, 2.0]), np.array([1.0, 0.0, -0.01]), world) is None
    assert plane_hit(np.array([0.0, 0.0, 2.0]), np.array([1.0, 0.0, 0.0]), 0.0) is None


def test_without_a_world_the_plane_under_the_robot_is_met():
    """At the height of its foot."""
    place = plane_hit(np.array([1.0, 2.0, 6.0]), np.array([2.0, 0.0, -1.0]), 1.0)
    assert place == pytest.approx([11.0, 2.0])
