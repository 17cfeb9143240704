"""Plants and rocks: on the ground, of the stated sizes and classes."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.plants import boulder, bush, fallen_trunk, grass, root, stone, tree

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


def extent(parts):
    """Return the edges of the box around parts [m], shape (3,), and its top above the ground."""
    vertices = np.concatenate([each.vertices for each in parts])
    return np.ptp(vertices, axis=0), vertices[:, 2].max() - 2.0


def test_a_given_size_takes_the_place_of_the_drawn_one():
    """Trunk, crown, plants and logs are as high, wide, long and turned as they are said to be."""
    rng = np.random.default_rng(3)
    trunk, crown = tree(GROUND, 0.0, 0.0, rng, height=12.0, radius=0.3, crown_radius=2.5)
    assert extent([trunk])[0] == pytest.approx([0.6, 0.6, 12.0], abs=1e-5)
    assert extent([trunk])[1] == pytest.approx(11.7)
    assert extent([crown])[0][:2] == pytest.approx([5.0, 5.0], rel=0.1)
    assert extent(grass(GROUND, 0.0, 0.0, rng, height=0.7, radius=0.4))[1] == pytest.approx(0.7)
    size, top = extent(bush(GROUND, 0.0, 0.0, rng, height=2.0, radius=1.0))
    assert (size[0], top) == pytest.approx((2.0, 2.0))
    size, top = extent(boulder(GROUND, 0.0, 0.0, rng, height=0.5, radius=2.0))
    assert 2.0 < size[0] < 4.4
    assert 0.2 < top < 0.55
    size, _ = extent(fallen_trunk(GROUND, 0.0, 0.0, rng, length=4.0, radius=0.1, yaw=np.pi / 2))
    assert size[:2] == pytest.approx([0.2, 4.0], abs=0.01)


def test_a_low_tree_has_a_low_crown():
    """The crown of a small tree is as far up its trunk as that of a large one."""
    for seed in range(20):
        feet = [
            tree(GROUND, 0.0, 0.0, np.random.default_rng(seed), height=high)[1].vertices[:, 2].min()
            for high in (1.0, 10.0)
        ]
        assert feet[1] - 2.0 == pytest.approx(10 * (feet[0] - 2.0), rel=1e-4)
        assert 0.0 < feet[0] - 2.0 < 1.0


def test_a_given_size_does_not_move_the_others():
    """What is not given is drawn as without it."""
    plain = tree(GROUND, 0.0, 0.0, np.random.default_rng(5))
    thick = tree(GROUND, 0.0, 0.0, np.random.default_rng(5), radius=1.0)
    np.testing.assert_array_equal(plain[1].vertices, thick[1].vertices)


def test_a_root_follows_its_course_at_its_height():
    """It lies on the ground, half buried; one that a wheel climbs has a class of its own."""
    slope = Heightfield(np.tile(0.1 * np.arange(21.0), (21, 1)).T.astype(np.float32), 1.0)
    course = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    for height, kind in ((0.05, SemanticClass.ROOT), (0.06, SemanticClass.TRUNK)):
        parts = root(slope, course, height)
        assert [part.semantic for part in parts] == [kind, kind]
        level = parts[0].vertices.astype(float)
        assert level[:, 2].max() - 1.0 == pytest.approx(height)
        assert level[:, 2].min() - 1.0 == pytest.approx(-height / 2)
        assert np.ptp(level[:, 1]) == pytest.approx(1.0)
        assert parts[1].vertices[:, 0].max() == pytest.approx(1.0, abs=0.01)
