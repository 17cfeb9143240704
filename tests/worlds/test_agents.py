"""Agents of a world as arrays, and movers that a world cannot have."""

import numpy as np
import pytest

from tests.support.walking_worlds import agent, walker
from worlds.agents import (
    ANIMAL,
    COURSE,
    MOST,
    PERSON,
    STRAIGHT,
    VEHICLE,
    Agents,
    agents_of,
    check_movers,
    top_speed,
)
from worlds.rooms.movers import Mover, MoverPlan

TRACK = ((0.0, 0.0), (3.0, 0.0), (3.0, 4.0))


def test_behaviours_become_rows():
    """Kinds, leaders, tracks and usual speeds stand in the order of the movers."""
    agents = Agents.of(
        [
            walker((1.0, 2.0), (0.5, 0.0)),
            agent("person", (3.0, 4.0), yields=True, seed=5),
            agent("person", (3.0, 3.0), leader=1, slot=(-0.8, 0.4)),
            agent("animal", (0.0, 9.0), (0.0, 2.0), speed=2.0),
            agent("vehicle", (0.0, 0.0), track=TRACK, speed=1.5, radius=1.0),
        ]
    )
    assert agents.kinds.tolist() == [STRAIGHT, PERSON, PERSON, ANIMAL, VEHICLE]
    assert agents.yields.tolist() == [False, True, False, False, False]
    assert agents.leaders.tolist() == [0, 1, 1, 3, 4]
    assert agents.slots[2].tolist() == [-0.8, 0.4]
    assert agents.headings[3] == pytest.approx(np.pi / 2)
    assert agents.corners.tolist() == [0, 0, 0, 0, 3]
    assert agents.tracks[4].tolist() == [list(corner) for corner in TRACK]
    assert agents.speeds.tolist() == [0.5, 1.0, 1.0, 2.0, 1.5]
    np.testing.assert_array_equal(agents.draws[1], np.random.default_rng(5).random(256))


def test_a_person_alone_hurries():
    """It may be a quarter faster than usual; an animal and a vehicle never are."""
    assert [top_speed(kind, 2.0) for kind in ("person", "animal", "vehicle")] == [2.5, 2.0, 2.0]


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (agent("animal", (0, 0), speed=2.6), r"walkers\[0\].speed: expected at most 2.5 m/s"),
        (agent("person", (0, 0), speed=2.1), r"speed: .* a person of 0.25 m radius.*got 2.62"),
        (agent("person", (0, 0), (1.2, 0.0)), r"walkers\[0\].velocity: .* got 1.2"),
        (agent("person", (0, 0), leader=0), r"walkers\[0\].leader: .* got 0; name another"),
        (agent("person", (0, 0), leader=9), r"walkers\[0\].leader: .* got 9"),
    ],
)
def test_movers_that_a_world_cannot_have_are_refused(made, words):
    """The error names the mover and what is wrong with it."""
    with pytest.raises(ValueError, match=words):
        check_movers([made])


def test_one_as_fast_as_its_radius_allows_passes():
    """A radius in a control step is the bound itself."""
    check_movers([agent("animal", (0, 0), speed=2.5), agent("person", (5, 0), speed=2.0)])


def test_nobody_follows_one_who_follows():
    """A leader leads; an animal is no leader."""
    led = [agent("person", (0, 0)), agent("person", (1, 0), leader=0)]
    check_movers(led)
    with pytest.raises(ValueError, match=r"walkers\[2\].leader"):
        check_movers([*led, agent("person", (2, 0), leader=1)])
    with pytest.raises(ValueError, match=r"walkers\[1\].leader"):
        check_movers([agent("animal", (0, 0)), agent("person", (2, 0), leader=0)])


def test_the_number_is_bounded():
    """500 are allowed, one more is refused."""
    crowd = [walker((float(k), 0.0)) for k in range(MOST)]
    check_movers(crowd)
    with pytest.raises(ValueError, match="expected at most 500, got 501"):
        check_movers([*crowd, walker((-1.0, 0.0))])


def test_agents_of_one_robot_among_many_are_its_own():
    """They are those of its movers, change with those of all, and leave the others alone."""
    people = [agent("person", (3.0, 4.0), yields=True, seed=5), walker((1.0, 2.0), (0.5, 0.0))]
    alone, many = Agents.of(people), Agents.none(3, 4)
    many.put_down(1, people)
    own = agents_of(many, 1)
    for name in Agents._fields:
        np.testing.assert_array_equal(getattr(own, name)[:2], getattr(alone, name))
        assert not getattr(many, name)[[0, 2]].any()
    assert own.kinds.tolist() == [PERSON, STRAIGHT, STRAIGHT, STRAIGHT]
    own.aims[0] = 7.0, 8.0
    assert many.aims[1, 0].tolist() == [7.0, 8.0]
    many.put_down(1, people[1:])
    assert not many.kinds[1].any()


def test_one_on_a_course_is_told_apart():
    """It is moved by its course, and by nothing else."""
    plan = MoverPlan(radius=0.5, place=(0.0, 0.0), course=((0, 0, 0), (4, 4, 0)))
    assert Agents.of([Mover((0.0, 0.0), (0.0, 0.0), plan)]).kinds.tolist() == [COURSE]
