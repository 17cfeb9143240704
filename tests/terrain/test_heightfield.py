"""The ground: known heights, triangles that are the same surface."""

import numpy as np
import pytest

from terrain.heightfield import Heightfield


def plane(slope_x, slope_y, n=11, cell=0.5):
    x = (np.arange(n) - (n - 1) / 2) * cell
    return Heightfield((slope_x * x[:, None] + slope_y * x[None, :]).astype(np.float32), cell)


def test_heights_of_a_plane_are_the_planes():
    ground = plane(0.3, -0.2)
    x, y = np.random.default_rng(0).uniform(-2.4, 2.4, (2, 50))
    np.testing.assert_allclose(ground.height_at(x, y), 0.3 * x - 0.2 * y, atol=1e-6)


def test_x_is_the_first_axis():
    heights = np.zeros((3, 3), dtype=np.float32)
    heights[2, 1] = 1.0
    assert Heightfield(heights, 1.0).height_at(1.0, 0.0) == pytest.approx(1.0)
    assert Heightfield(heights, 1.0).height_at(0.0, 1.0) == pytest.approx(0.0)


def test_triangles_face_upwards_and_lie_on_the_surface():
    heights = np.random.default_rng(1).normal(size=(6, 5)).astype(np.float32)
    ground = Heightfield(heights, 0.7)
    vertices, triangles = ground.triangles()
    corners = vertices[triangles].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (normals[:, 2] > 0).all()
    middles = corners.mean(axis=1)
    np.testing.assert_allclose(
        ground.height_at(middles[:, 0], middles[:, 1]), middles[:, 2], atol=1e-5
    )


def test_heights_that_are_not_finite_are_refused():
    heights = np.zeros((3, 3), dtype=np.float32)
    heights[1, 1] = np.nan
    with pytest.raises(ValueError, match="expected finite values, got NaN"):
        Heightfield(heights, 1.0)
