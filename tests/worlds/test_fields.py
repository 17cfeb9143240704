"""Fields of plants: where they are said to be, and forbidden from their height on."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from worlds.fields import Field, bare_ground, draw_field, make_field, plain_world
from worlds.traversability_map import Reason

MEADOW = Field(SemanticClass.MEADOW, 0.5, 3.0, 0.0, 0.0, 0.0, 0)


def along(world, bearing, distances):
    """Return the reasons at distances along a bearing."""
    return world.truth.reason_at(np.cos(bearing) * distances, np.sin(bearing) * distances)


@pytest.mark.parametrize("bearing", [0.0, 0.7, -2.0])
def test_a_field_begins_at_its_edge_and_goes_on(bearing):
    """Before the edge all is free, behind it nothing is."""
    world = make_field(MEADOW, bearing, np.random.default_rng(0))
    assert (along(world, bearing, np.arange(0.0, 2.8, 0.1)) == Reason.FREE).all()
    assert (along(world, bearing, np.arange(3.1, 10.0, 0.1)) == Reason.VEGETATION).all()


def test_a_gradual_edge_is_free_where_it_is_low_and_trunks_are_solid():
    """Plants reach the limit of 15 cm after a share of the ramp."""
    field = Field(SemanticClass.STALKS, 0.6, 2.0, 2.0, 0.0, 0.0, 3)
    world = make_field(field, 0.0, np.random.default_rng(1))
    across = np.arange(-8, 8, 0.1)
    first = world.truth.reason_at(np.full(len(across), 2.2), across)
    behind = world.truth.reason_at(np.full(len(across), 3.6), across)
    assert (first == Reason.FREE).all()
    assert (behind != Reason.FREE).all()
    trunks = [each for each in world.objects if each.semantic is SemanticClass.TRUNK]
    assert len(trunks) == 3
    x, y, _ = trunks[0].vertices.mean(axis=0)
    assert world.truth.reason_at(float(x), float(y)) == Reason.SOLID


def test_draws_span_what_a_field_may_be():
    """Heights of 0.2 to 1.2 m, all classes, and each special case in some."""
    rng = np.random.default_rng(0)
    fields = [draw_field(rng) for _ in range(300)]
    heights = np.array([field.height for field in fields])
    assert heights.min() >= 0.2
    assert heights.max() <= 1.2
    assert np.median(heights) == pytest.approx(0.49, abs=0.06)
    assert {field.kind for field in fields} == {17, 18, 19}
    for name in ("ramp", "gaps", "slope", "trunks"):
        share = np.mean([getattr(field, name) > 0 for field in fields])
        assert 0.15 < share < 0.65, name


def test_bare_ground_has_its_slope_and_a_path_its_class():
    """The gradient is the slope's; the path lies along the x axis."""
    ground = bare_ground(0.1, np.random.default_rng(3))
    gradient = np.hypot(*np.gradient(ground.heights.astype(float), 0.1))
    np.testing.assert_allclose(gradient, np.tan(0.1), atol=1e-4)
    world = plain_world("verge", ground, path=True)
    middle = world.surface.shape[1] // 2
    assert (world.surface[:, middle - 12 : middle + 12] == SemanticClass.PATH).all()
    assert (world.surface != SemanticClass.PATH).any()


def test_bare_ground_is_level_at_the_robot_in_the_middle_of_26_m():
    """The slope turns about the origin."""
    ground = bare_ground(0.2, np.random.default_rng(5))
    assert ground.heights.shape == (261, 261)
    assert float(ground.height_at(0.0, 0.0)) == pytest.approx(0.0, abs=1e-6)
    assert np.abs(ground.heights).max() == pytest.approx(13 * np.tan(0.2) * 1.4, rel=0.15)


@pytest.mark.parametrize("bearing", [0.0, np.pi / 2])
def test_tiles_fill_the_field_with_its_heights(bearing):
    """From the edge on, 9 m deep and to either side; heights vary by 15 % at most."""
    world = make_field(MEADOW, bearing, np.random.default_rng(2))
    corners = np.concatenate([each.vertices for each in world.objects])
    ahead, aside = (
        (corners[:, 0], corners[:, 1]) if not bearing else (corners[:, 1], -corners[:, 0])
    )
    assert (ahead.min(), ahead.max()) == pytest.approx((3.0, 12.0), abs=0.02)
    assert (aside.min(), aside.max()) == pytest.approx((-9.25, 8.75), abs=0.02)
    tops = np.array([each.vertices[:, 2].max() for each in world.objects])
    assert tops.min() >= 0.85 * 0.5 - 0.01
    assert 1.15 * 0.5 * 0.98 < tops.max() <= 1.15 * 0.5 + 0.01
    assert tops.mean() == pytest.approx(0.5, rel=0.02)
