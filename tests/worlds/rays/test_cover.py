"""Beams in short grass: where they stop, that they see through gaps, and always the same."""

from dataclasses import replace

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.rays.scene import RayScene

GRASS = SemanticClass.SHORT_GRASS


def cast(world, rays):
    """Return ranges and classes of rays from points [m] in directions."""
    directions = np.asarray(rays[1], dtype=np.float64)
    directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
    packed = np.column_stack(np.broadcast_arrays(rays[0], directions)).astype(np.float32)
    return RayScene(world).cast(packed, np.full(len(packed), np.inf, dtype=np.float32), 30.0)


@pytest.fixture(scope="module")
def meadow(make_ground):
    """Return a slope with grass of 12 cm where x is positive."""
    world = make_ground(lambda x, y: 0.1 * x, size=24.0, cell=0.1)
    cover = np.zeros(world.surface.shape, dtype=np.uint8)
    cover[120:] = 12
    return replace(world, cover=cover)


def fan(fall, count=400, x=2.0):
    """Return rays that come down at a slope, from 0.7 m above the ground, all around y."""
    y = np.linspace(-9.0, 9.0, count)
    origins = np.column_stack([np.full(count, x), y, np.full(count, 0.1 * x + 0.7)])
    return origins, np.column_stack([np.ones(count), np.zeros(count), np.full(count, -fall)])


def test_beams_end_within_the_grass_and_some_reach_the_ground(meadow):
    """No return is above 12 cm or below the ground, which steep beams reach more often."""
    seen = []
    for fall in (0.15, 0.5, 3.0):
        origins, directions = fan(fall)
        ranges, classes = cast(meadow, (origins, directions))
        unit = directions / np.linalg.norm(directions, axis=1, keepdims=True)
        ends = origins + ranges[:, None] * unit
        above = ends[:, 2] - meadow.ground.height_at(ends[:, 0], ends[:, 1])
        assert above.min() > -1e-4
        assert above.max() < 0.121
        grass = classes == GRASS
        assert (above[~grass] < 1e-4).all()
        assert above[grass].mean() > 0.02
        seen.append(grass.mean())
    assert seen[0] > 0.75
    assert seen[0] > seen[1] > seen[2] > 0.1


def test_bare_ground_is_hit_as_before(meadow):
    """Where nothing grows, ranges are those of a world without cover, bit for bit."""
    origins, directions = fan(0.5, x=-9.0)
    found, classes = cast(meadow, (origins, directions))
    bare, _ = cast(replace(meadow, cover=None), (origins, directions))
    np.testing.assert_array_equal(found, bare)
    assert (classes == SemanticClass.GROUND).all()


def test_whoever_looks_twice_sees_the_same(meadow):
    """The same beam gives the same range; one a hair beside it almost always, too."""
    origins, directions = fan(0.3)
    first, _ = cast(meadow, (origins, directions))
    again, _ = cast(meadow, (origins, directions))
    np.testing.assert_array_equal(first, again)
    beside, _ = cast(meadow, (origins + np.array([0.0, 0.001, 0.0]), directions))
    assert (np.abs(beside - first) < 0.03).mean() > 0.9


def test_grass_hides_a_low_stone_and_not_a_high_one(meadow):
    """Of beams at a stone in the grass few end on one of 6 cm, most on one of 40 cm."""
    shares = []
    for height in (0.06, 0.4):
        stone = box(SemanticClass.ROCK, (6.0, 0.0, 0.6 + height / 2), (0.3, 20.0, height))
        truth = replace(meadow, objects=(stone,))
        origins = np.column_stack([np.full(400, 2.0), np.linspace(-9, 9, 400), np.full(400, 0.9)])
        at = np.column_stack([np.full(400, 5.85), origins[:, 1], np.full(400, 0.6 + height - 0.02)])
        _, classes = cast(truth, (origins, at - origins))
        shares.append((classes == SemanticClass.ROCK).mean())
    assert shares[0] < 0.5
    assert shares[1] > 0.9
