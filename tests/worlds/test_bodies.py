"""Collision bodies: ground at its height, solid objects only, in meshes of bounded size."""

import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import pytest

from tests.support.plants import module_needs_bullet

module_needs_bullet()

from terrain.classes import SemanticClass
from terrain.objects import box
from worlds import bodies as bodies_module
from worlds.bodies import build_bodies
from worlds.quiet_pybullet import pybullet


@pytest.fixture
def client():
    """Return a physics client."""
    number = pybullet.connect(pybullet.DIRECT)
    yield number
    pybullet.disconnect(number)


def hit(client, x, y):
    """Return body and height [m] of the first contact from above."""
    ((body, _, _, place, _),) = pybullet.rayTest([x, y, 9.0], [x, y, -9.0], physicsClientId=client)
    return body, place[2]


def test_the_ground_has_its_heights_and_plants_no_body(make_ground, client):
    """A slope is where it should be, a wall stands on it, and grass is not there."""
    wall = box(SemanticClass.WALL, (3.0, 1.0, 1.0), (1.0, 1.0, 4.0))
    grass = box(SemanticClass.HIGH_GRASS, (-3.0, 1.0, 1.0), (1.0, 1.0, 4.0))
    world = make_ground(lambda x, y: 0.3 * x - 0.1 * y, (wall, grass))
    bodies = build_bodies(world, client)
    assert len(bodies.solids) == 1
    assert hit(client, 5.02, -2.03) == (bodies.ground, pytest.approx(1.709, abs=1e-3))
    assert hit(client, 3.0, 1.0) == (bodies.solids[0], pytest.approx(3.0, abs=1e-3))
    assert hit(client, -3.0, 1.0) == (bodies.ground, pytest.approx(-1.0, abs=1e-3))


def test_many_objects_make_several_meshes_and_none_is_lost(make_ground, client, monkeypatch):
    """A mesh is full after its number of triangles; every object is in one of them."""
    monkeypatch.setattr(bodies_module, "_MAX_TRIANGLES", 20)
    walls = [box(SemanticClass.WALL, (x, 0.0, 1.0), (0.5, 0.5, 2.0)) for x in range(-4, 5, 2)]
    bodies = build_bodies(make_ground(objects=walls), client)
    assert len(bodies.solids) == 3
    found = [hit(client, x, 0.0) for x in range(-4, 5, 2)]
    assert [body for body, _ in found] == [bodies.solids[k] for k in (0, 0, 1, 1, 2)]
    assert [height for _, height in found] == pytest.approx([2.0] * 5, abs=1e-3)


def test_a_bare_world_has_no_solids(make_ground, client):
    """Ground alone is one body."""
    assert build_bodies(make_ground(), client).solids == ()


def sizes_of_a_process(world, count):
    """Return the memory of this process after each of some times that a world was closed [MB]."""
    sizes = []
    for _ in range(count):
        number = pybullet.connect(pybullet.DIRECT)
        build_bodies(world, number)
        pybullet.disconnect(number)
        pages = int(Path("/proc/self/statm").read_text().split()[1])
        sizes.append(pages * os.sysconf("SC_PAGE_SIZE") / 1e6)
    return sizes


def test_a_world_that_is_closed_leaves_no_memory_behind(make_ground):
    """Ten thousand triangles a world, 5 MB: kept, ten worlds would be 50 MB.

    In a process of its own, whose heap has no gaps of other tests; it settles in the first five.
    """
    posts = [box(SemanticClass.WALL, (0.01 * k, 1.0, 1.0), (1.0, 1.0, 4.0)) for k in range(900)]
    world = make_ground(objects=posts)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        sizes = pool.submit(sizes_of_a_process, world, 15).result()
    assert sizes[-1] - max(sizes[:5]) < 10.0
