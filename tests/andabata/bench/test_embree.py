"""The reference rays of Embree: first hits with and without porous objects."""

import numpy as np

from andabata.bench.embree import EmbreeScene
from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.rays.geometry import NO_CLASS


def test_the_first_hit_has_its_class(make_ground):
    """Grass, ground of two classes and the sky, with porous objects and without."""
    grass = box(SemanticClass.HIGH_GRASS, (3.0, 0.0, 1.0), (1.0, 4.0, 2.0))
    wall = box(SemanticClass.WALL, (5.0, 0.0, 1.0), (1.0, 4.0, 2.0))
    world = make_ground(objects=(grass, wall), cell=0.5)
    world.surface[:10] = SemanticClass.PATH
    rays = np.array(
        [[0, 0, 1, 1, 0, 0], [0.1, 0.1, 1, 0, 0, -1], [-8.1, 0.1, 1, 0, 0, -1], [0, 0, 1, 0, 0, 1]],
        dtype=np.float32,
    )
    ranges, classes = EmbreeScene(world).first(rays)
    np.testing.assert_allclose(ranges, [2.5, 1.0, 1.0, np.inf], rtol=1e-5)
    ground = [SemanticClass.GROUND, SemanticClass.PATH, NO_CLASS]
    assert classes.tolist() == [SemanticClass.HIGH_GRASS, *ground]
    ranges, classes = EmbreeScene(world, porous=False).first(rays)
    np.testing.assert_allclose(ranges, [4.5, 1.0, 1.0, np.inf], rtol=1e-5)
    assert classes.tolist() == [SemanticClass.WALL, *ground]
