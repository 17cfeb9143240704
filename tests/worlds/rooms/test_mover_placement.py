"""Moving obstacles of an episode: free places, drawn ways, gaps that stay open."""

import itertools
import math

import numpy as np

from worlds.rooms.mover_placement import STANDING_GAP, START_GAP, draw_movers
from worlds.rooms.room import Room, RoomPlan, RoomTask
from worlds.world import Start

TASK = RoomTask(Start(-1.0, 0.0, 0.0), (2.0, 1.0))
ROBOT = 0.2


def room(*movers, half=(4.0, 3.0)):
    """Return a room of 8 by 6 m with a box, and movers."""
    plan = {"about": "test", "half": half, "boxes": [(0.0, -1.0, 1.0, 0.5)], "movers": movers}
    return Room.of("test", RoomPlan.model_validate(plan))


def drawn(made, seed=0, task=TASK):
    """Return the movers of an episode."""
    return draw_movers(made, np.random.default_rng(seed), task, ROBOT)


def gap(one, other):
    """Return the gap between two movers [m]."""
    return math.dist(one.place, other.place) - one.plan.radius - other.plan.radius


def test_places_are_free_and_away_from_the_start():
    """Of 4 movers in 100 episodes none overlaps anything or is near the robot's start."""
    made = room(*[{"radius": 0.4, "speed": 0.5}] * 4)
    places = []
    for seed in range(100):
        movers = drawn(made, seed)
        assert len(movers) == 4
        places += [one.place for one in movers]
        assert made.clearance(np.array([one.place for one in movers])).min() > 0.4
        for one in movers:
            assert math.dist(one.place, (-1.0, 0.0)) > 0.4 + ROBOT + START_GAP
        assert min(gap(*pair) for pair in itertools.combinations(movers, 2)) > 0.0
    # They come anywhere, the goal's place included.
    assert np.ptp(places, axis=0).min() > 4.5
    assert min(math.dist(place, TASK.goal) for place in places) < 0.4


def test_what_stands_closes_no_way():
    """Standing movers keep 0.8 m from walls, the goal and each other; moving ones from them."""
    standing = [{"radius": 0.3}] * 3
    for seed in range(50):
        movers = drawn(room(*standing, {"radius": 0.2, "speed": 1.0}), seed)
        places = np.array([one.place for one in movers[:3]])
        assert room().clearance(places).min() > 0.3 + STANDING_GAP
        assert min(math.dist(p, TASK.goal) for p in places) > 0.3 + ROBOT + STANDING_GAP
        assert min(gap(*pair) for pair in itertools.combinations(movers, 2)) > STANDING_GAP
        assert all(one.velocity == (0.0, 0.0) for one in movers[:3])


def test_ways_are_drawn_all_around_with_the_plans_speed():
    """Each mover has its speed; a heading of its own is kept, others go anywhere."""
    made = room({"radius": 0.2, "speed": 0.7}, {"radius": 0.2, "speed": 0.3, "heading_deg": 90})
    velocities = np.array([[one.velocity for one in drawn(made, seed)] for seed in range(200)])
    np.testing.assert_allclose(np.hypot(*velocities[:, 0].T), 0.7)
    bearings = np.arctan2(*velocities[:, 0].T)
    counts = np.histogram(bearings, 4, (-np.pi, np.pi))[0]
    assert counts.min() > 30
    np.testing.assert_allclose(velocities[:, 1], [[0.0, 0.3]] * 200, atol=1e-12)


def test_a_place_of_its_own_is_kept():
    """Wherever the robot starts, a fixed mover is there, and others keep away from it."""
    made = room({"radius": 0.3, "speed": 0.5}, {"radius": 0.5, "place": (-1.0, 0.5)})
    for seed in range(30):
        first, second = drawn(made, seed)
        assert first.place == (-1.0, 0.5)
        assert gap(first, second) > STANDING_GAP


def test_the_same_generator_gives_the_same_movers():
    """A seed repeats, another differs."""
    made = room(*[{"radius": 0.4, "speed": 0.5}] * 2)
    assert drawn(made, 3) == drawn(made, 3)
    assert drawn(made, 3) != drawn(made, 4)
    assert drawn(room()) == ()


def test_what_finds_no_place_stays_away():
    """In a small room few standing movers fit; one that is larger than the room never does."""
    made = room(*[{"radius": 0.4}] * 30)
    assert 0 < len(drawn(made)) < 30
    assert drawn(room({"radius": 4.0, "speed": 1.0})) == ()


def test_people_have_a_seed_of_their_own_in_each_episode():
    """And the manners of their plan; who is no person has no behaviour, and draws nothing more."""
    person = {"radius": 0.3, "speed": 1.0, "is_person": True}
    walls = room(person, person | {"yields": True}, {"radius": 0.3, "speed": 1.0})
    one, other, thing = drawn(walls)
    assert (one.behaviour.yields, other.behaviour.yields, thing.behaviour) == (False, True, None)
    assert one.kind == "person"
    seeds = {mover.behaviour.seed for k in range(5) for mover in drawn(walls, k)[:2]}
    assert len(seeds) == 10
    alone = drawn(room({"radius": 0.3, "speed": 1.0}, {"radius": 0.3, "speed": 1.0}))
    with_one = drawn(room({"radius": 0.3, "speed": 1.0}, person))
    assert with_one[0] == alone[0]
    assert with_one[1].place == alone[1].place
