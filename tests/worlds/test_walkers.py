"""Walkers of a world: what they turn back at, where they begin, and that they cost nothing else."""

import math

import numpy as np

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box, frustum
from worlds.agents import check_movers
from worlds.catalogue import make_world, patch
from worlds.truth import TruthConfig, build_truth
from worlds.walker_config import AnimalConfig, PeopleConfig, VehicleConfig, WalkerConfig
from worlds.walkers import draw_walkers, solids_room
from worlds.world import Start, Task

GROUND = Heightfield(np.zeros((121, 81), dtype=np.float32), 0.5)
BARE = build_truth(GROUND, (), TruthConfig())
MANY = WalkerConfig(
    people=PeopleConfig(alone=40, groups=10, yielding=0.3),
    animals=AnimalConfig(count=8),
    vehicles=VehicleConfig(count=2),
)


def test_solids_are_circles_or_outlines_and_the_border_walls():
    """A trunk is round and a wall is not; stones and grass stop nobody."""
    objects = (
        frustum(SemanticClass.TRUNK, (3.0, 2.0, 0.0), (0.3, 0.1), 3.0, 20),
        box(SemanticClass.WALL, (-4.0, 1.0, 0.5), (4.0, 0.2, 1.0), 0.5),
        box(SemanticClass.STONE, (0.0, 0.0, 0.0), (0.2, 0.2, 0.05)),
        box(SemanticClass.HIGH_GRASS, (0.0, 5.0, 0.0), (1.0, 1.0, 0.5)),
    )
    room = solids_room(GROUND, objects)
    assert room.half == (29.0, 19.0)
    np.testing.assert_allclose(room.circles, [[3.0, 2.0, 0.3]], atol=1e-6)
    assert len(room.edges) == 4
    places = [[3.0, 2.5], [-4.0, 1.0], [-4.0 - 0.5 * np.sin(0.5), 1.0 + 0.5 * np.cos(0.5)]]
    found = room.clearance(np.array([*places, [0.0, 0.0], [0.0, 5.0], [28.5, 0.0]]))
    np.testing.assert_allclose(found[[0, 2, 5]], [0.2, 0.4, 0.5], atol=1e-5)
    assert found[1] < 0.0
    assert (found[3:5] > 1.0).all()


def test_walkers_begin_at_free_places_away_from_starts():
    """Sizes and speeds are within their bounds; a share comes and goes."""
    room = solids_room(GROUND, [frustum(SemanticClass.TRUNK, (9.0, 9.0, 0.0), (4.0, 4.0), 3.0)])
    tasks = [Task(Start(0.0, 0.0, 0.0), ((9.0, 0.0),)), Task(Start(-20.0, 5.0, 0.0), ())]
    config = WalkerConfig(count=100, passing=0.3)
    found = draw_walkers(config, room, tasks, np.random.default_rng(0), BARE)
    assert len(found) == 100
    places = np.array([one.place for one in found])
    for task in tasks:
        away = np.hypot(*(places - [task.start.x, task.start.y]).T)
        assert (away > 6.0 + 0.2).all()
    assert (room.clearance(places) > 0.2).all()
    speeds = np.array([np.hypot(*one.velocity) for one in found])
    for values, (low, high) in (
        (speeds, config.speed),
        (np.array([one.plan.radius for one in found]), config.radius),
        (np.array([one.plan.height for one in found]), config.height),
    ):
        assert low <= values.min() < values.max() <= high
    passing = [one for one in found if one.plan.duration is not None]
    assert 20 <= len(passing) <= 40
    assert all(one.plan.appears_at > 0.0 for one in passing)
    staying = [one for one in found if one.plan.duration is None]
    assert {one.plan.appears_at for one in staying} == {0.0}


def test_walkers_do_not_change_the_rest_of_a_world():
    """A small world with walkers is the one without, and its seed gives the same walkers again."""
    config = patch("natural-walkers", 40.0, 0.25)
    assert config.walkers.people.alone == 2
    bare = config.model_copy(update={"walkers": WalkerConfig()})
    with_them, again = (make_world("natural-walkers", 3, config=config) for _ in range(2))
    without = make_world("natural-walkers", 3, config=bare)
    assert len(with_them.movers) >= 3
    assert with_them.movers == again.movers
    assert without.movers == ()
    assert with_them.tasks == without.tasks
    np.testing.assert_array_equal(with_them.ground.heights, without.ground.heights)
    np.testing.assert_array_equal(with_them.truth.reason, without.truth.reason)
    assert len(with_them.objects) == len(without.objects)


