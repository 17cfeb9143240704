"""Continuous stands: of the stated height and width, on the ground, without holes between tiles."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.stands import KINDS, TILE, stand, tiles

LEVEL = Heightfield(np.full((41, 41), 2.0, dtype=np.float32), 1.0)
LINES = np.arange(41, dtype=np.float32) - 20
SLOPE = Heightfield((0.3 * LINES[:, None] - 0.1 * LINES[None, :]).astype(np.float32), 1.0)


def spans(objects):
    """Return the least and the greatest coordinates of each tile [m], shape (n, 3) each."""
    vertices = np.array([each.vertices for each in objects])
    return vertices.min(axis=1), vertices.max(axis=1)


def test_stands_have_the_stated_heights_widths_and_classes():
    """Tops lie within 4 cm and 1.6 times 1.2 m of the ground, widths up to 13 m."""
    rng = np.random.default_rng(0)
    stands = [stand(LEVEL, 3.0, -4.0, rng) for _ in range(300)]
    tallest = []
    for each in stands:
        low, high = spans(each)
        assert (low[:, 2] < 2.0).all()
        assert (high[:, 2] - 2.0 >= 0.04 - 1e-5).all()
        assert np.ptp(high[:, :2], axis=0).max() < 13.0
        tallest.append(np.median(high[:, 2]) - 2.0)
        np.testing.assert_allclose((low + high)[:, :2].mean(axis=0) / 2, [3.0, -4.0], atol=1.5)
    assert {each[0].semantic for each in stands} == set(KINDS)
    assert min(tallest) < 0.2
    assert 0.9 < max(tallest) < 1.6
    assert np.median(tallest) == pytest.approx(0.4, abs=0.1)


def test_some_stands_end_gradually_and_others_abruptly():
    """In half of them the lowest tile is far below the median."""
    rng = np.random.default_rng(1)
    ratios = []
    for _ in range(200):
        _, high = spans(stand(LEVEL, 0.0, 0.0, rng))
        ratios.append((high[:, 2].min() - 2.0) / (np.median(high[:, 2]) - 2.0))
    assert 0.3 < np.mean(np.array(ratios) < 0.3) < 0.7


def test_tiles_lie_on_the_slope_and_leave_no_gap():
    """Tops are parallel to the ground at their height; neighbours share an edge."""
    places = np.array([[1.25, 2.25], [1.75, 2.25]])
    one, other = tiles(SLOPE, SemanticClass.MEADOW, places, np.array([0.5, 0.5]))
    tops = one.vertices[one.vertices[:, 2].argsort()]
    top = one.vertices[4:]
    ground = SLOPE.height_at(top[:, 0].astype(float), top[:, 1].astype(float))
    np.testing.assert_allclose(top[:, 2] - ground, 0.5, atol=1e-5)
    assert tops[0, 2] < SLOPE.height_at(*tops[0, :2].astype(float))
    assert one.vertices[:, 0].max() == other.vertices[:, 0].min() == pytest.approx(1.5)
    assert np.ptp(one.vertices[:, 1]) == pytest.approx(TILE)


def test_triangles_look_outwards():
    """Each triangle's normal points away from the tile's middle."""
    (tile,) = tiles(LEVEL, SemanticClass.STALKS, np.zeros((1, 2)), np.array([0.6]))
    a, b, c = tile.vertices[tile.triangles].transpose(1, 0, 2)
    outwards = (np.cross(b - a, c - a) * ((a + b + c) / 3 - tile.vertices.mean(axis=0))).sum(axis=1)
    assert (outwards > 0).all()
    assert len(tile.triangles) == 12


def test_what_lies_beyond_the_ground_is_left_out():
    """A place beside the heightfield gives no tile."""
    places = np.array([[0.0, 0.0], [25.0, 0.0], [0.0, -25.0]])
    assert len(tiles(LEVEL, SemanticClass.THICKET, places, np.full(3, 0.5))) == 1
