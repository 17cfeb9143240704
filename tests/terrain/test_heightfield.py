"""The heightfield: known heights, and triangles that are the same surface."""

import numpy as np
import pytest

from terrain.heightfield import Heightfield


def plane(slope_x, slope_y, n=11, cell=0.5):
    """Return a plane of two slopes through the origin."""
    x = (np.arange(n) - (n - 1) / 2) * cell
    return Heightfield((slope_x * x[:, None] + slope_y * x[None, :]).astype(np.float32), cell)


def test_heights_of_a_plane_are_the_planes():
    """Interpolation reproduces a plane."""
    ground = plane(0.3, -0.2)
    x, y = np.random.default_rng(0).uniform(-2.4, 2.4, (2, 50))
    np.testing.assert_allclose(ground.height_at(x, y), 0.3 * x - 0.2 * y, atol=1e-6)


def test_x_is_the_first_axis():
    """The first index of the heights is x, the second y."""
    heights = np.zeros((3, 3), dtype=np.float32)
    heights[2, 1] = 1.0
    assert Heightfield(heights, 1.0).height_at(1.0, 0.0) == pytest.approx(1.0)
    assert Heightfield(heights, 1.0).height_at(0.0, 1.0) == pytest.approx(0.0)


def test_places_may_be_of_any_shape():
    """One place is a scalar, rows and columns make a grid, and no place has no height."""
    ground = plane(0.3, -0.2)
    x, y = np.linspace(-2, 2, 7), np.linspace(-1, 1, 4)
    grid = ground.height_at(x[:, None], y[None, :])
    assert grid.shape == (7, 4)
    for i, j in ((0, 0), (2, 3), (6, 1)):
        alone = ground.height_at(float(x[i]), float(y[j]))
        assert alone.shape == ()
        assert alone == grid[i, j] == pytest.approx(0.3 * x[i] - 0.2 * y[j])
    assert ground.height_at(np.empty(0), np.empty(0)).shape == (0,)
    assert np.isnan(ground.height_at(np.array([np.nan, 0.0]), np.array([0.0, np.nan]))).all()


def test_triangles_face_upwards_and_lie_on_the_surface():
    """Normals point up, and the centre of each triangle is on the surface."""
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


def test_the_diagonal_is_that_of_pybullet():
    """A raised corner (0, 0) is felt in one triangle only, a raised corner (1, 0) in both."""
    heights = np.zeros((2, 2), dtype=np.float32)
    heights[0, 0] = 1.0
    ground = Heightfield(heights, 1.0)
    assert ground.height_at(-0.25, -0.25) == pytest.approx(0.5)
    assert ground.height_at(0.25, 0.25) == 0.0
    heights = np.zeros((2, 2), dtype=np.float32)
    heights[1, 0] = 1.0
    assert Heightfield(heights, 1.0).height_at(0.0, 0.0) == pytest.approx(0.5)


def test_beyond_the_border_the_ground_is_that_of_the_border():
    """Places outside have the height of the nearest place inside."""
    ground = plane(0.3, -0.2)
    assert ground.height_at(99.0, 1.0) == pytest.approx(float(ground.height_at(2.5, 1.0)))
    assert ground.height_at(-1.0, -99.0) == pytest.approx(float(ground.height_at(-1.0, -2.5)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"heights": np.full((3, 3), np.nan, dtype=np.float32)}, "expected finite values, got NaN"),
        ({"heights": np.zeros((1, 3), dtype=np.float32)}, "at least 2 x 2, got"),
        ({"heights": np.zeros((3, 3))}, "expected float32, got float64"),
        ({"cell": 0.0}, "expected a positive length"),
    ],
)
def test_nonsense_is_refused(change, message):
    """Shape, type and values are checked when the heightfield is made."""
    good = {"heights": np.zeros((3, 3), dtype=np.float32), "cell": 1.0}
    with pytest.raises(ValueError, match=message):
        Heightfield(**(good | change))


def test_heights_are_read_only():
    """A heightfield does not change under its readers."""
    with pytest.raises(ValueError, match="read-only"):
        plane(0.0, 0.0).heights[0, 0] = 1.0


def test_a_finer_grid_is_the_same_surface():
    """Nodes of the coarse grid stay, and any place has its height; a factor of 1 is the field."""
    rng = np.random.default_rng(0)
    field = Heightfield(rng.normal(0, 1, (5, 7)).astype(np.float32), 0.5)
    fine = field.refined(3)
    assert fine.cell == pytest.approx(0.5 / 3)
    assert (fine.width, fine.depth) == pytest.approx((field.width, field.depth))
    np.testing.assert_allclose(fine.heights[::3, ::3], field.heights, atol=1e-6)
    x, y = rng.uniform(-1.5, 1.5, (2, 500))
    np.testing.assert_allclose(fine.height_at(x, y), field.height_at(x, y), atol=2e-6)
    assert field.refined(1) is field
    with pytest.raises(ValueError, match="factor: expected 1 or more, got 0"):
        field.refined(0)
