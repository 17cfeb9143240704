"""Canvas: what is nearer shows, and lines, discs and triangles lie where they are."""

import numpy as np
import pytest

from andabata.report.rendering.camera import Camera
from andabata.report.rendering.canvas import Canvas

RED, BLUE, BLACK = (np.array(each, dtype=float) for each in ((255, 0, 0), (0, 0, 255), (0, 0, 0)))
CAMERA = Camera.looking_at(np.array([0.0, 0.0, 0.0]), np.array([10.0, 0.0, 0.0]), (100, 60), 1.0)


def canvas(depth=np.inf):
    """Return a black canvas at a depth."""
    count = CAMERA.width * CAMERA.height
    return Canvas.of(CAMERA, np.zeros((count, 3)), np.full(count, depth))


def covered(drawn, colour):
    """Return rows and columns of the pixels of a colour, shape (k, 2)."""
    return np.argwhere((drawn.colours == colour).all(axis=2))


def test_a_disc_has_its_size_and_place():
    """A disc of 1 m at 10 m, with a focal length of 100 pixels, has a radius of 10 pixels."""
    drawn = canvas()
    drawn.discs(np.array([[10.0, 0.0, 0.0]]), 1.0, RED)
    there = covered(drawn, RED)
    assert len(there) == pytest.approx(np.pi * 10**2, rel=0.05)
    assert there.mean(axis=0) == pytest.approx([29.5, 49.5], abs=0.6)
    assert drawn.depths[30, 50] == pytest.approx(10.0)


def test_the_nearer_one_shows_whatever_the_order():
    """Depth decides, not the order of drawing; what lies behind the view's own depth is hidden."""
    near, far = np.array([[5.0, 0.0, 0.0]]), np.array([[10.0, 0.0, 0.0]])
    for first, second in (((near, RED), (far, BLUE)), ((far, BLUE), (near, RED))):
        drawn = canvas()
        for place, colour in (first, second):
            drawn.discs(place, 0.3, colour)
        assert (drawn.colours[30, 50] == RED).all()
    hidden = canvas(8.0)
    hidden.discs(far, 0.3, BLUE)
    assert len(covered(hidden, BLUE)) == 0
    hidden.discs(far, 0.3, BLUE, lift=2.5)
    assert len(covered(hidden, BLUE)) > 0


def test_the_smallest_disc_is_a_pixel_and_what_is_outside_is_nowhere():
    """Far points stay visible; points behind the camera and beside the picture are left out."""
    drawn = canvas()
    places = np.array([[50.0, 0.0, 0.0], [-5.0, 0.0, 0.0], [5.0, 90.0, 0.0]])
    drawn.discs(places, 0.001, RED)
    assert covered(drawn, RED).tolist() == [[30, 50]]


def test_a_line_goes_from_end_to_end_with_its_width():
    """It covers the columns between its ends, and twice its radius across."""
    drawn = canvas()
    drawn.lines(np.array([[10.0, 2, 0]]), np.array([[10.0, -2, 0]]), (0.2, 0.2), RED)
    there = covered(drawn, RED)
    assert (there[:, 1].min(), there[:, 1].max()) == pytest.approx((28, 71), abs=1)
    assert np.ptp(there[there[:, 1] == 50][:, 0]) + 1 == pytest.approx(4, abs=1)


def test_a_line_into_the_distance_has_the_depth_of_its_places():
    """Halfway in the picture is the harmonic mean of the depths."""
    drawn = canvas()
    drawn.lines(np.array([[4.0, 0, -0.5]]), np.array([[12.0, 0, -0.5]]), (0.01, 0.01), RED)
    rows = covered(drawn, RED)[:, 0]
    assert drawn.depths[rows.max(), 50] == pytest.approx(4.0, rel=0.1)
    assert drawn.depths[rows.min(), 50] == pytest.approx(12.0, rel=0.15)
    middle = round((rows.min() + rows.max()) / 2)
    assert drawn.depths[middle, 50] == pytest.approx(6.0, rel=0.1)


def test_a_strip_joins_its_places_and_one_place_is_none():
    """Two corners make a line."""
    drawn = canvas()
    drawn.strip(np.array([[10.0, 0, 0]]), 0.1, RED)
    assert len(covered(drawn, RED)) == 0
    drawn.strip(np.array([[10.0, 2, 0], [10.0, 0, 0], [10.0, 0, 2]]), 0.1, RED)
    there = covered(drawn, RED)
    assert there[:, 1].min() < 32
    assert there[:, 0].min() < 12


def test_a_triangle_covers_its_inside_at_its_depth():
    """Either winding shows; half of a square of 4 m at 10 m has 800 pixels."""
    corners = np.array([[10.0, 2, -2], [10.0, -2, -2], [10.0, -2, 2]])
    for order in ((0, 1, 2), (2, 1, 0)):
        drawn = canvas()
        drawn.triangles(corners[None, order], RED[None])
        there = covered(drawn, RED)
        assert len(there) == pytest.approx(800, rel=0.05)
        assert drawn.depths[tuple(there.T)] == pytest.approx(10.0)
    behind = canvas()
    behind.triangles(-corners[None], RED[None])
    assert len(covered(behind, RED)) == 0


def test_pixels_are_means_of_their_samples():
    """Four samples of which one is white make a quarter of white."""
    drawn = canvas()
    drawn.colours[0, 0] = 200
    found = drawn.pixels(2)
    assert found.shape == (30, 50, 3)
    assert found[0, 0].tolist() == [50, 50, 50]
    assert found[1:].max() == 0
