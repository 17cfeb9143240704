"""Scenery: what a camera sees of a world, and contour lines."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.report.rendering.camera import Camera
from andabata.report.rendering.lighting import SKY
from andabata.report.rendering.scenery import Scenery, contour_lines
from terrain.classes import SemanticClass
from terrain.objects import box


def camera(place=(-6.0, 0.0, 4.0), target=(0.0, 0.0, 0.0)):
    """Return a small camera."""
    return Camera.looking_at(np.array(place), np.array(target), (120, 80))


@pytest.fixture
def walled(make_scene):
    """Return the scenery of level ground with a wall in its middle."""
    world = make_scene().world
    wall = box(SemanticClass.WALL, (0.0, 0.0, 0.5), (0.4, 2.0, 1.0))
    return Scenery(replace(world, objects=(wall,)))


def test_the_middle_of_the_picture_shows_what_the_camera_looks_at(walled):
    """The wall's near face, at its place and depth."""
    view = walled.view(camera(target=(0.0, 0.0, 0.5)))
    hit = view.hits.reshape(80, 120, 3)[40, 60]
    assert hit[0] == pytest.approx(-0.2, abs=0.05)
    depth = view.depths.reshape(80, 120)[40, 60]
    assert depth == pytest.approx(np.linalg.norm(hit - view.camera.place), rel=0.01)


def test_objects_before_a_distance_are_left_out_and_ground_is_not(make_scene):
    """A wall between camera and target hides it, but not from a distance behind the wall."""
    wall = box(SemanticClass.WALL, (-3.0, 0.0, 1.5), (0.4, 2.0, 3.0))
    scenery = Scenery(replace(make_scene().world, objects=(wall,)))
    hidden, shown = (scenery.view(camera(), near).hits.reshape(80, 120, 3) for near in (0.0, 6.0))
    assert hidden[40, 60, 0] == pytest.approx(-3.2, abs=0.05)
    assert shown[40, 60] == pytest.approx([0.0, 0.0, 0.0], abs=0.1)
    # The lowest row shows ground nearer than that.
    assert np.linalg.norm(shown[79, 5] - camera().place) < 6.0
    assert shown[79, 5, 2] == pytest.approx(0.0, abs=0.01)


def test_above_the_horizon_is_sky(walled):
    """It is infinitely far, and has the sky's colour; on paper it is white."""
    view = walled.view(camera(target=(0.0, 0.0, 4.0)))
    assert np.isinf(view.depths.reshape(80, 120)[0]).all()
    assert view.canvas().colours[0, 0] == pytest.approx(SKY)
    assert view.canvas(in_haze=False).colours[0, 0].tolist() == [255, 255, 255]


def test_contour_lines_are_a_metre_apart():
    """A ramp of 40 pixels a metre has a line every 40 rows, and level ground has none."""
    ramp = np.repeat(np.arange(200)[:, None] / 40 + 0.0125, 5, axis=1)
    rows = np.flatnonzero(contour_lines(ramp)[:, 2] > 0.5)
    rows = rows[(rows > 20) & (rows < 180)]
    middles = [group.mean() for group in np.split(rows, np.flatnonzero(np.diff(rows) > 1) + 1)]
    assert middles == pytest.approx([39.5, 79.5, 119.5, 159.5], abs=1.0)
    assert contour_lines(np.full((9, 9), 3.0)).max() == 0.0
    assert contour_lines(np.repeat(np.arange(20.0)[:, None], 5, axis=1)).max() == 0.0
