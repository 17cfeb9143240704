"""Shortest ways of a disc: straight where it is free, around corners by the disc's radius."""

import numpy as np
import pytest

from worlds.rooms.geodesics import HALF_DIAGONAL, remaining, ways_to
from worlds.rooms.random_rooms import random_walled_room
from worlds.rooms.room import CELL, Room, RoomPlan, cell_clearances, cell_middles

RADIUS, GOAL_RADIUS = 0.2, 0.3


def room(**parts):
    """Return a room of 6 by 4 m."""
    return Room.of("test", RoomPlan(about="test", half=(3.0, 2.0), **parts))


def length_around(place, goal, corner):
    """Return the length of the way above a corner that keeps the radius: two tangents, an arc."""
    away = np.array([place, goal]) - corner
    distances = np.hypot(*away.T)
    turned = 2 * np.pi - np.arccos(away[0] @ away[1] / distances.prod())
    arc = turned - np.arccos(RADIUS / distances).sum()
    return np.sqrt(distances**2 - RADIUS**2).sum() + RADIUS * arc


def test_ways_in_an_empty_room_are_straight():
    """Every place that the disc fits in is as far from the goal as it lies."""
    made = room()
    goal = (1.3, -0.6)
    ways = ways_to(made, goal, GOAL_RADIUS, RADIUS)
    for x, y in ((-2.79, 1.79), (2.7, -1.7), (1.3, -0.6), (0.01, 0.02)):
        assert remaining(x, y, ways) == pytest.approx(np.hypot(x - goal[0], y - goal[1]), abs=1e-9)


def test_ways_around_a_corner_are_tangents_and_an_arc():
    """Over random places on both sides of a wall lengths are right within 1.5 %, and unbiased."""
    rng = np.random.default_rng(0)
    errors = []
    for _ in range(20):
        top = rng.uniform(0.0, 0.6)
        made = room(walls=[(0.0, -2.0, 0.0, top)], wall_thickness=1e-6)
        place = rng.uniform((-2.7, -1.7), (-0.5, top - 0.2))
        goal = rng.uniform((0.5, -1.7), (2.7, top - 0.2))
        found = remaining(*place, ways_to(made, tuple(goal), GOAL_RADIUS, RADIUS))
        errors.append(found / length_around(place, goal, (0.0, top)) - 1)
    assert np.abs(errors).max() < 0.015
    assert abs(np.mean(errors)) < 0.005


def test_lengths_never_fall_short_of_the_straight_line_nor_jump():
    """No way is shorter than the line, and cells side by side differ by their distance at most."""
    made = random_walled_room(3)
    goal = tuple(cell_middles(made)[30, 40])
    ways = ways_to(made, goal, GOAL_RADIUS, RADIUS)
    middles = cell_middles(made)
    lengths = ways.corners[..., 2] + np.hypot(*np.moveaxis(middles - ways.corners[..., :2], -1, 0))
    reached = np.isfinite(ways.corners[..., 2])
    assert reached.mean() > 0.5
    straight = np.hypot(*np.moveaxis(middles - goal, -1, 0))
    assert (lengths[reached] >= straight[reached] - 1e-9).all()
    for axis in (0, 1):
        both = reached & np.roll(reached, 1, axis)
        both[tuple([0 if k == axis else slice(None) for k in (0, 1)])] = False
        jumps = np.abs(lengths[both] - np.roll(lengths, 1, axis)[both])
        assert jumps.max() <= CELL * 1.001


def test_ways_keep_clear_of_obstacles():
    """Where a disc touches something by more than half a cell there is no way."""
    made = random_walled_room(5)
    ways = ways_to(made, (float(cell_middles(made)[100, 100, 0]), 0.0), GOAL_RADIUS, RADIUS)
    blocked = cell_clearances(made) < RADIUS - HALF_DIAGONAL
    assert blocked.any()
    assert np.isinf(ways.corners[blocked]).all()


def test_a_closed_wall_leaves_no_way():
    """Behind a wall without a door, and from a goal outside, everything is infinitely far."""
    made = room(walls=[(0.0, -2.0, 0.0, 2.0)])
    ways = ways_to(made, (2.0, 0.0), GOAL_RADIUS, RADIUS)
    assert np.isfinite(remaining(1.0, 1.0, ways))
    assert np.isinf(remaining(-1.0, 1.0, ways))
    outside = ways_to(made, (5.0, 0.0), GOAL_RADIUS, RADIUS)
    assert np.isinf(outside.corners).all()