def drawn(config, difficulty=0.5, tasks=(), seed=0):
    """Return the movers of a bare world."""
    room = solids_room(GROUND, ())
    return draw_walkers(config, room, tasks, np.random.default_rng(seed), BARE, difficulty)


def of_kind(movers, kind):
    """Return the movers of a kind."""
    return [one for one in movers if one.behaviour.kind == kind]


def test_numbers_of_every_kind_are_those_of_the_settings():
    """Groups have two to four people, who share speed, heading and manner."""
    found = drawn(MANY)
    check_movers(found)
    assert len(of_kind(found, "animal")) == 8
    assert len(of_kind(found, "vehicle")) == 2
    people = of_kind(found, "person")
    leaders = {one.behaviour.leader for one in people} - {None}
    assert len(leaders) == 10
    alone = [m for m, one in enumerate(found) if one in people and one.behaviour.leader is None]
    assert len(set(alone) - leaders) == 40
    for leader in leaders:
        led = [one for one in people if one.behaviour.leader == leader]
        assert 1 <= len(led) <= 3
        first = found[leader]
        for one in led:
            assert one.plan.speed == first.plan.speed
            assert one.velocity == first.velocity
            assert one.behaviour.yields == first.behaviour.yields
            assert 0.6 < math.dist(one.place, first.place) < 1.2


def test_a_group_begins_in_its_formation():
    """The slot of each is where it stands, seen along the leader's heading."""
    found = drawn(MANY)
    for one in found:
        if one.behaviour.leader is not None:
            first = found[one.behaviour.leader]
            heading = np.array(first.velocity) / np.hypot(*first.velocity)
            off = np.subtract(one.place, first.place)
            slot = (off @ heading, heading[0] * off[1] - heading[1] * off[0])
            np.testing.assert_allclose(slot, one.behaviour.slot, atol=1e-9)


def test_a_share_of_people_gives_way():
    """About the share of settings; none and all at the ends."""
    for share, low, high in ((0.0, 0, 0), (0.3, 5, 20), (1.0, 40, 40)):
        people = PeopleConfig(alone=40, yielding=share)
        found = drawn(WalkerConfig(people=people))
        assert low <= sum(one.behaviour.yields for one in found) <= high


def test_difficulty_raises_number_and_speed():
    """From 0 to 1 three times as many, half as fast again."""
    easy, hard = (drawn(MANY, difficulty) for difficulty in (0.0, 1.0))
    assert (len(of_kind(easy, "animal")), len(of_kind(hard, "animal"))) == (4, 12)
    for found, factor in ((easy, 0.8), (hard, 1.2)):
        speeds = [one.plan.speed for one in of_kind(found, "animal")]
        assert factor * 1.4 <= min(speeds) <= max(speeds) <= factor * 2.4
    check_movers(hard)


def test_nobody_begins_on_another_or_near_a_start():
    """Gaps of all pairs are open, and of all but vehicles from the start 6 m."""
    tasks = [Task(Start(3.0, 2.0, 0.0), ((9.0, 0.0),))]
    trunk = frustum(SemanticClass.TRUNK, (9.0, 9.0, 0.0), (4.0, 4.0), 3.0)
    room = solids_room(GROUND, [trunk])
    truth = build_truth(GROUND, (trunk,), TruthConfig())
    found = draw_walkers(MANY, room, tasks, np.random.default_rng(1), truth)
    places, radii = np.array([one.place for one in found]), [one.plan.radius for one in found]
    away = np.hypot(*(places[:, None] - places).transpose(2, 0, 1)) + 99.0 * np.eye(len(found))
    assert (away - np.add.outer(radii, radii)).min() > 0.0
    assert (room.clearance(places) - radii).min() > 0.0
    gaps = np.hypot(*(places - [3.0, 2.0]).T) - radii
    assert gaps.min() > 2.0
    assert min(gap for gap, one in zip(gaps, found, strict=True) if not one.behaviour.track) > 6.0


def test_a_vehicle_begins_at_the_begin_of_its_track():
    """It heads for the second corner at its speed."""
    for one in of_kind(drawn(MANY), "vehicle"):
        first, second = np.array(one.behaviour.track[:2])
        np.testing.assert_allclose(one.place, first)
        way = (second - first) / np.hypot(*(second - first))
        np.testing.assert_allclose(one.velocity, one.plan.speed * way)


def test_other_kinds_leave_those_that_go_straight_as_they_are():
    """They have draws of their own."""
    plain = WalkerConfig(count=5)
    both = plain.model_copy(update={"people": PeopleConfig(alone=4)})
    assert drawn(both)[:5] == drawn(plain)
    assert drawn(both) == drawn(both)
    assert drawn(both) != drawn(both, seed=1)
