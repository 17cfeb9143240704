"""Rays through objects: known ranges at a cube, and where porous ones stop a ray."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from worlds.rays.geometry import NO_CLASS, Hit, Ray
from worlds.rays.objects import LEAF, RATES, Crossings, absorb, cross, misses_box
from worlds.rays.wind import STILL_AIR, Wind

# A cube from 1 to 3 along each axis: outward normals and their distances.
CUBE = np.array(
    [[*sign * axis, 3.0 * sign if sign > 0 else -1.0] for axis in np.eye(3) for sign in (1, -1)]
)
BOX = np.array([[1.0, 1.0, 1.0, 3.0, 3.0, 3.0]])
NOTHING = Hit(np.inf, NO_CLASS)
BUSH, FOLIAGE, GRASS = SemanticClass.BUSH, SemanticClass.FOLIAGE, SemanticClass.HIGH_GRASS


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


def fan(count=3000, x=0.0):
    """Return rays along x that begin at places all over y and z."""
    rng = np.random.default_rng(2)
    return [ray((x, y, z), (1.0, 0.0, 0.0)) for y, z in rng.uniform(-40.0, 40.0, (count, 2))]


def through(parts, hit=NOTHING, x=0.0, depths=None, wind=STILL_AIR, time=0.0):
    """Return ranges and classes of many rays with random depths through crossings."""
    rays = fan(x=x)
    if depths is None:
        depths = np.random.default_rng(3).standard_exponential(len(rays))
    hits = [
        absorb(one, hit, float(d), crossings(*parts), wind, time)
        for one, d in zip(rays, depths, strict=True)
    ]
    return np.array([each.range for each in hits]), np.array([each.kind for each in hits])


@pytest.mark.parametrize("kind", [BUSH, FOLIAGE, SemanticClass.MEADOW, SemanticClass.HIGH_GRASS])
def test_the_mean_free_path_is_that_of_the_class(kind):
    """As many rays pass a path as at a constant rate, whatever the leaves' cells."""
    length = 1.0 / RATES[kind]
    ranges, kinds = through([(2.0, 2.0 + length, kind)])
    assert np.isinf(ranges).mean() == pytest.approx(np.exp(-1.0), abs=0.05)
    stopped = np.isfinite(ranges)
    assert (kinds[stopped] == kind).all()
    assert (kinds[~stopped] == NO_CLASS).all()
    mean = length * (1.0 - 1.0 / (np.e - 1.0))
    assert (ranges[stopped] - 2.0).mean() == pytest.approx(mean, rel=0.12)


def test_what_is_nearer_is_hit_first():
    """A stone within the bush stops all rays that leaves have not."""
    wall = Hit(2.1, np.int64(SemanticClass.STONE))
    ranges, kinds = through([(2.0, 4.0, BUSH)], wall)
    assert ranges.max() == 2.1
    assert (kinds == SemanticClass.STONE).mean() == pytest.approx(np.exp(-0.5), abs=0.05)


def test_whoever_looks_twice_sees_the_same_leaves():
    """Rays with other depths end in the same cells but for one in seven, which the wind lets by."""
    part = [(2.0, 6.0, BUSH)]
    rng = np.random.default_rng(4)
    one, other = (through(part, depths=rng.standard_exponential(3000))[0] for _ in range(2))
    assert (np.abs(one - other) < LEAF).mean() == pytest.approx(0.76, abs=0.06)
    still = np.full(3000, 1e-9)
    np.testing.assert_array_equal(through(part, depths=still)[0], through(part, depths=still)[0])


def test_grass_stands_upright():
    """Rays above each other end in the same column of grass, and in other cells of a bush."""
    low, high = (ray((0.0, 0.3, z), (1.0, 0.0, 0.0)) for z in (0.1, 0.7))
    ends = [
        absorb(each, NOTHING, 1e-9, crossings((0.0, 90.0, GRASS)), STILL_AIR, 0.0).range
        for each in (low, high)
    ]
    assert ends[0] == ends[1]
    ends = [
        absorb(each, NOTHING, 1e-9, crossings((0.0, 90.0, FOLIAGE)), STILL_AIR, 0.0).range
        for each in (low, high)
    ]
    assert ends[0] != ends[1]


def test_overlapping_objects_of_a_class_are_one_and_of_two_classes_add_up():
    """The densest class is what was hit, where it is."""
    same, _ = through([(1.0, 1.2, BUSH), (1.0, 1.2, BUSH)])
    assert np.isinf(same).mean() == pytest.approx(np.exp(-1.0), abs=0.05)
    both, kinds = through([(1.0, 1.2, FOLIAGE), (1.0, 1.2, BUSH)])
    passed = np.exp(-0.2 * (RATES[BUSH] + RATES[FOLIAGE]))
    assert np.isinf(both).mean() == pytest.approx(passed, abs=0.05)
    assert set(kinds[np.isfinite(both)]) == {BUSH}
    behind, kinds = through([(1.0, 3.0, FOLIAGE), (1.0, 1.2, BUSH)])
    assert set(kinds[behind < 1.2 - 1e-9]) == {BUSH}
    assert set(kinds[behind > 1.2]) == {FOLIAGE, NO_CLASS}


def test_a_ray_that_begins_inside_is_stopped_from_its_begin():
    """What lies behind the origin does not count; without any depth it ends at the first face."""
    ranges, _ = through([(-3.0, 0.2, BUSH)])
    assert np.isinf(ranges).mean() == pytest.approx(np.exp(-1.0), abs=0.05)
    assert absorb(fan(1)[0], NOTHING, 0.0, crossings((2.0, 3.0, BUSH)), STILL_AIR, 0.0) == (
        2.0,
        BUSH,
    )


def test_wind_changes_few_rays_in_a_second_and_more_in_a_minute():
    """The rate of the class stays; without wind, time changes nothing."""
    wind, path, ones = Wind(0.3, 20.0, np.uint64(5)), [(2.0, 2.2, BUSH)], np.ones(3000)
    found = {t: through(path, depths=ones, wind=wind, time=t)[0] for t in (0.0, 1.0, 90.0)}
    changed = {t: (found[t] != found[0.0]).mean() for t in (1.0, 90.0)}
    assert 0.0 < changed[1.0] < 0.04
    assert 2 * changed[1.0] < changed[90.0] < 0.3
    shares = [np.isinf(each).mean() for each in found.values()]
    assert np.ptp(shares) < 0.04
    still = [through(path, depths=ones, time=t)[0] for t in (0.0, 90.0)]
    np.testing.assert_array_equal(*still)
