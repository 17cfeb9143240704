"""Drawing of worlds: terrain of few nodes at the same place."""

import numpy as np
import pytest

from andabata.viewer.world_drawing import coarse
from terrain.heightfield import Heightfield


@pytest.mark.parametrize("nodes", [(100, 100), (801, 801), (517, 389)])
def test_drawn_terrain_has_few_nodes_and_the_same_heights(nodes):
    """A plane stays the same plane at the same place."""
    x, y = ((np.arange(n) - (n - 1) / 2) * 0.1 for n in nodes)
    heights = (0.3 * x[:, None] - 0.1 * y[None]).astype(np.float32)
    few, every = coarse(Heightfield(heights, 0.1))
    assert max(few.heights.shape) <= 160
    assert every == max(-(-max(nodes) // 160), 1)
    assert few.height_at(1.3, -0.7) == pytest.approx(0.3 * 1.3 + 0.07, abs=1e-5)
