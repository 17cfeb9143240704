"""Light: slopes to the sun are bright, others dark, and objects throw shadows."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.report.rendering.lighting import SKY, SUN, GroundLight, hazy, lit
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box
from worlds.rays.scene import RayScene


def test_what_faces_the_sun_is_brightest_and_what_turns_away_is_not_black():
    """Light falls with the cosine, down to that of the sky; a shadow takes the sun's share."""
    assert np.linalg.norm(SUN) == pytest.approx(1.0, abs=1e-3)
    towards, away, across = lit(np.array([SUN, -SUN, [0.0, 0.0, 1.0]]))
    assert towards > across > away > 0.3
    assert lit(SUN[None], 0.0)[0] == pytest.approx(away)


def test_haze_grows_with_distance_and_leaves_what_is_near():
    """Near colours stay, far ones become the sky's."""
    near, middle, far = hazy(np.zeros((3, 3)), np.array([5.0, 80.0, 5000.0]))
    assert near.tolist() == [0, 0, 0]
    assert 0 < middle[0] < SKY[0]
    assert far == pytest.approx(SKY, rel=1e-3)


def test_a_slope_to_the_sun_is_brighter_than_one_away(make_scene):
    """The sun stands in the south-east: ground that falls to the south-east is bright."""
    x = np.linspace(-8, 8, 65)
    fall = (-0.2 * (x[:, None] - x[None, :]) / np.sqrt(2)).astype(np.float32)
    rays = RayScene(make_scene().world)
    to_sun, away = (GroundLight(Heightfield(sign * fall, 0.25), rays) for sign in (1, -1))
    here = np.zeros(1)
    assert to_sun.brightness(here, here) > away.brightness(here, here)
    assert to_sun.steepness(here, here) == pytest.approx([0.2], abs=1e-6)
    level = GroundLight(Heightfield(0 * fall, 0.25), rays)
    assert level.normals(here, here)[0] == pytest.approx([0, 0, 1])


def test_an_object_throws_its_shadow_away_from_the_sun(make_scene):
    """North-west of a tall box it is dark, south-east of it bright."""
    made = make_scene()
    ground = made.world.ground
    tall = box(SemanticClass.WALL, (0.0, 0.0, 1.0), (1.0, 1.0, 2.0))
    light = GroundLight(ground, RayScene(replace(made.world, objects=(tall,))))
    behind, before = light.brightness(np.array([-1.0, 1.0]), np.array([1.0, -1.0]))
    assert behind < 0.9 * before
