"""Rays: the same hits as in pybullet and Embree; plants stop beams at their stated rate."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.bench.embree import EmbreeScene
from terrain.classes import TRAITS, SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import SceneObject, box
from tests.support.plants import needs_bullet
from worlds.catalogue import make_world
from worlds.rays.geometry import NO_CLASS
from worlds.rays.scene import RayScene
from worlds.truth import TruthConfig, build_truth
from worlds.world import World

BATCH = 4000
"""pybullet loses a ray of a batch of 16,384."""


def rays_of(origins, directions):
    """Return rays of origins and directions, float32, shape (n, 6)."""
    return np.concatenate([origins, directions], axis=1).astype(np.float32)


def through_plants(scene, rays):
    """Cast rays that ignore porous objects."""
    return scene.cast(rays, np.full(len(rays), np.inf, dtype=np.float32))


def drawn(rays):
    """Return rays and the random optical depth of each."""
    return rays, np.random.default_rng(0).standard_exponential(len(rays), dtype=np.float32)


def flat_world(*objects):
    """Return a level world of 20 m with some objects."""
    ground = Heightfield(np.zeros((21, 21), dtype=np.float32), 1.0)
    truth = build_truth(ground, objects, TruthConfig())
    surface = np.zeros((20, 20), dtype=np.uint8)
    return World("flat", 0, 0.0, ground, surface, objects, (), truth)


def bullet_ranges(world, origins, directions, length, piece=2.5):
    """Return ranges in pybullet [m], in short pieces: it loses some long rays over heightfields."""
    from worlds.bodies import build_bodies
    from worlds.quiet_pybullet import pybullet

    client = pybullet.connect(pybullet.DIRECT)
    bodies = build_bodies(world, client)
    ranges = np.full(len(origins), np.inf)
    for begin in np.arange(0, length, piece):
        going = np.flatnonzero(np.isinf(ranges))
        for rows in np.array_split(going, max(1, len(going) // BATCH + 1)):
            first = origins[rows] + begin * directions[rows]
            last = first + (piece + 0.001) * directions[rows]
            hits = pybullet.rayTestBatch(first.tolist(), last.tolist(), physicsClientId=client)
            assert {hit[0] for hit in hits} <= {bodies.ground, *bodies.solids, -1}
            shares = np.array([hit[2] if hit[0] >= 0 else np.inf for hit in hits])
            ranges[rows] = begin + shares * (piece + 0.001)
    pybullet.disconnect(client)
    return ranges


@needs_bullet
@pytest.mark.parametrize("name", ["natural-test", "maze"])
def test_physics_and_rays_see_the_same_world(name):
    """Ranges in pybullet and ours agree but for rays that graze an edge."""
    world = make_world(name, 5)
    scene = RayScene(world)
    rng = np.random.default_rng(0)
    n, length = 10_000, 30.0
    half = world.ground.width / 2 - 1
    origins = rng.uniform(-half, half, (n, 3))
    origins[:, 2] = world.ground.height_at(origins[:, 0], origins[:, 1]) + rng.uniform(0.3, 6, n)
    directions = rng.normal(size=(n, 3))
    directions[:, 2] -= 0.5
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins, directions = origins.astype(np.float32), directions.astype(np.float32)
    physics = bullet_ranges(world, origins.astype(float), directions.astype(float), length)
    seen, _ = through_plants(scene, rays_of(origins, directions))
    seen = np.where(seen < length, seen.astype(float), np.inf)
    both = np.isfinite(physics) & np.isfinite(seen)
    assert both.sum() > 0.5 * n
    with np.errstate(invalid="ignore"):
        apart = both & (np.abs(physics - seen) > 1e-3)
    one_sided = np.isfinite(physics) != np.isfinite(seen)
    odd = np.flatnonzero(apart | one_sided)
    unexplained = [k for k in odd if not _grazes(scene, origins[k], directions[k], physics[k])]
    assert not unexplained, [(k, physics[k], seen[k]) for k in unexplained[:10]]
    assert len(odd) < 0.005 * n, f"{len(odd)} rays graze an edge, too many"


def scattered_rays(world, n, rng):
    """Return rays from all over a world, beside it, inside of objects; some along the axes."""
    half = world.ground.width / 2
    origins = rng.uniform(-1.1 * half, 1.1 * half, (n, 3))
    ground = world.ground.height_at(origins[:, 0], origins[:, 1])
    origins[:, 2] = ground + rng.uniform(0.05, 6, n)
    directions = rng.normal(size=(n, 3))
    directions[: n // 10, 0] = 0.0
    directions[n // 20 : n // 5, 1] = 0.0
    directions[: n // 100] = [0.0, 0.0, -1.0]
    directions[n // 2 :, 2] *= 0.1
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return rays_of(origins, directions)


@pytest.mark.parametrize("name", ["natural-test", "hollow", "park", "lake", "maze"])
@pytest.mark.parametrize("porous", [True, False], ids=["first face", "through plants"])
def test_hits_are_those_of_embree(name, porous):
    """Ranges and classes agree with Embree, with and without porous objects."""
    world, n = make_world(name, 6), 40_000
    rays = scattered_rays(world, n, np.random.default_rng(1))
    expected, kinds = EmbreeScene(world, porous).first(rays)
    budgets = np.full(n, 0.0 if porous else np.inf, dtype=np.float32)
    # From inside, the first face is where a ray leaves; ours is in the plant from the start.
    started = outside_of_plants(world, rays) if porous else np.ones(n, dtype=bool)
    ranges, classes = RayScene(world).cast(rays, budgets)
    with np.errstate(invalid="ignore"):
        apart = ~(
            (np.abs(ranges - expected) <= 1e-3 * np.maximum(1, expected)) | (ranges == expected)
        )
    assert np.isfinite(expected).mean() > 0.3
    # Rays along an edge, or from a metre beside the map's border, may pass on either side of it.
    assert (apart & started).sum() <= n // 10_000
    assert (classes != kinds)[started & ~apart].mean() < 1e-3


def outside_of_plants(world, rays):
    """Return True for each ray that begins outside of all porous objects."""
    outside = np.ones(len(rays), dtype=bool)
    for each in world.objects:
        if np.isinf(TRAITS[each.semantic].hits_per_metre):
            continue
        low, high = each.vertices.min(axis=0), each.vertices.max(axis=0)
        outside &= ~((rays[:, :3] >= low) & (rays[:, :3] <= high)).all(axis=1)
    return outside


def _grazes(scene, origin, direction, physics):
    """Return True if rays a milliradian away hit something else, or what the physics hit."""
    rng = np.random.default_rng(1)
    near = direction + 1e-3 * rng.normal(size=(64, 3))
    near = (near / np.linalg.norm(near, axis=1, keepdims=True)).astype(np.float32)
    ranges, _ = through_plants(scene, rays_of(np.repeat(origin[None], 64, axis=0), near))
    finite = ranges[np.isfinite(ranges)]
    beyond = not np.isfinite(physics)
    if beyond:
        return len(finite) < 64 or finite.max() - finite.min() > 0.01
    return len(finite) > 0 and (
        np.abs(finite - physics).min() < 0.02 or finite.max() - finite.min() > 0.01
    )


def test_a_ray_at_a_wall_has_a_known_range_and_class():
    """A wall, the ground and the sky."""
    scene = RayScene(flat_world(box(SemanticClass.WALL, (3, 0, 1), (1, 4, 2))))
    origins = np.array([[0, 0, 1]] * 3, dtype=np.float32)
    directions = np.array([[1, 0, 0], [0, 0, -1], [-1, 0, 0]], dtype=np.float32)
    ranges, classes = through_plants(scene, rays_of(origins, directions))
    np.testing.assert_allclose(ranges, [2.5, 1.0, np.inf], rtol=1e-6)
    assert classes.tolist() == [SemanticClass.WALL, SemanticClass.GROUND, NO_CLASS]


@pytest.mark.parametrize("start", [0.0, 3.0], ids=["from outside", "from inside"])
def test_grass_stops_beams_at_its_rate(start):
    """The share of rays stopped and their mean free path follow the exponential law."""
    grass = box(SemanticClass.HIGH_GRASS, (3, 0, 1), (2, 19, 2))
    wall = box(SemanticClass.WALL, (8, 0, 1), (1, 19, 2))
    scene = RayScene(flat_world(grass, wall))
    n = 20_000
    origins = np.column_stack([np.full(n, start), np.linspace(-9.4, 9.4, n), np.ones(n)]).astype(
        np.float32
    )
    directions = np.tile(np.array([[1, 0, 0]], dtype=np.float32), (n, 1))
    ranges, classes = scene.cast(*drawn(rays_of(origins, directions)))
    rate = TRAITS[SemanticClass.HIGH_GRASS].hits_per_metre
    inside = 4.0 - max(start, 2.0)
    stopped = classes == SemanticClass.HIGH_GRASS
    assert stopped.mean() == pytest.approx(1 - np.exp(-rate * inside), abs=0.03)
    assert set(classes[~stopped]) == {SemanticClass.WALL}
    depth = ranges[stopped] + start - max(start, 2.0)
    assert 0 <= depth.min() < 0.01
    mean = 1 / rate - inside / (np.exp(rate * inside) - 1)
    assert depth.mean() == pytest.approx(mean, rel=0.15)


def test_two_overlapping_bushes_are_one_bush():
    """Overlapping objects of one class stop as many beams as one of them."""
    one = flat_world(box(SemanticClass.BUSH, (3, 0, 1), (0.2, 19, 2)))
    two = flat_world(*[box(SemanticClass.BUSH, (3, 0, 1), (0.2, 19, 2))] * 2)
    places = np.random.default_rng(1).uniform([-9.4, 0.1], [9.4, 1.9], (20_000, 2))
    origins = np.column_stack([np.zeros(20_000), places]).astype(np.float32)
    directions = np.tile(np.array([[1, 0, 0]], dtype=np.float32), (20_000, 1))
    shares = [
        np.isfinite(RayScene(w).cast(*drawn(rays_of(origins, directions)))[0]).mean()
        for w in (one, two)
    ]
    assert shares[0] == pytest.approx(1 - np.exp(-5.0 * 0.2), abs=0.05)
    assert shares[1] == pytest.approx(shares[0], abs=0.012)


def test_rays_with_nan_hit_nothing():
    """A NaN gives no hit, and leaves the other rays alone."""
    scene = RayScene(flat_world(box(SemanticClass.WALL, (3, 0, 1), (1, 4, 2))))
    rays = np.tile(np.array([[0, 0, 1, 1, 0, 0]], dtype=np.float32), (7, 1))
    rays[np.arange(6), np.arange(6)] = np.nan
    with np.errstate(invalid="ignore"):
        ranges, classes = through_plants(scene, rays)
    assert np.isinf(ranges[:6]).all()
    assert (classes[:6] == NO_CLASS).all()
    assert ranges[6] == pytest.approx(2.5)


def test_a_scene_without_objects_is_bare_ground():
    """A world without objects has ground and sky."""
    scene = RayScene(flat_world())
    down = np.array([[0.3, 0.4, 1.0, 0.0, 0.0, -1.0], [0, 0, 1, 0, 0, 1]], dtype=np.float32)
    ranges, classes = through_plants(scene, down)
    np.testing.assert_allclose(ranges, [1.0, np.inf])
    assert classes.tolist() == [SemanticClass.GROUND, NO_CLASS]


def test_a_dented_object_is_named():
    """The error names class, place and dent of an object that is not convex."""
    corners = np.array(
        [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.3, 0.3, 0], [0.5, 0.5, 2]], dtype=np.float32
    )
    faces = [[0, 1, 3], [0, 3, 2], [0, 4, 1], [0, 2, 4], [1, 4, 3], [3, 4, 2]]
    dented = SceneObject(SemanticClass.ROCK, corners, np.array(faces, dtype=np.uint32))
    with pytest.raises(ValueError, match="expected convex objects, got a rock at"):
        RayScene(flat_world(dented))


def test_leaves_in_wind_change_with_time_and_stand_still_without():
    """Rays of one time see the same leaves, whoever casts them."""
    bush = box(SemanticClass.BUSH, (3.0, 0.0, 1.0), (1.0, 6.0, 2.0))
    rng = np.random.default_rng(0)
    origins = np.column_stack([np.zeros(2000), rng.uniform(-2, 2, 2000), rng.uniform(0.3, 2, 2000)])
    rays = rays_of(origins, np.tile([1.0, 0.0, 0.0], (2000, 1)))
    depths = np.ones(2000, dtype=np.float32)
    blown = RayScene(replace(flat_world(bush), wind=0.5))
    found = [blown.cast(rays, depths, times=np.full(2000, t))[0] for t in (0.0, 0.0, 60.0)]
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[0], blown.cast(rays, depths)[0])
    assert 0.1 < (found[0] != found[2]).mean() < 0.9
    still = RayScene(flat_world(bush))
    later = still.cast(rays, depths, times=np.full(2000, 60.0))[0]
    np.testing.assert_array_equal(still.cast(rays, depths)[0], later)
