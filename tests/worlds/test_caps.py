"""Caps of low objects: what of them rises more than a step."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.objects import frustum
from worlds.caps import low_caps

# A cone that is cut at 8 cm: 0.5 m wide on the ground, 0.3 m at 5 cm, 0.18 m at its top.
CONE = frustum(SemanticClass.ROCK, (2.0, 1.0, 0.0), (0.5, 0.18), 0.08, 24)


def area(world):
    """Return the area of the caps [m2]."""
    return low_caps(world).sum() * world.truth.cell**2


def test_a_cap_is_the_section_at_a_step(make_ground):
    """A cone of 0.5 m has one of 0.3 m, half a cell more included; its foot has none."""
    world = make_ground(objects=(CONE,))
    assert area(world) == pytest.approx(np.pi * 0.35**2, rel=0.2)
    caps = low_caps(world)
    i, j = (int((place - world.truth.x_min) / world.truth.cell) for place in (2.0, 1.0))
    assert caps[i, j]
    assert not caps[i + 4, j]
    assert not caps[: i - 4].any()


@pytest.mark.parametrize("height", [0.045, 0.2])
def test_what_is_lower_or_higher_has_none(make_ground, height):
    """A wheel climbs the one, and the whole of the other is solid."""
    other = frustum(SemanticClass.ROCK, (2.0, 1.0, 0.0), (0.5, 0.18), height, 24)
    assert area(make_ground(objects=(other,))) == 0.0


def test_on_a_slope_heights_are_above_the_ground(make_ground):
    """A cone that stands on its slope has the same cap."""
    level = CONE.vertices.copy()
    level[:, 2] += np.float32(0.2) * level[:, 0]
    tilted = type(CONE)(CONE.semantic, level, CONE.triangles)
    world = make_ground(lambda x, y: 0.2 * x, objects=(tilted,))
    assert area(world) == pytest.approx(np.pi * 0.35**2, rel=0.2)
