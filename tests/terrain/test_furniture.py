"""Park furniture: on the ground, of the stated sizes and classes."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.furniture import bench, bin_, lamp, table
from terrain.heightfield import Heightfield

GROUND = Heightfield(np.full((21, 21), 2.0, dtype=np.float32), 1.0)


@pytest.mark.parametrize(
    ("make", "kind", "low", "high"),
    [
        (lamp, SemanticClass.LAMP, 3.0, 4.7),
        (bench, SemanticClass.BENCH, 0.4, 0.86),
        (table, SemanticClass.TABLE, 0.69, 0.81),
        (bin_, SemanticClass.BIN, 0.69, 1.01),
    ],
)
def test_furniture_stands_on_the_ground_and_has_the_stated_height(make, kind, low, high):
    """Every piece reaches into the ground and ends within its stated range."""
    for seed in range(40):
        parts = make(GROUND, 3.0, -4.0, np.random.default_rng(seed))
        assert {part.semantic for part in parts} == {kind}
        vertices = np.concatenate([part.vertices for part in parts])
        assert vertices[:, 2].min() < 2.0
        assert low < vertices[:, 2].max() - 2.0 < high
        middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        np.testing.assert_allclose(middle[:2], [3.0, -4.0], atol=0.35)


def test_legs_are_below_the_seat_whatever_the_heading():
    """The legs of a bench are within the outline of its seat."""
    for seed in range(20):
        seat, *legs = bench(GROUND, 0.0, 0.0, np.random.default_rng(seed))
        reach = np.hypot(*seat.vertices[:, :2].T).max()
        for leg in legs[:2]:
            assert np.hypot(*leg.vertices[:, :2].T).max() < reach
            assert leg.vertices[:, 2].max() < seat.vertices[:, 2].max()
