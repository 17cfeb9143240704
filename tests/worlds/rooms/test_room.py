"""Rooms: plans become boxes and circles, clearance is exact, and tasks can be driven."""

import numpy as np
import pytest
from pydantic import ValidationError

from tests.support.room_widths import coverage
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import (
    Room,
    RoomPlan,
    free_places,
    random_place,
    random_task,
)


def room(**parts):
    """Return a room of 4 by 2 m."""
    return Room.of("test", RoomPlan(about="test", half=(2.0, 1.0), **parts))


def test_the_boundary_bounds_the_free_space():
    """The middle is as far from the walls as half the extent, and outside is inside a wall."""
    points = np.array([[0.0, 0.0], [1.5, 0.0], [1.9, 0.9], [2.1, 0.0]])
    np.testing.assert_allclose(room().clearance(points), [1.0, 0.5, 0.1, -0.1])


def test_clearance_of_boxes_and_circles_is_exact():
    """Faces, corners and circles are as far as geometry says, and less than nothing inside."""
    made = room(boxes=[(0.0, -0.2, 0.4, 0.2)], circles=[(-1.0, 0.0, 0.3)])
    points = np.array([[0.7, 0.0], [0.6, 0.35], [0.2, 0.1], [-0.5, 0.0], [-1.0, 0.1]])
    np.testing.assert_allclose(made.clearance(points), [0.3, 0.25, -0.1, 0.2, -0.2])


def test_clearance_of_outlines_is_that_of_their_edges_beside_all_else():
    """The nearest of boxes, circles and outlines counts, inside of an outline less than nothing."""
    made = room(outlines=[((0.0, -0.3), (0.3, 0.0), (0.0, 0.3))], circles=[(-1.0, 0.0, 0.3)])
    points = np.array([[0.3, 0.3], [-0.2, 0.1], [-0.5, 0.0], [0.1, 0.0], [0.0, 0.9]])
    expected = [0.3 * np.sqrt(0.5), 0.2, 0.2, -0.1, 0.1]
    np.testing.assert_allclose(made.clearance(points), expected)


def test_clearance_of_many_points_is_that_of_each():
    """What is found in parts is what each point has alone; no points are none."""
    circles = [(0.01 * k, 0.5, 0.001) for k in range(-200, 200)]
    made = room(boxes=[(0.0, -0.2, 0.4, 0.2)], circles=circles)
    points = np.random.default_rng(2).uniform((-2.0, -1.0), (2.0, 1.0), (6000, 2))
    found = made.clearance(points)
    assert found.shape == (6000,)
    for k in (0, 2499, 2500, 4999, 5999):
        assert found[k] == made.clearance(points[k : k + 1])[0]
    assert made.clearance(points[:0]).shape == (0,)


def test_thin_walls_and_posts_have_their_thickness():
    """A wall along an axis is a box half its thickness around it; a post is a circle."""
    made = room(walls=[(1.0, 0.5, 0.0, 0.5), (-1.0, -1.0, -1.0, 0.0)], posts=[(0.0, -0.5)])
    np.testing.assert_allclose(made.boxes[4:], [[0, 0.485, 1, 0.515], [-1.015, -1, -0.985, 0]])
    np.testing.assert_allclose(made.circles, [[0.0, -0.5, 0.1]])


def test_a_slanted_wall_is_refused():
    """Thin walls run along x or y; another is named with its ends."""
    with pytest.raises(ValueError, match="along x or y"):
        room(walls=[(0.0, 0.0, 1.0, 1.0)])


def test_free_places_are_one_region():
    """A wall with a door narrower than the disc parts the room; the larger side is what is free."""
    narrow = room(boxes=[(0.5, -1.0, 0.6, -0.1), (0.5, 0.1, 0.6, 1.0)])
    assert free_places(narrow, 0.2, 0.3)[:, 0].max() < 0.5
    wide = room(boxes=[(0.5, -1.0, 0.6, -0.3), (0.5, 0.3, 0.6, 1.0)])
    assert free_places(wide, 0.2, 0.2)[:, 0].max() > 1.5
    assert (wide.clearance(free_places(wide, 0.2, 0.35)) > 0.35).all()


