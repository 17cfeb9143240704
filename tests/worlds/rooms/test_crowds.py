"""Crowds: as many people as named, room to pass them, and people who avoid each other."""

import numpy as np
import pytest

from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.tasks.rooms.planar_movers import PlanarMovers
from worlds.rooms.crowds import HALF, SIZES, crowd_room, crowd_world
from worlds.rooms.mover_placement import draw_movers
from worlds.splits import JUDGING_START, JudgingSeedError

SEEDS = range(7300, 7312)
AWAY = PlanarPose(99.0, 99.0, 0.0)


def test_a_room_has_its_people_and_half_of_them_give_way():
    """Each of a person's size and speed, the same for the same seed, another for another one."""
    for people in SIZES:
        room = crowd_room(7300, people)
        assert room.name == f"crowd-{people}-7300"
        assert len(room.movers) == people
        assert all(plan.is_person for plan in room.movers)
        assert sum(plan.yields for plan in room.movers) == round(people / 2)
        assert all(0.2 <= plan.radius <= 0.3 for plan in room.movers)
        assert all(0.5 <= plan.speed <= 1.3 for plan in room.movers)
        assert crowd_room(7300, people).movers == room.movers
        assert crowd_room(7301, people).movers != room.movers
    assert sum(plan.yields for plan in crowd_room(7300, 8, yielding=1.0).movers) == 8


def test_pillars_leave_ways_and_keep_start_and_goal_free():
    """A robot of half a metre gets from start to goal; two pillars leave room for two to pass."""
    counts = set()
    for seed in SEEDS:
        room = crowd_room(seed, 5)
        counts.add(len(room.circles))
        ((start, goal),) = [((task.start.x, task.start.y), task.goal) for task in room.tasks]
        assert room.clearance(np.array([start, goal])).min() > 0.9
        gaps = np.hypot(*(room.circles[:, None, :2] - room.circles[:, :2]).transpose(2, 0, 1))
        gaps -= room.circles[:, None, 2] + room.circles[:, 2]
        assert gaps[~np.eye(len(gaps), dtype=bool)].min(initial=9.0) >= 1.6
    assert counts == {0, 1, 2, 3, 4}


def test_the_path_of_a_crowd_is_the_straight_line():
    """Ten metres at 2 m/s."""
    assert crowd_world(7300, 10).optimal_time == pytest.approx(5.0)


def test_people_go_all_over_the_room_and_through_nobody():
    """In 40 s twenty people hardly stand, never overlap what stands or each other, and stay in."""
    room = crowd_room(7300, 20)
    movers = draw_movers(room, np.random.default_rng(1), room.tasks[0], 0.3)
    crowd = PlanarMovers(room, movers, PlanarVehicleConfig(period=0.1, substeps=2))
    places, speeds = [], []
    for _ in range(400):
        rows = crowd.step(AWAY, 0.0, 0.3)
        places.append(rows.places[-1].copy())
        speeds.append(np.hypot(*rows.velocities[-1].T))
        gaps = np.hypot(*(places[-1][:, None] - places[-1]).transpose(2, 0, 1))
        gaps -= rows.radii[-1][:, None] + rows.radii[-1]
        assert gaps[~np.eye(20, dtype=bool)].min() > -1e-9
        assert (room.clearance(places[-1]) - rows.radii[-1]).min() > -1e-9
    assert np.mean(np.array(speeds) < 0.1) < 0.02
    spread = np.ptp(np.array(places), axis=0)
    assert np.median(spread) > HALF
    assert np.abs(places).max() < HALF


def test_a_seed_that_judges_is_refused():
    """As of all random rooms."""
    with pytest.raises(JudgingSeedError):
        crowd_room(JUDGING_START, 5)
