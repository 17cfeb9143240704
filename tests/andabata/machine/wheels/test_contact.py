"""Ground under ray-cast wheels: heights and slopes of its triangles, and its border."""

import numpy as np
import pytest

from andabata.machine.vectors import axes_of
from andabata.machine.wheels.contact import Motion, add_force, surface, touch_ground
from terrain.heightfield import Heightfield

LEVEL = axes_of(np.array([0.0, 0.0, 0.0, 1.0]))
ZERO = (0.0, 0.0, 0.0)


@pytest.fixture
def field():
    heights = np.random.default_rng(0).normal(size=(9, 7)).astype(np.float32)
    return Heightfield(heights, 0.25)


def test_the_surface_is_the_heightfields(field):
    """Heights are those of ``Heightfield``, slopes those of its triangles."""
    rng, step = np.random.default_rng(1), 1e-7
    for x, y in rng.uniform(-0.74, 0.74, (50, 2)):
        z, slope_x, slope_y = surface((field.heights, field.cell), x, y)
        assert z == pytest.approx(field.height_at(x, y), abs=1e-6)
        for slope, dx, dy in ((slope_x, step, 0.0), (slope_y, 0.0, step)):
            rise = field.height_at(x + dx, y + dy) - field.height_at(x - dx, y - dy)
            assert slope == pytest.approx(rise / (2 * step), abs=1e-4)


def test_there_is_no_ground_beyond_the_border(field):
    """The border itself is ground, a place beyond it is not."""
    ground = field.heights, field.cell
    assert np.isfinite(surface(ground, 1.0, -0.75)[0])
    assert surface(ground, 1.001, 0.0)[0] == -np.inf
    assert surface(ground, np.nan, 0.0)[0] == -np.inf


def test_a_point_below_a_slope_touches_along_the_normal():
    """The depth is the distance from the plane."""
    x = (np.arange(5) - 2.0) * 0.5
    heights = np.repeat(x[:, None], 5, axis=1).astype(np.float32)  # Rises by 45 degrees along x.
    motion = Motion((0.0, 0.0, 0.1), LEVEL, ZERO, ZERO)
    touch = touch_ground(motion, (0.2, 0.0, 0.0), (heights, 0.5))
    assert touch.depth == pytest.approx(0.1 * np.sqrt(0.5))
    np.testing.assert_allclose(touch.normal, [-np.sqrt(0.5), 0.0, np.sqrt(0.5)])
    assert touch_ground(motion, (0.0, 0.0, 0.0), (heights, 0.5)).depth == 0.0


def test_a_force_acts_with_its_lever():
    """Force and torque about the centre of mass are added up."""
    loads = np.ones(10)
    add_force(loads, (0.0, 0.0, 2.0), (0.5, 0.0, 0.0))
    np.testing.assert_allclose(loads, [1, 1, 3, 1, 0, 1, 1, 1, 1, 1])