def test_a_full_room_is_refused():
    """A disc that fits nowhere is an error that names the room."""
    with pytest.raises(ValueError, match="room test"):
        free_places(room(boxes=[(-2.0, -1.0, 2.0, 1.0)]), 0.2, 0.3)


def test_random_tasks_are_clear_and_apart():
    """Start and goal keep clearance and distance, point anywhere, and repeat by the seed."""
    made = make_room("spn-env3")
    rng = np.random.default_rng(0)
    tasks = [random_task(made, rng, 0.2, min_distance=2.0) for _ in range(200)]
    starts = np.array([[task.start.x, task.start.y] for task in tasks])
    goals = np.array([task.goal for task in tasks])
    assert made.clearance(np.concatenate([starts, goals])).min() > 0.3
    assert np.hypot(*(goals - starts).T).min() >= 2.0
    yaws = np.array([task.start.yaw for task in tasks])
    assert yaws.min() < -3.0
    assert yaws.max() > 3.0
    assert random_task(made, np.random.default_rng(0), 0.2, min_distance=2.0) == tasks[0]
    assert len({task.goal for task in tasks}) > 150


def test_where_nothing_is_as_far_the_farthest_is_the_goal():
    """A distance beyond the room's size gives the farthest place instead of none."""
    task = random_task(room(), np.random.default_rng(1), 0.2, min_distance=50.0)
    assert abs(task.goal[0] - task.start.x) > 1.0


def test_coverage_is_the_share_of_boxes_and_circles():
    """Overlaps count once, walls around do not, and what sticks out of the room counts inside."""
    assert coverage(room()) == 0.0
    assert coverage(room(boxes=[(0.0, -0.5, 1.0, 0.5)] * 2)) == pytest.approx(1 / 8)
    made = room(boxes=[(1.0, 0.0, 9.0, 1.0)], circles=[(-1.0, 0.0, 0.5)])
    assert coverage(made) == pytest.approx((1.0 + np.pi / 4) / 8, abs=2e-3)


def test_a_random_place_is_one_of_the_free_ones():
    """Places come from all over the largest region, with the clearance asked for."""
    made, rng = make_room("spn-env3"), np.random.default_rng(0)
    found = np.array([random_place(made, rng, 0.2, 0.4) for _ in range(300)])
    places = {tuple(place) for place in free_places(made, 0.2, 0.4).tolist()}
    assert {tuple(place) for place in found.tolist()} <= places
    assert np.ptp(found, axis=0).min() > 6.5


def test_a_scatter_moves_the_starts_of_the_fixed_tasks():
    """Random tasks are the fixed goals; starts deviate by the scatter at most, in yaw as well."""
    made = room(start=(-1.0, 0.2, 0.5), goals=[(1.5, 0.0), (1.5, 0.5)], scatter=(0.3, 0.1, 2.0))
    rng = np.random.default_rng(0)
    tasks = [random_task(made, rng, 0.2, 0.25) for _ in range(400)]
    assert {task.goal for task in tasks} == {(1.5, 0.0), (1.5, 0.5)}
    starts = np.array([(task.start.x, task.start.y, task.start.yaw) for task in tasks])
    off = starts - (-1.0, 0.2, 0.5)
    assert (np.abs(off) <= (0.3, 0.1, 2.0)).all()
    assert (np.abs(off).max(axis=0) > (0.29, 0.095, 1.9)).all()
    assert (off.min(axis=0) < (-0.29, -0.095, -1.9)).all()
    walled = room(goals=[(1.5, 0.0)], scatter=(0.5, 0.5, 0.0), boxes=[(-1.0, 0.3, 1.0, 1.0)])
    starts = [random_task(walled, rng, 0.2, 0.25).start for _ in range(50)]
    assert walled.clearance(np.array([(start.x, start.y) for start in starts])).min() > 0.25


def test_a_scatter_needs_tasks():
    """Starts around those of no task are refused."""
    with pytest.raises(ValidationError, match="goals: expected some"):
        room(scatter=(0.1, 0.1, 0.1))
