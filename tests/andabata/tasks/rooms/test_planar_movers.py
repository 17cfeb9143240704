"""Movers of one drive: straight ones and those on courses, after every sub-step."""

import numpy as np

from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.tasks.rooms.planar_movers import PlanarMovers
from worlds.rooms.movers import Mover, MoverPlan
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
