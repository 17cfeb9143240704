"""Collision bodies: ground at its height, solid objects only, in meshes of bounded size."""

import ctypes

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


class Allocations(ctypes.Structure):
    """What glibc's ``mallinfo2`` counts; sums of all arenas, in bytes."""

    _fields_ = [
        (name, ctypes.c_size_t)
        for name in (
            *("arena", "ordblks", "smblks", "hblks", "hblkhd"),
            *("usmblks", "fsmblks", "uordblks", "fordblks", "keepcost"),
        )
    ]


def allocated():
    """Return what is allocated and not freed [MB]: without the gaps that the process's size has."""
    library = ctypes.CDLL(None)
    if not hasattr(library, "mallinfo2"):
        pytest.skip("the C library counts no allocations (mallinfo2, glibc 2.33 and newer)")
    library.mallinfo2.restype = Allocations
    counts = library.mallinfo2()
    return (counts.uordblks + counts.hblkhd) / 1e6


def test_a_world_that_is_closed_leaves_no_memory_behind(make_ground):
    """Ten thousand triangles a world, 5 MB: kept, four worlds would be 20 MB."""
    posts = [box(SemanticClass.WALL, (0.01 * k, 1.0, 1.0), (1.0, 1.0, 4.0)) for k in range(900)]
    world = make_ground(objects=posts)
    sizes = []
    for _ in range(6):
        number = pybullet.connect(pybullet.DIRECT)
        build_bodies(world, number)
        pybullet.disconnect(number)
        sizes.append(allocated())
    assert sizes[-1] - sizes[1] < 1.0
