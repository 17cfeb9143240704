"""The walk of rays: known hits on slopes, from below, across blocks and beyond the ground."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.objects import box
from worlds.rays.geometry import NO_CLASS
from worlds.rays.scene import RayScene


def cast(world, origin, direction, depth=np.inf, max_range=np.inf):
    """Return range and class of one ray."""
    direction = np.asarray(direction) / np.linalg.norm(direction)
    ray = np.array([[*origin, *direction]], dtype=np.float32)
    depths = np.full(1, depth, dtype=np.float32)
    ranges, classes = RayScene(world).cast(ray, depths, max_range)
    return float(ranges[0]), int(classes[0])


@pytest.fixture(scope="module")
def slope(make_ground):
    """Return a plane that rises by 0.2 along x and falls by 0.1 along y."""
    return make_ground(lambda x, y: 0.2 * x - 0.1 * y)


def test_rays_hit_a_plane_where_geometry_says(slope):
    """From above and from below, in any direction, also along the axes and diagonals."""
    rng = np.random.default_rng(0)
    normal = np.array([-0.2, 0.1, 1.0])
    directions = [
        *rng.normal(size=(60, 3)),
        [1, 0, 0],
        [-1, 0, 0],
        [0, 1, 0],
        [1, 1, 0],
        [1, -1, 0],
    ]
    hits = 0
    for direction in np.array(directions):
        direction = direction / np.linalg.norm(direction)
        for height in (0.5, -0.5):
            distance = -height / (normal @ direction)
            end = distance * direction[:2] + [0.3, 0.7]
            found, kind = cast(slope, (0.3, 0.7, 0.06 - 0.07 + height), direction)
            if distance > 0 and np.abs(end).max() < 9.9:
                assert found == pytest.approx(distance, rel=1e-3)
                assert kind == SemanticClass.GROUND
                hits += 1
            elif distance < 0 or np.abs(end).max() > 10.1:
                assert (found, kind) == (np.inf, NO_CLASS)
    assert hits > 40


def test_a_hit_beyond_the_range_is_none(make_ground):
    """Ground and objects alike end at the range, whatever block it ends in."""
    wall = box(SemanticClass.WALL, (5.0, 0.0, 1.0), (1.0, 4.0, 2.0))
    world = make_ground(objects=(wall,))
    for max_range, expected in ((4.4, np.inf), (4.6, 4.5), (99.0, 4.5)):
        assert cast(world, (0, 0, 1), (1, 0, 0), max_range=max_range)[0] == pytest.approx(expected)
    for max_range, expected in ((0.9, np.inf), (1.1, 1.0)):
        assert cast(world, (0, 0, 1), (0, 0, -1), max_range=max_range)[0] == pytest.approx(expected)


def test_the_nearest_of_several_objects_is_hit(make_ground):
    """Objects of one block and of several, in any order, on a ray either way."""
    walls = [box(SemanticClass.WALL, (x, 0.0, 1.0), (0.1, 4.0, 2.0)) for x in (4.0, 2.0, 2.4, 6.0)]
    post = box(SemanticClass.POST, (-3.0, 0.0, 1.0), (0.2, 0.2, 2.0))
    world = make_ground(objects=(*walls, post))
    assert cast(world, (0, 0, 1), (1, 0, 0)) == (pytest.approx(1.95), SemanticClass.WALL)
    assert cast(world, (3, 0, 1), (1, 0, 0)) == (pytest.approx(0.95), SemanticClass.WALL)
    assert cast(world, (0, 0, 1), (-1, 0, 0)) == (pytest.approx(2.9), SemanticClass.POST)
    assert cast(world, (0, 0, 2.5), (1, 0, 0)) == (np.inf, NO_CLASS)


def test_a_nearer_object_of_a_later_block_is_hit(make_ground):
    """A long oblique wall is found in the first block of its box, before a nearer post is."""
    wall = box(SemanticClass.WALL, (4.0, 0.0, 1.0), (11.0, 0.1, 2.0), yaw=np.pi / 4)
    post = box(SemanticClass.POST, (3.0, 1.0, 1.0), (0.2, 0.2, 2.0))
    east = ((-2.0, 1.0, 1.0), (1, 0, 0))
    found = cast(make_ground(objects=(wall,)), *east)
    assert found == (pytest.approx(7.0 - 0.05 * np.sqrt(2)), SemanticClass.WALL)
    found = cast(make_ground(objects=(wall, post)), *east)
    assert found == (pytest.approx(4.9), SemanticClass.POST)


def test_from_inside_of_an_opaque_object_the_far_face_is_hit(make_ground):
    """A ray that begins in a wall ends where it leaves it."""
    wall = box(SemanticClass.WALL, (0.0, 0.0, 1.0), (1.0, 4.0, 2.0))
    world = make_ground(objects=(wall,))
    assert cast(world, (0.2, 0, 1), (1, 0, 0)) == (pytest.approx(0.3), SemanticClass.WALL)


def test_objects_beside_the_ground_are_hit_and_the_ground_ends_at_its_border(make_ground):
    """A wall outside of the heightfield stops rays; a ray down beside the ground hits nothing."""
    wall = box(SemanticClass.WALL, (14.0, 0.0, 1.0), (1.0, 4.0, 2.0))
    world = make_ground(objects=(wall,))
    assert cast(world, (0, 0, 1), (1, 0, 0)) == (pytest.approx(13.5), SemanticClass.WALL)
    assert cast(world, (12, 0, 1), (0, 0, -1)) == (np.inf, NO_CLASS)
    assert cast(world, (9.9, 0, 1), (0, 0, -1))[0] == pytest.approx(1.0)


def test_a_ray_ends_at_its_optical_depth(make_ground):
    """More depth leads farther, from grass into the bush in it, and through both to the wall."""
    grass = box(SemanticClass.HIGH_GRASS, (3.0, 0.0, 1.0), (2.0, 4.0, 2.0))
    bush = box(SemanticClass.BUSH, (3.5, 0.0, 1.0), (1.0, 4.0, 2.0))
    more = box(SemanticClass.BUSH, (3.6, 0.0, 1.0), (0.4, 4.0, 2.0))
    wall = box(SemanticClass.WALL, (6.0, 0.0, 1.0), (1.0, 4.0, 2.0))
    world = make_ground(objects=(grass, bush, more, wall))
    east = ((0, 0, 1), (1, 0, 0))
    hits = [cast(world, *east, depth) for depth in np.linspace(1e-6, 30.0, 200)]
    ranges = np.array([distance for distance, _ in hits])
    assert (np.diff(ranges) >= 0).all()
    assert hits[-1] == (pytest.approx(5.5), SemanticClass.WALL)
    for distance, kind in hits[:-1]:
        between = SemanticClass.HIGH_GRASS if distance < 3.0 else SemanticClass.BUSH
        assert kind == (between if distance < 4.0 else SemanticClass.WALL)
    assert {kind for _, kind in hits} >= {SemanticClass.HIGH_GRASS, SemanticClass.BUSH}
    assert cast(world, *east, 0.0) == (pytest.approx(2.0), SemanticClass.HIGH_GRASS)
    assert cast(world, *east) == (pytest.approx(5.5), SemanticClass.WALL)


def test_the_class_of_the_ground_is_that_of_the_cell_that_is_hit(make_ground):
    """A cell of another class is found at its own place, x before y."""
    world = make_ground(cell=0.5)
    world.surface[30, 8] = SemanticClass.PATH
    x, y = -10 + 30.5 * 0.5, -10 + 8.5 * 0.5
    assert cast(world, (x, y, 1), (0, 0, -1))[1] == SemanticClass.PATH
    for dx, dy in ((0.5, 0), (-0.5, 0), (0, 0.5), (0, -0.5)):
        assert cast(world, (x + dx, y + dy, 1), (0, 0, -1))[1] == SemanticClass.GROUND
