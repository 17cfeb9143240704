"""Rays through objects: known ranges at a cube, and where porous ones stop a ray."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from worlds.rays.geometry import NO_CLASS, Hit, Ray
from worlds.rays.objects import RATES, Crossings, absorb, cross, misses_box

# A cube from 1 to 3 along each axis: outward normals and their distances.
CUBE = np.array(
    [[*sign * axis, 3.0 * sign if sign > 0 else -1.0] for axis in np.eye(3) for sign in (1, -1)]
)
BOX = np.array([[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]])
NOTHING = Hit(np.inf, NO_CLASS)
BUSH, FOLIAGE = SemanticClass.BUSH, SemanticClass.FOLIAGE


def ray(origin, direction):
    unit = np.array(direction, dtype=float) / np.linalg.norm(direction)
    with np.errstate(divide="ignore"):
        return Ray(*map(float, origin), *unit.tolist(), *(1.0 / unit).tolist())


@pytest.mark.parametrize(
    ("origin", "direction", "enter", "leave"),
    [
        ((0, 2, 2), (1, 0, 0), 1.0, 3.0),
        ((5, 2, 2), (-1, 0, 0), 2.0, 4.0),
        ((2, 2, 2), (0, 0, 1), -1.0, 1.0),
        ((0, 0, 2), (1, 1, 0), np.sqrt(2), 3 * np.sqrt(2)),
        ((0, 1.5, 2), (1, 0.5, 0), np.hypot(1, 0.5), np.hypot(3, 1.5)),
        ((0, 0.5, 2), (1, 2, 0), np.hypot(1, 2), np.hypot(1.25, 2.5)),
    ],
)
def test_a_ray_is_inside_from_the_last_plane_in_to_the_first_one_out(
    origin, direction, enter, leave
):
    """From outside along an axis and askew, from behind, and from within."""
    found = cross(CUBE, 0, len(CUBE), ray(origin, direction))
    assert found == pytest.approx((enter, leave))
    assert not misses_box(ray(origin, direction), BOX, 0, 10.0)


@pytest.mark.parametrize(
    ("origin", "direction"),
    [((0, 4, 2), (1, 0, 0)), ((0, 0, 2), (1, 0.2, 0)), ((0, 0.5, 0.5), (1, 0, 0))],
)
def test_a_ray_that_misses_leaves_before_it_enters(origin, direction):
    """Beside the cube along a face, askew, and below."""
    enter, leave = cross(CUBE, 0, len(CUBE), ray(origin, direction))
    assert leave < enter
    assert misses_box(ray(origin, direction), BOX, 0, 10.0)


def test_boxes_are_slabs():
    """Random rays at a box of three edges: in and out are the last and the first of its slabs."""
    low, high = np.array([1.0, -2.0, 0.5]), np.array([2.0, 4.0, 3.0])
    planes = np.vstack([np.column_stack([np.eye(3), high]), np.column_stack([-np.eye(3), -low])])
    rng, hits = np.random.default_rng(0), 0
    for _ in range(300):
        origin, aim = rng.uniform(-4, 6, 3), rng.uniform(low - 1, high + 1)
        one = ray(origin, aim - origin)
        direction = np.array([one.dx, one.dy, one.dz])
        begin, end = np.sort([(low - origin) / direction, (high - origin) / direction], axis=0)
        enter, leave = cross(planes, 0, 6, one)
        hits += begin.max() <= end.min()
        if begin.max() <= end.min():
            assert (enter, leave) == pytest.approx((begin.max(), end.min()))
        else:
            assert leave < enter
        is_missed = max(begin.max(), 0.0) > min(end.min(), 20.0)
        assert misses_box(one, np.array([[*low, *high]]), 0, 20.0) == is_missed
    assert 100 < hits < 290


def test_a_box_counts_within_the_range_and_before_the_ray_alone():
    """Beyond the largest range, and behind the origin, there is none."""
    ahead = ray((0, 2, 2), (1, 0, 0))
    assert misses_box(ahead, BOX, 0, 0.9)
    assert not misses_box(ahead, BOX, 0, 1.1)
    assert misses_box(ray((0, 2, 2), (-1, 0, 0)), BOX, 0, 10.0)


def test_only_the_planes_of_the_object_count():
    """Planes before the first and from the last on are other objects'."""
    others = np.vstack([[[1, 0, 0, -9.0]], CUBE, [[1, 0, 0, -9.0]]])
    assert cross(others, 1, 7, ray((0, 2, 2), (1, 0, 0))) == pytest.approx((1.0, 3.0))


def crossings(*parts):
    """Return crossings: where each is entered and left, and its class."""
    enters, leaves, kinds = zip(*parts, strict=True)
    return Crossings(np.array(enters, float), np.array(leaves, float), np.array(kinds, np.uint8))


def test_a_ray_ends_where_its_depth_is_used_up():
    """At the rate of the class from where it enters; with less on the way it goes on."""
    one = crossings((2.0, 4.0, BUSH))
    found = absorb(NOTHING, 0.5 * RATES[BUSH], one)
    assert (found.range, found.kind) == (pytest.approx(2.5), BUSH)
    assert absorb(NOTHING, 2.1 * RATES[BUSH], one) == NOTHING
    wall = Hit(3.0, np.int64(SemanticClass.STONE))
    assert absorb(wall, 1.1 * RATES[BUSH], one) == wall


def test_depth_is_used_up_from_object_to_object():
    """Half of it in the first, the rest in the second, nothing in between."""
    two = crossings((5.0, 6.0, BUSH), (1.0, 1.5, BUSH))
    assert absorb(NOTHING, 0.7 * RATES[BUSH], two).range == pytest.approx(5.2)


def test_overlapping_objects_of_a_class_are_one_and_of_two_classes_add_up():
    """The densest class is what was hit."""
    same = crossings((1.0, 3.0, BUSH), (2.0, 4.0, BUSH))
    assert absorb(NOTHING, 2.5 * RATES[BUSH], same).range == pytest.approx(3.5)
    both = crossings((1.0, 3.0, FOLIAGE), (1.0, 3.0, BUSH))
    found = absorb(NOTHING, RATES[BUSH] + RATES[FOLIAGE], both)
    assert (found.range, found.kind) == (pytest.approx(2.0), BUSH)
    behind = crossings((1.0, 3.0, FOLIAGE), (1.0, 1.5, BUSH))
    found = absorb(NOTHING, 0.5 * RATES[BUSH] + RATES[FOLIAGE], behind)
    assert (found.range, found.kind) == (pytest.approx(2.0), FOLIAGE)


def test_a_ray_that_begins_inside_is_stopped_from_its_begin():
    """What lies behind the origin does not count."""
    found = absorb(NOTHING, 0.5 * RATES[BUSH], crossings((-3.0, 2.0, BUSH)))
    assert found.range == pytest.approx(0.5)
