"""Plants and rocks: on the ground, of the stated sizes and classes."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.plants import boulder, bush, fallen_trunk, grass, stone, tree

GROUND = Heightfield(np.full((21, 21), 2.0, dtype=np.float32), 1.0)


def heights_above_ground(make, count=200):
    """Return lowest and highest point above ground [m] of many objects, shape (count, 2)."""
    rng = np.random.default_rng(0)
    objects = [
        np.concatenate([p.vertices for p in make(GROUND, 3.0, -4.0, rng)]) for _ in range(count)
    ]
    return np.array([[each[:, 2].min() - 2.0, each[:, 2].max() - 2.0] for each in objects])


@pytest.mark.parametrize(
    ("make", "kinds", "low", "high"),
    [
        (tree, [SemanticClass.TRUNK, SemanticClass.FOLIAGE], 2.7, 8.1),
        (grass, [SemanticClass.HIGH_GRASS], 0.2, 1.2),
        (bush, [SemanticClass.BUSH], 0.4, 1.4),
        (boulder, [SemanticClass.ROCK], 0.03, 1.1),
        (stone, [SemanticClass.STONE], 0.005, 0.05),
        (fallen_trunk, [SemanticClass.TRUNK], 0.14, 0.451),
    ],
)
def test_plants_have_the_stated_classes_and_heights(make, kinds, low, high):
    """Every plant begins below the ground and ends within its stated range."""
    assert [part.semantic for part in make(GROUND, 3.0, -4.0, np.random.default_rng(0))] == kinds
    found = heights_above_ground(make)
    assert (found[:, 0] < 0).all()
    assert low < found[:, 1].min()
    assert found[:, 1].max() < high + 1e-5
    assert np.ptp(found[:, 1]) > 0.5 * (high - low)


def test_plants_are_where_they_were_placed():
    """The middle of a plant is at its place, x before y."""
    for make in (tree, grass, bush):
        vertices = make(GROUND, 3.0, -4.0, np.random.default_rng(1))[0].vertices
        middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
        np.testing.assert_allclose(middle[:2], [3.0, -4.0], atol=0.05)


def test_one_tree_in_five_has_low_branches():
    """Crowns begin below 1.3 m for a fifth of the trees."""
    rng = np.random.default_rng(2)
    feet = [tree(GROUND, 0.0, 0.0, rng)[1].vertices[:, 2].min() - 2.0 for _ in range(2000)]
    assert np.mean(np.array(feet) < 1.3) == pytest.approx(0.2, abs=0.03)
