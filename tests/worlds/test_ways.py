"""Trails and strips on smooth ground: what lies where, and what it leaves alone."""

import numpy as np

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from worlds.ways import WaysConfig, lay_ways

SMOOTH = Heightfield(
    (0.02 * np.random.default_rng(3).standard_normal((161, 161))).astype(np.float32), 0.25
)


def laid(difficulty=0.5, surface=None, **given):
    """Return ways on 40 m of ground."""
    surface = np.zeros((160, 160), dtype=np.uint8) if surface is None else surface
    rng = np.random.default_rng(1)
    return lay_ways(SMOOTH, surface, 3, WaysConfig(**given), difficulty, rng)


def test_numbers_rise_with_difficulty():
    """At 0.5 they are the configured ones."""
    assert [len(laid(d, trails=2).trails) for d in (0.0, 0.5, 1.0)] == [1, 2, 3]
    assert len(laid(0.0, kerbs=4).stones) < len(laid(1.0, kerbs=4).stones)
    assert WaysConfig(roots=1.0).is_empty
    assert not WaysConfig(kerbs=1).is_empty


def test_ground_beside_ways_is_as_it_was():
    """Where nothing is worn and no verge is near, heights and classes stay."""
    ways = laid(trails=1, kerbs=2)
    plain = SMOOTH.refined(3)
    is_way = ways.surface == SemanticClass.PATH
    assert 0.02 < is_way.mean() < 0.3
    worn = ways.worn > 0
    changed = ways.base.heights != plain.heights
    assert (changed & worn).sum() > 0.5 * worn.sum()
    # Levelled verges are a metre wide, worn ones 0.3 m.
    assert (changed & ~worn).sum() < 2.5 * worn.sum()
    assert (ways.worn[:-1, :-1][is_way] == 1.0).all()


def test_strips_and_trails_have_streams_of_their_own():
    """A trail elsewhere moves no strip."""
    alone, both = laid(kerbs=2), laid(kerbs=2, trails=1)
    rise = alone.base.heights - SMOOTH.refined(3).heights
    assert 0.06 <= rise.max() <= 0.1201
    same = np.isclose(both.base.heights, alone.base.heights)
    assert same[rise > 0.05].mean() > 0.5


def test_water_stays_level():
    """A trail through it changes neither its height nor its class."""
    surface = np.full((160, 160), SemanticClass.WATER, dtype=np.uint8)
    ways = laid(surface=surface, trails=2, kerbs=3)
    np.testing.assert_array_equal(ways.base.heights, SMOOTH.refined(3).heights)
    assert (ways.surface == SemanticClass.WATER).all()


def test_a_smaller_square_has_fewer_strips_and_as_many_trails():
    """By its share of the area."""
    config = WaysConfig(trails=2, roots=0.1, kerbs=8)
    assert config.scaled(0.25) == WaysConfig(trails=2, roots=0.1, kerbs=2)
