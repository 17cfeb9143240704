"""Drawing of worlds: terrain of few nodes at the same place."""

import numpy as np
import pytest

from andabata.report.rendering.plants import Plants
from andabata.viewer.world_drawing import blade_corners, coarse
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import frustum


@pytest.mark.parametrize("nodes", [(100, 100), (801, 801), (517, 389)])
def test_drawn_terrain_has_few_nodes_and_the_same_heights(nodes):
    """A plane stays the same plane at the same place."""
    x, y = ((np.arange(n) - (n - 1) / 2) * 0.1 for n in nodes)
    heights = (0.3 * x[:, None] - 0.1 * y[None]).astype(np.float32)
    few, every = coarse(Heightfield(heights, 0.1))
    assert max(few.heights.shape) <= 160
    assert every == max(-(-max(nodes) // 160), 1)
    assert few.height_at(1.3, -0.7) == pytest.approx(0.3 * 1.3 + 0.07, abs=1e-5)


def test_a_blade_is_a_thin_triangle_from_foot_to_tip():
    """Its foot is 4 cm wide, level and across the way that it leans."""
    ground = Heightfield(np.zeros((41, 41), dtype=np.float32), 0.25)
    plants = Plants.of([frustum(SemanticClass.HIGH_GRASS, (1, 2, 0), (0.4, 0.3), 0.8, 7)], ground)
    left, right, tips = np.moveaxis(blade_corners(plants), 1, 0)
    assert len(tips) == len(plants.tips)
    np.testing.assert_allclose(tips, plants.tips)
    np.testing.assert_allclose((left + right) / 2, plants.feet, atol=1e-6)
    foot, lean = right - left, tips - plants.feet
    np.testing.assert_allclose(np.linalg.norm(foot, axis=1), 0.04, rtol=1e-3)
    np.testing.assert_allclose(foot[:, 2], 0, atol=1e-6)
    np.testing.assert_allclose((foot * lean).sum(axis=1), 0, atol=1e-5)
