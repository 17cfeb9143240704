"""Camera: where it sees points, and which rays its pixels have."""

import numpy as np
import pytest

from andabata.report.rendering.camera import Camera


@pytest.fixture
def camera():
    """Return a camera behind and above the origin that looks along x."""
    return Camera.looking_at(np.array([-8.0, 0.0, 5.0]), np.array([4.0, 0.0, 0.0]), (480, 300))


def test_the_target_is_in_the_middle(camera):
    """Its depth is its distance."""
    (found,) = camera.project(np.array([[4.0, 0.0, 0.0]]))
    assert found == pytest.approx([240, 150, np.hypot(12, 5)])


def test_a_point_ahead_is_above_and_one_on_the_left_is_left(camera):
    """Columns grow to the right, rows downwards."""
    here, ahead, left, up = camera.project(
        np.array([[0, 0, 0], [5, 0, 0], [0, 2, 0], [0, 0, 1]], float)
    )
    assert ahead[0] == pytest.approx(here[0]) == pytest.approx(240)
    assert ahead[1] < here[1]
    assert left[0] < here[0]
    assert up[1] < here[1]


def test_a_point_behind_the_camera_is_nowhere(camera):
    """Its row, column and depth are NaN."""
    assert np.isnan(camera.project(np.array([[-30.0, 0.0, 5.0]]))).all()


def test_the_ray_of_a_pixel_goes_through_the_point_projected_there(camera):
    """Rays and projection are each other's inverse; directions are unit vectors."""
    directions = camera.directions()
    assert np.linalg.norm(directions, axis=1) == pytest.approx(1.0)
    row, column = 200, 123
    ray = directions[row * camera.width + column]
    ((x, y, depth),) = camera.project((camera.place + 9 * ray)[None])
    assert (x, y) == pytest.approx((column + 0.5, row + 0.5))
    assert depth == pytest.approx(9 * ray @ camera.axes[2])


def test_samples_make_the_same_picture_larger(camera):
    """Places in the picture scale with the samples, and lengths with them."""
    point = np.array([[1.0, 2.0, 0.5]])
    once, twice = camera.project(point)[0], camera.sampled(2).project(point)[0]
    assert twice == pytest.approx(once * [2, 2, 1])
    assert camera.pixels(0.5, once[2]) == pytest.approx(0.9 * 480 * 0.5 / once[2])
