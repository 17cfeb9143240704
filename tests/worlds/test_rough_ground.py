"""Rough ground: on a finer grid, level on water, and free where the smooth ground is."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from worlds.rough_ground import RoughnessConfig, at_nodes, refined, rough_ground


def rough(surface=None, difficulty=0.5, seed=0, worn=None, **given):
    """Return ground of 30 m, rough by some settings, and its surface."""
    smooth = Heightfield(np.full((121, 121), 2.0, dtype=np.float32), 0.25)
    if surface is None:
        surface = np.zeros((120, 120), dtype=np.uint8)
    config = RoughnessConfig(**given)
    fine, surface = refined(smooth, surface, config.cells)
    rng = np.random.default_rng(seed)
    return rough_ground(fine, surface, config, difficulty, rng, worn), surface


@pytest.mark.parametrize(("difficulty", "factor"), [(0.0, 0.5), (0.5, 1.0), (1.0, 1.5)])
def test_clods_are_as_high_as_stated_and_rise_with_difficulty(difficulty, factor):
    """Patches have a fifth to the whole of the stated size."""
    ground, surface = rough(difficulty=difficulty, clods=0.02)
    assert ground.cell == pytest.approx(0.25 / 3)
    assert ground.heights.shape == (361, 361)
    assert surface.shape == (360, 360)
    assert 0.5 < (ground.heights - 2.0).std() / (0.02 * factor) < 0.9


def test_parts_have_streams_of_their_own():
    """Clods stay where they are when ruts are added, and ruts when clods are."""
    clods, _ = rough(clods=0.01)
    ruts, _ = rough(ruts=4)
    both, _ = rough(clods=0.01, ruts=4)
    parts = (clods.heights - 2.0) + (ruts.heights - 2.0)
    np.testing.assert_allclose(both.heights - 2.0, parts, atol=1e-6)
    assert -0.1 < (ruts.heights - 2.0).min() <= -0.02
    assert (ruts.heights - 2.0).max() < 1e-6


def test_gravel_lies_in_patches():
    """A third of the ground has it, a half has none."""
    ground, _ = rough(gravel=0.01)
    off = np.abs(ground.heights - 2.0)
    assert 0.3 < (off < 1e-6).mean() < 0.75
    assert 0.004 < off[off > 1e-6].std() < 0.02


def test_water_is_level_and_paths_are_smoother():
    """Nothing rises above the water; clods of a path are a third as high."""
    surface = np.zeros((120, 120), dtype=np.uint8)
    surface[:40] = SemanticClass.WATER
    surface[80:] = SemanticClass.PATH
    ground, fine = rough(surface, clods=0.02, gravel=0.005, ruts=20)
    assert (fine[:120] == SemanticClass.WATER).all()
    assert (fine[240:] == SemanticClass.PATH).all()
    np.testing.assert_array_equal(ground.heights[:121], 2.0)
    plain, _ = rough(clods=0.02)
    path, _ = rough(surface, clods=0.02)
    np.testing.assert_allclose(path.heights[245:] - 2.0, (plain.heights[245:] - 2.0) / 3, atol=1e-6)


def test_what_is_worn_off_is_smooth():
    """Clods, gravel and ruts are as high as what is left of them."""
    parts = {"clods": 0.02, "gravel": 0.01, "ruts": 10}
    plain, _ = rough(**parts)
    worn = np.zeros((361, 361))
    worn[:100], worn[100:200] = 1.0, 0.5
    ground, _ = rough(worn=worn, **parts)
    np.testing.assert_array_equal(ground.heights[:100], 2.0)
    half = (plain.heights[100:200] - 2.0) / 2
    np.testing.assert_allclose(ground.heights[100:200] - 2.0, half, atol=1e-6)
    np.testing.assert_array_equal(ground.heights[200:], plain.heights[200:])


def test_nodes_of_cells_are_their_corners():
    """One cell has four."""
    cells = np.zeros((3, 4), dtype=bool)
    cells[1, 2] = True
    nodes = at_nodes(cells)
    assert nodes.shape == (4, 5)
    assert nodes.sum() == 4
    assert nodes[1:3, 2:4].all()
