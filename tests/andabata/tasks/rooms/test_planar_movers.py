"""Movers of one drive: straight ones and those on courses, after every sub-step."""

import numpy as np
import pytest

from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.tasks.rooms.planar_movers import PlanarMovers
from worlds.rooms.movers import Behaviour, Mover, MoverPlan
from worlds.rooms.room import Room

FAR = PlanarPose(99.0, 99.0, 0.0)
VEHICLE = PlanarVehicleConfig(period=0.1, substeps=4)
COURSE = MoverPlan(radius=0.5, place=(0.0, 0.0), course=((0, 0, 0), (4, 4, 0)))


def movers(*plans, velocity=(0.0, 1.0)):
    """Return the movers of plans in an open room with a wall at y = 2."""
    boxes = np.array([[-9.0, 2.0, 9.0, 3.0]])
    room = Room("r", (9.0, 9.0), boxes, np.zeros((0, 3)))
    made = [Mover(plan.place, (0.0, 0.0) if plan.course else velocity, plan) for plan in plans]
    return PlanarMovers(room, made, VEHICLE)


def test_all_go_on_from_period_to_period():
    """On the course and straight; the rows are the sub-steps, the straight one first."""
    straight = MoverPlan(radius=0.3, place=(5.0, 0.0), speed=1.0)
    all_of_them = movers(COURSE, straight)
    rows = [places_of(all_of_them.step(FAR, 0.0, 0.3)) for _ in range(2)]
    np.testing.assert_allclose(np.concatenate([r[:, 0, 1] for r in rows]), np.arange(1, 9) / 40)
    np.testing.assert_allclose(np.concatenate([r[:, 1, 0] for r in rows]), np.arange(1, 9) / 40)
    np.testing.assert_allclose(all_of_them.state.places[0], [(5.0, 0.2), (0.2, 0.0)])


def places_of(rows):
    """Return a copy of the places, which the next period overwrites."""
    return rows.places.copy()


def test_one_that_comes_later_waits_for_the_robot_to_be_gone():
    """It appears at its time where nobody is; one on a course is there from the begin."""
    late = MoverPlan(radius=0.3, place=(5.0, 0.0), appears_at=0.15)
    here, away = movers(late, COURSE, velocity=(0.0, 0.0)), movers(late, velocity=(0.0, 0.0))
    for _ in range(3):
        seen = (
            away.step(FAR, 0.0, 0.3).radii[-1].copy(),
            here.step(PlanarPose(5, 0, 0), 0.0, 0.3).radii[-1],
        )
    np.testing.assert_allclose(seen[0], [0.3])
    np.testing.assert_allclose(seen[1], [0.0, 0.5])


def test_a_straight_one_turns_back_at_a_wall():
    """And not at the robot."""
    one = movers(MoverPlan(radius=0.3, place=(5.0, 1.6), speed=1.0))
    for _ in range(3):
        one.step(PlanarPose(5.0, 1.0, 0.0), 0.0, 0.3)
    assert one.state.velocities[0, 0, 1] == -1.0


def person(place, yields=False, seed=0):
    """Return a person of 0.25 m at 1 m/s who goes to the right at first."""
    plan = MoverPlan(radius=0.25, place=place, speed=1.0, is_person=True, yields=yields)
    return Mover(place, (1.0, 0.0), plan, Behaviour(kind="person", yields=yields, seed=seed))


def test_people_go_beside_those_on_courses():
    """One on a course goes on along it; a person goes elsewhere than straight on, by its seed."""
    room = Room("r", (9.0, 9.0), np.zeros((0, 4)), np.zeros((0, 3)))
    ends = []
    for seed in (0, 0, 1):
        made = [Mover(COURSE.place, (0.0, 0.0), COURSE), person((5.0, -5.0), seed=seed)]
        both = PlanarMovers(room, made, VEHICLE)
        for _ in range(30):
            rows = both.step(FAR, 0.0, 0.3)
        np.testing.assert_allclose(rows.places[-1, 1], (3.0, 0.0), atol=1e-9)
        ends.append(rows.places[-1, 0].copy())
    assert np.hypot(*(ends[0] - (5.0, -5.0))) > 1.0
    np.testing.assert_array_equal(ends[0], ends[1])
    assert np.hypot(*(ends[0] - ends[2])) > 0.5


def test_who_gives_way_minds_the_robot():
    """Of two people who meet a robot that comes, one stays farther from it than the other."""
    room = Room("r", (9.0, 1.0), np.zeros((0, 4)), np.zeros((0, 3)))
    nearest = {}
    for yields in (False, True):
        crowd, gaps = PlanarMovers(room, [person((-3.0, 0.0), yields, 7)], VEHICLE), []
        for k in range(60):
            robot = PlanarPose(3.0 - 0.1 * k, 0.0, np.pi)
            place = crowd.step(robot, 1.0, 0.3).places[-1, 0]
            gaps.append(np.hypot(place[0] - robot.x + 0.1, place[1]))
        nearest[yields] = min(gaps)
    assert nearest[True] > nearest[False] + 0.2


def test_people_too_fast_for_their_size_are_refused():
    """By name, before anybody drives."""
    plan = MoverPlan(radius=0.1, place=(0.0, 0.0), speed=3.0, is_person=True)
    fast = Mover((0.0, 0.0), (0.0, 0.0), plan, Behaviour(kind="person"))
    room = Room("r", (9.0, 9.0), np.zeros((0, 4)), np.zeros((0, 3)))
    with pytest.raises(ValueError, match="speed: expected at most 1 m/s"):
        PlanarMovers(room, [fast], VEHICLE)
