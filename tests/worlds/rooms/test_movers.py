"""Moving obstacles as data: what a plan may hold, and when one that waits is due."""

import pytest
from pydantic import ValidationError

from worlds.rooms.movers import Behaviour, Mover, MoverPlan


def test_an_obstacle_appears_by_the_distance_from_its_edge():
    """Within 1.3 m of the edge it is due, at or beyond that it is not."""
    one = MoverPlan(when_within=1.3, place=(1.0, 2.0), radius=0.3)
    assert one.is_due(1.0, 3.59)
    assert not one.is_due(1.0, 3.61)
    assert one.is_due(2.59, 2.0)
    assert not one.is_due(2.61, 2.0)
    assert one.circle == (1.0, 2.0, 0.3)


def test_an_obstacle_that_waits_for_nobody_is_always_due():
    """Without a distance the time alone decides; a drawn place is no circle yet."""
    one = MoverPlan(radius=0.3)
    assert one.is_due(50.0, 50.0)
    with pytest.raises(ValueError, match="same in all episodes"):
        one.circle  # noqa: B018 - the property raises.


def test_an_obstacle_that_waits_for_the_robot_has_a_place():
    """A distance without a place, a speed below nothing and no size are refused."""
    with pytest.raises(ValidationError, match="expected one where when_within is given"):
        MoverPlan(when_within=1.0, radius=0.3)
    for wrong in ({"speed": -0.1}, {"radius": 0.0}, {"duration": 0.0}, {"circle": (0, 0, 1)}):
        with pytest.raises(ValidationError, match=next(iter(wrong))):
            MoverPlan(**{"radius": 0.3} | wrong)


@pytest.mark.parametrize("wrong", [float("nan"), float("inf")])
def test_places_and_velocities_are_numbers(wrong):
    """The error names which of both is none."""
    plan = MoverPlan(radius=0.3)
    with pytest.raises(ValueError, match=r"mover\.velocity: expected two finite numbers"):
        Mover((0.0, 0.0), (0.0, wrong), plan)
    with pytest.raises(ValueError, match=r"mover\.place: expected two finite numbers"):
        Mover((wrong, 0.0), (0.0, 0.0), plan)
    with pytest.raises(ValidationError, match="speed"):
        MoverPlan(radius=0.3, speed=wrong)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"kind": "vehicle"}, "track: expected two corners or more, got 0"),
        ({"kind": "person", "track": ((0, 0), (1, 0))}, "track: expected none of a person, got 2"),
        ({"kind": "animal", "yields": True}, "expected those of a person, got kind animal"),
        ({"kind": "vehicle", "track": ((0, 0), (1, 0)), "leader": 1}, "those of a person"),
        ({"kind": "bird"}, "kind"),
        ({"kind": "person", "slot": (0.0, float("nan"))}, "slot"),
    ],
)
def test_a_behaviour_has_what_its_kind_has(given, words):
    """A track is a vehicle's, a leader and manners are a person's."""
    with pytest.raises(ValidationError, match=words):
        Behaviour(**given)


def test_a_mover_has_the_kind_of_its_behaviour():
    """One without goes straight, and is a walker."""
    plan = MoverPlan(radius=0.3)
    assert Mover((0.0, 0.0), (0.0, 0.0), plan).kind == "walker"
    assert Mover((0.0, 0.0), (0.0, 0.0), plan, Behaviour(kind="animal")).kind == "animal"


def test_a_course_begins_at_once_in_its_place():
    """It has two places or more, in ascending times from 0 on, and no other motion beside it."""
    good = {"radius": 0.3, "place": (1.0, 2.0), "course": ((0, 1, 2), (2, 5, 2))}
    assert MoverPlan(**good).course == ((0.0, 1.0, 2.0), (2.0, 5.0, 2.0))
    for wrong, message in (
        ({"course": ((0, 1, 2),)}, "ascending times from 0 on, two or more"),
        ({"course": ((1, 1, 2), (2, 5, 2))}, "ascending times"),
        ({"course": ((0, 1, 2), (2, 5, 2), (2, 6, 2))}, "ascending times"),
        ({"place": (0.0, 2.0)}, r"the begin of its course, \(1.0, 2.0\), got \(0.0, 2.0\)"),
        ({"place": None}, "the begin of its course"),
        ({"course": ((0, 1, 2), (0.5, 5, 2))}, "at most 5.0 m/s, got 8"),
        ({"speed": 1.0}, "no speed, when_within, appears_at or duration beside it"),
        ({"duration": 1.0}, "no speed, when_within"),
    ):
        with pytest.raises(ValidationError, match=message):
            MoverPlan(**good | wrong)


def test_a_person_goes_at_a_speed_of_its_own_and_alone_gives_way():
    """One who stands, one on a course and a thing that gives way are refused by name."""
    assert MoverPlan(radius=0.3, speed=1.0, is_person=True, yields=True).yields
    course = {"place": (0, 0), "course": ((0, 0, 0), (4, 4, 0))}
    for wrong in ({"is_person": True}, {"is_person": True} | course):
        with pytest.raises(ValidationError, match="is_person: expected a speed and no course"):
            MoverPlan(radius=0.3, **wrong)
    with pytest.raises(ValidationError, match="yields: expected is_person beside it"):
        MoverPlan(radius=0.3, speed=1.0, yields=True)
