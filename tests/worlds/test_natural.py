"""Natural worlds: densities, water and paths as configured."""

import numpy as np
import pytest

from terrain.classes import TRAITS, SemanticClass
from terrain.heightfield import Heightfield
from terrain.plants import bush
from worlds.ground_cover import CoverConfig
from worlds.natural import NaturalConfig, Streams, make_natural, natural_on
from worlds.rough_ground import RoughnessConfig
from worlds.traversability_map import Reason
from worlds.ways import WaysConfig

BARE = NaturalConfig(
    family=1,
    size=60.0,
    relief=1.0,
    max_slope=0.2,
    trees=0.0,
    grass=0.0,
    bushes=0.0,
    rocks=0.0,
    logs=0.0,
    ditches=0,
    pits=0,
    traps=0,
    tasks=1,
    near=10.0,
    far=30.0,
)


def natural(difficulty=0.5, seed=0, **changes):
    """Return a bare world with some changes."""
    config = BARE.model_copy(update=changes)
    return make_natural("natural", seed, config, difficulty, np.random.default_rng(seed))


def test_a_bare_world_is_free_inside_of_its_border():
    """Gentle hills without objects are traversable, and have the stated relief."""
    world = natural()
    assert not world.objects
    assert np.ptp(world.ground.heights) == pytest.approx(1.0, rel=1e-5)
    inside = world.truth.reason[15:-15, 15:-15]
    assert (inside == Reason.FREE).mean() > 0.99


@pytest.mark.parametrize("difficulty", [0.0, 0.5, 1.0])
def test_densities_are_per_square_metre_and_rise_with_difficulty(difficulty):
    """At 0.5 the density is the configured one; at 0 half, at 1 one and a half times it."""
    counts = [len(natural(difficulty, seed, bushes=0.05).objects) for seed in range(4)]
    assert np.mean(counts) == pytest.approx(0.05 * 3600 * (0.5 + difficulty), rel=0.12)


def test_a_kind_does_not_move_the_others():
    """Bushes stay where they are when lamps are added."""
    alone = natural(bushes=0.02).objects
    among = [
        o for o in natural(bushes=0.02, lamps=0.01).objects if o.semantic is SemanticClass.BUSH
    ]
    assert len(alone) == len(among)
    for a, b in zip(alone, among, strict=True):
        np.testing.assert_array_equal(a.vertices, b.vertices)


def test_water_is_level_and_covers_its_share():
    """The configured share of the ground is under water of one height, and forbidden."""
    world = natural(water=0.2)
    wet = world.surface == SemanticClass.WATER
    assert wet.mean() == pytest.approx(0.2, abs=0.05)
    assert np.ptp(world.ground.heights[:-1, :-1][wet]) < 1e-6
    x, y = world.ground.x[:-1] + 0.125, world.ground.y[:-1] + 0.125
    assert (world.truth.reason_at(x[:, None], y[None, :])[wet] == Reason.WATER).mean() > 0.9


def test_nothing_stands_on_paths():
    """Objects whose middle would be on a path are left out."""
    world = natural(paths=2, bushes=0.1)
    assert (world.surface == SemanticClass.PATH).any()
    middles = np.array(
        [(o.vertices.min(axis=0) + o.vertices.max(axis=0))[:2] / 2 for o in world.objects]
    )
    i, j = ((middles + 30.0) / 0.25).astype(int).clip(0, 239).T
    assert (world.surface[i, j] == SemanticClass.GROUND).all()


def test_a_trap_is_a_row_of_rocks_in_reach_of_each_other():
    """Neighbouring rocks of a dead end are less than a robot's width apart."""
    rocks = natural(traps=1).objects
    assert {rock.semantic for rock in rocks} == {SemanticClass.ROCK}
    middles = np.array([rock.vertices[:, :2].mean(axis=0) for rock in rocks])
    assert np.hypot(*np.diff(middles, axis=0).T).max() < 1.6
    assert np.hypot(*(middles[0] - middles[-1])) > 3.0


def test_stands_cover_the_ground_where_they_stand():
    """High stands forbid it, their low edges do not; nothing else of the world moves."""
    world, bare = natural(stands=0.01, bushes=0.01), natural(bushes=0.01)
    tiles = [each for each in world.objects if TRAITS[each.semantic].by_height]
    assert len(tiles) > 200
    assert 0.05 < (world.truth.reason == Reason.VEGETATION).mean() < 0.4
    middles = np.array([each.vertices[4:].mean(axis=0) for each in tiles], dtype=np.float64)
    heights = middles[:, 2] - world.ground.height_at(middles[:, 0], middles[:, 1])
    high = world.truth.reason_at(*middles[heights > 0.2, :2].T)
    assert (high != Reason.FREE).all()
    others = [each for each in world.objects if not TRAITS[each.semantic].by_height]
    assert len(others) == len(bare.objects)
    for one, other in zip(others, bare.objects, strict=True):
        np.testing.assert_array_equal(one.vertices, other.vertices)


def test_ledges_are_upright_steps_up_and_down():
    """Ground changes its height by 5 to 50 cm between two grid lines, and nowhere else."""
    extremes = []
    for seed in range(6):
        world, bare = natural(ledges=1, seed=seed), natural(seed=seed)
        added = world.ground.heights - bare.ground.heights
        height = np.abs(added).max()
        assert 0.05 <= height <= 0.5
        assert (np.isclose(np.abs(added), height, atol=1e-5) | (added == 0)).mean() > 0.97
        stops = np.isin(world.truth.reason, (Reason.STEP, Reason.SLOPE)).any()
        assert stops or height < 0.12
        extremes.append(added[np.unravel_index(np.abs(added).argmax(), added.shape)])
    assert min(extremes) < 0 < max(extremes)


