"""Random cluttered rooms: coverage, widths of ways, the same for the same seed, movers."""

import numpy as np
import pytest

from tests.support.room_widths import (
    coverage,
    has_no_way_narrower_than,
    obstacle_count,
    share_of_largest_region,
)
from worlds.rooms.clutter import COVERAGE, random_cluttered_room
from worlds.rooms.geodesics import remaining, ways_to
from worlds.rooms.room import Room, RoomPlan, random_task

ROOMS = [random_cluttered_room(seed) for seed in range(24)]


def test_coverage_is_the_one_drawn():
    """It is within 1 % of the floor of what the seed draws, and takes all values there are."""
    found = np.array([coverage(room) for room in ROOMS])
    drawn = [np.random.default_rng(seed).uniform(*COVERAGE) for seed in range(len(ROOMS))]
    np.testing.assert_allclose(found, drawn, atol=0.01)
    assert (COVERAGE[0], COVERAGE[1]) == (0.08, 0.27)
    assert found.min() < 0.11
    assert found.max() > 0.24


def test_the_measure_of_ways_knows_narrow_ones():
    """Between two boxes, or a box and a wall, 0.7 m are narrower than 0.8 m, and 0.85 m are not."""
    for gap, expected in ((0.7, False), (0.85, True)):
        for x in (-1.0, gap - 5.0):
            boxes = [(x, 0.0, x + 1.0, 1.0), (x + 1.0 + gap, 0.0, x + 3.0, 1.0)]
            plan = RoomPlan(about="test", half=(5.0, 5.0), boxes=boxes)
            assert has_no_way_narrower_than(Room.of("test", plan), 0.8) == expected


def test_no_way_is_narrower_than_the_gap():
    """Discs of 0.8 m pass between any two pieces, and reach nearly all that is free for them."""
    for room in ROOMS:
        assert has_no_way_narrower_than(room, 0.8)
        assert share_of_largest_region(room, 0.37) > 0.999
    # The gap is kept to, not surpassed by far: pieces of most full rooms join a little later.
    full = [room for room in ROOMS if coverage(room) > 0.2]
    joined = [obstacle_count(room, 0.5) < obstacle_count(room, 0.025) for room in full]
    assert np.mean(joined) > 0.8


def test_random_tasks_can_be_driven():
    """A disc of 0.2 m gets from every start to its goal, and both lie in the room."""
    rng = np.random.default_rng(1)
    for room in ROOMS[:8]:
        for _ in range(2):
            task = random_task(room, rng, 0.2, 0.3, 2.0)
            ways = ways_to(room, task.goal, 0.3, 0.2)
            length = remaining(task.start.x, task.start.y, ways)
            assert 1.9 < length < 30.0
            assert np.abs([task.start.x, task.start.y, *task.goal]).max() < 5.0


def test_layouts_differ_and_repeat():
    """The same seed gives the same room; pieces stay inside, and stand at walls at times."""
    again = random_cluttered_room(3)
    np.testing.assert_array_equal(again.boxes, ROOMS[3].boxes)
    np.testing.assert_array_equal(again.circles, ROOMS[3].circles)
    assert len({room.boxes.tobytes() for room in ROOMS}) == len(ROOMS)
    inside = np.concatenate([room.boxes[4:] for room in ROOMS])
    assert np.abs(inside).max() <= 5.0 + 1e-9
    assert 0.1 < np.mean(np.abs(inside).max(axis=1) > 5.0 - 1e-9) < 0.6
    assert (inside[:, 2:] - inside[:, :2]).min() > 0.05
    circles = np.concatenate([room.circles for room in ROOMS])
    assert (np.abs(circles[:, :2]).max(axis=1) + circles[:, 2]).max() <= 5.0 - 0.8 + 1e-9
    assert len(circles) > 20


def test_movers_come_into_the_same_layout():
    """One to four of them move, at random places; without them the room is the same."""
    counts = set()
    for seed in range(24):
        room = random_cluttered_room(seed, movers=(1, 4))
        np.testing.assert_array_equal(room.boxes, ROOMS[seed].boxes)
        counts.add(len(room.movers))
        for one in room.movers:
            assert 0.2 <= one.radius <= 0.5
            assert 0.2 <= one.speed <= 0.8
            assert one.place is one.when_within is one.duration is None
    assert counts == {1, 2, 3, 4}
    assert (room.name, ROOMS[23].name) == ("clutter-movers-23", "clutter-23")


def test_a_gap_that_leaves_no_layout_is_an_error():
    """Pieces 4 m apart cannot cover a small room."""
    with pytest.raises(ValueError, match="room clutter-0: expected a layout"):
        random_cluttered_room(0, half=3.0, gap=4.0)
