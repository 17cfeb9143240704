"""Low plants: their share, their height, and where they do not grow."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from worlds.ground_cover import CoverConfig, ground_cover


def cover(surface=None, difficulty=0.5, **given):
    """Return the cover of 50 m of ground [cm]."""
    surface = np.zeros((200, 200), dtype=np.uint8) if surface is None else surface
    return ground_cover(surface, 0.25, CoverConfig(**given), difficulty, np.random.default_rng(0))


@pytest.mark.parametrize(("difficulty", "share"), [(0.0, 0.2), (0.5, 0.4), (1.0, 0.6)])
def test_it_covers_its_share_and_rises_with_difficulty(difficulty, share):
    """Heights are from 3 cm to the highest."""
    heights = cover(difficulty=difficulty, share=0.4, height=0.1)
    assert (heights > 0).mean() == pytest.approx(share, abs=0.01)
    assert heights[heights > 0].min() >= 3
    assert heights.max() == 10
    assert heights.dtype == np.uint8


def test_paths_and_water_are_bare():
    """All of the ground may be covered, and nothing else."""
    surface = np.zeros((200, 200), dtype=np.uint8)
    surface[:50] = SemanticClass.PATH
    surface[50:90] = SemanticClass.WATER
    heights = cover(surface, share=1.0)
    assert not heights[:90].any()
    assert heights[90:].all()


def test_without_a_share_there_is_none():
    """Bare ground has no array."""
    assert cover() is None