def test_roughness_moves_nothing_and_forbids_nothing():
    """Objects stand at the same places on the rough ground; the true map stays the smooth one's."""
    smooth = natural(rocks=0.03, bushes=0.02)
    rough = natural(rocks=0.03, bushes=0.02, roughness=RoughnessConfig(clods=0.025, ruts=5))
    assert smooth.base is None
    np.testing.assert_array_equal(rough.base.heights, smooth.ground.heights)
    assert rough.ground.cell == pytest.approx(smooth.ground.cell / 3)
    assert len(rough.objects) == len(smooth.objects)
    for a, b in zip(rough.objects, smooth.objects, strict=True):
        shift = (a.vertices - b.vertices).astype(np.float64)
        np.testing.assert_allclose(shift[:, :2], 0.0, atol=1e-5)
        np.testing.assert_allclose(shift[:, 2], shift[0, 2], atol=1e-5)
        assert abs(shift[0, 2]) < 0.15
    same = rough.truth.reason == smooth.truth.reason
    assert same.mean() > 0.999
    step = (Reason.STEP, Reason.SLOPE)
    assert np.isin(rough.truth.reason, step).sum() == np.isin(smooth.truth.reason, step).sum()


def slope(rise=0.1, size=60.0):
    """Return smooth ground that rises to the east, and its surface."""
    x = np.linspace(-size / 2, size / 2, round(size / 0.25) + 1)
    heights = np.repeat(rise * x[:, None], len(x), axis=1).astype(np.float32)
    return Heightfield(heights, 0.25), np.zeros((len(x) - 1,) * 2, dtype=np.uint8)


def on_slope(config, placed=None):
    """Return a world on a slope."""
    smooth, surface = slope()
    streams = Streams(*np.random.default_rng(4).spawn(len(Streams._fields)))
    return natural_on("slope", 4, config, 0.5, smooth, surface, streams, placed)


def test_given_ground_is_the_ground_of_the_world():
    """What is on it does not change the shape of smooth ground."""
    world = on_slope(BARE.model_copy(update={"bushes": 0.02}))
    np.testing.assert_array_equal(world.ground.heights, slope()[0].heights)
    assert {each.semantic for each in world.objects} == {SemanticClass.BUSH}
    assert (world.name, world.seed, len(world.tasks)) == ("slope", 4, 1)


def test_placed_objects_stand_on_the_rough_ground_beside_the_random_ones():
    """They come last, on the ground with its roughness, and the true map knows them."""
    rough = RoughnessConfig(clods=0.03)
    config = BARE.model_copy(update={"rocks": 0.01, "roughness": rough})
    grounds = []

    def placed(ground):
        grounds.append(ground)
        return bush(ground, 5.0, 10.0, np.random.default_rng(0), radius=0.5)

    alone, world = on_slope(config), on_slope(config, placed)
    assert grounds[0] is world.ground
    assert len(world.objects) == len(alone.objects) + 1
    assert world.objects[-1].semantic is SemanticClass.BUSH
    assert world.truth.reason_at(5.0, 10.0) in (Reason.VEGETATION, Reason.SOLID)
    np.testing.assert_array_equal(world.ground.heights, alone.ground.heights)


def test_ways_and_stems_move_nothing_of_what_was_there():
    """Bushes stay at their places; trails are bare, smooth, and free where the hills are."""
    rough = RoughnessConfig(clods=0.025, gravel=0.005, ruts=3)
    cover = CoverConfig(share=0.6)
    plain = natural(bushes=0.02, roughness=rough, cover=cover)
    more = {"ways": WaysConfig(trails=2, roots=0.2, kerbs=2), "shrubs": 0.01, "saplings": 0.01}
    world = natural(bushes=0.02, roughness=rough, cover=cover, wind=0.2, **more)
    assert (world.wind, plain.wind) == (0.2, 0.0)
    is_way = world.surface == SemanticClass.PATH
    assert not world.cover[is_way].any()
    np.testing.assert_array_equal(world.cover[~is_way], plain.cover[~is_way])
    nodes = np.zeros(world.ground.heights.shape, dtype=bool)
    nodes[:-1, :-1] = is_way
    np.testing.assert_array_equal(world.ground.heights[nodes], world.base.heights[nodes])
    free = world.truth.reason == Reason.FREE
    low = natural(bushes=0.02, roughness=rough, cover=cover, ways=WaysConfig(trails=2))
    assert free.mean() > 0.8
    x, y = np.nonzero(low.surface == SemanticClass.PATH)
    places = ((x + 0.5) * low.ground.cell - 30.0, (y + 0.5) * low.ground.cell - 30.0)
    inside = np.maximum(*np.abs(places)) < 28.5
    assert (low.truth.reason_at(*places)[inside] == Reason.FREE).mean() > 0.97
    kinds = {each.semantic for each in world.objects}
    assert {SemanticClass.KERB, SemanticClass.TRUNK, SemanticClass.FOLIAGE} <= kinds
    places = {each.vertices[:, :2].tobytes() for each in world.objects}
    kept = [each.vertices[:, :2].tobytes() in places for each in plain.objects]
    assert np.mean(kept) > 0.8  # What stood on a way is gone.
