"""Drag of plants: where it is, how large, and how it acts."""

from dataclasses import replace

import numpy as np
import pytest

from terrain.classes import TRAITS, SemanticClass
from terrain.objects import box
from worlds.drag import NO_DRAG, RESISTANCE, SLOWEST, braking, drag_at, drag_map


def planted(make_ground, kind, height, foot=0.0, x=2.0):
    """Return a world with plants, 2 m wide, of a height above their foot."""
    middle = foot + height / 2
    return make_ground(objects=[box(kind, (x, 0.0, middle), (2.0, 2.0, height))])


def at(drag, x, y=0.0, heading=0.0, half=0.0):
    return drag_at(drag, x, y, np.cos(heading), np.sin(heading), half)


@pytest.mark.parametrize("kind", RESISTANCE)
def test_force_is_the_classes_by_the_height_against_the_body(make_ground, kind):
    """Half a metre of plants drag with half of the rate; solid things do not drag."""
    drag = drag_map(planted(make_ground, kind, 0.5))
    assert at(drag, 2.0) == pytest.approx(0.5 * RESISTANCE[kind], abs=1.0)
    assert at(drag, 3.2) == at(drag, 0.8) == at(drag, 2.0, 1.2) == 0.0
    assert not TRAITS[kind].solid


def test_what_is_above_the_body_does_not_drag(make_ground):
    """Of a bush of 2 m it is the lower 0.8 m, of a crown at 0.5 m the 0.3 m up to there."""
    rate = RESISTANCE[SemanticClass.BUSH]
    high = drag_map(planted(make_ground, SemanticClass.BUSH, 2.0))
    assert at(high, 2.0) == pytest.approx(0.8 * rate, abs=1.0)
    crown = drag_map(planted(make_ground, SemanticClass.BUSH, 2.0, foot=0.5))
    assert at(crown, 2.0) == pytest.approx(0.3 * rate, abs=1.0)
    assert drag_map(planted(make_ground, SemanticClass.BUSH, 2.0, foot=0.9)) is NO_DRAG


def test_the_strongest_of_overlapping_plants_counts(make_ground):
    """Whatever their order."""
    grass = box(SemanticClass.HIGH_GRASS, (2.0, 0.0, 0.4), (4.0, 4.0, 0.8))
    bush = box(SemanticClass.BUSH, (2.0, 0.0, 0.4), (1.0, 1.0, 0.8))
    world = make_ground(objects=[bush, grass])
    for objects in (world.objects, world.objects[::-1]):
        drag = drag_map(replace(world, objects=objects))
        assert at(drag, 2.0) == pytest.approx(200.0, abs=1.0)
        assert at(drag, 3.0) == pytest.approx(48.0, abs=1.0)


def test_a_body_that_is_half_in_feels_half(make_ground):
    """Five places along its middle line count, turned with it, and none outside of the map."""
    drag = drag_map(planted(make_ground, SemanticClass.BUSH, 0.8))
    assert at(drag, 0.85, half=0.33) == pytest.approx(200.0 * 2 / 5, abs=1.0)
    assert at(drag, 0.85, heading=np.pi / 2, half=0.33) == 0.0
    assert at(drag, -50.0, half=0.3) == at(drag, 2.0, -0.0, 0.0, 100.0) - 40.0 == 0.0


def test_a_world_without_plants_has_no_map(make_ground):
    """Rocks and walls are no plants."""
    assert drag_map(make_ground()) is NO_DRAG
    assert drag_map(planted(make_ground, SemanticClass.WALL, 1.0)) is NO_DRAG


def test_the_force_is_the_same_at_any_speed_and_rises_up_to_it():
    """The rate times the speed is the force; below the slowest speed it is less."""
    for speed in (SLOWEST, 0.3, 2.0):
        assert braking(50.0, speed) * speed == pytest.approx(50.0)
    assert braking(50.0, SLOWEST / 2) * SLOWEST / 2 == pytest.approx(25.0)
    assert np.isfinite(braking(50.0, 0.0))
