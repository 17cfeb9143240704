"""Hazards: each at its distance and bearing, forbidden unless harmless."""

import numpy as np
import pytest

from worlds.hazards import HAZARDS, make_hazard

AHEAD = np.linspace(0.0, 2.0, 41)


@pytest.mark.parametrize("name", HAZARDS)
@pytest.mark.parametrize("bearing", [0.3, -2.0])
def test_a_hazard_begins_at_its_distance_and_is_forbidden_unless_harmless(name, bearing):
    """The ground is free up to the hazard, in its direction, and forbidden there."""
    world = make_hazard(HAZARDS[name], 3.0, bearing, 0.0, np.random.default_rng(1))
    along = np.array([np.cos(bearing), np.sin(bearing)])
    before = world.truth.forbidden_at(*(along[:, None] * np.linspace(0.0, 2.6, 27)))
    assert not before.any()
    r, turn = np.meshgrid(np.linspace(2.8, 5.5, 55), np.linspace(-0.5, 0.5, 41))
    places = r * np.cos(bearing + turn), r * np.sin(bearing + turn)
    assert world.truth.forbidden_at(*places).any() != HAZARDS[name].harmless


def test_bare_ground_may_be_driven_up_to_nearly_20_degrees():
    """Slopes below the limit are free but for the border."""
    for slope in (0.0, 10.0, 19.5):
        rng = np.random.default_rng(2)
        world = make_hazard(HAZARDS["bare_ground"], 3.0, 0.0, np.deg2rad(slope), rng)
        x, y = np.meshgrid(np.linspace(-10, 10, 81), np.linspace(-10, 10, 81))
        assert world.truth.forbidden_at(x, y).mean() < 0.1
