"""Shortest ways of a disc: straight where nothing stands, tangents and arcs around corners."""

import numpy as np
import pytest

from worlds.geodesic import geodesic_field, is_clear, length_from
from worlds.room_catalogue import make_room
from worlds.rooms import Room, RoomPlan, random_task

RADIUS = 0.2


def room(**parts):
    """Return a room of 8 by 8 m."""
    return Room.of("test", RoomPlan(about="test", half=(4.0, 4.0), **parts))


def around(start, goal, half, top):
    """Return the exact length around the end of a wall that is ``half`` thick, at ``top``."""
    whole, turned = 2 * half, -np.pi
    for place, side in ((start, -half), (goal, half)):
        dx, dy = place[0] - side, top - place[1]
        distance = np.hypot(dx, dy)
        whole += np.sqrt(distance**2 - RADIUS**2)
        turned += np.arctan2(abs(dx), dy) - np.arcsin(RADIUS / distance)
    # The arcs around both edges are what the straight lines leave of half a turn.
    return whole - RADIUS * turned


def test_nothing_in_the_way_is_a_straight_line():
    """From everywhere in an empty room the way is as long as the line."""
    field = geodesic_field(room(), (1.234, -2.345), RADIUS)
    for x, y in np.random.default_rng(0).uniform(-3.7, 3.7, (200, 2)):
        assert length_from(field, x, y) == pytest.approx(np.hypot(x - 1.234, y + 2.345))


@pytest.mark.parametrize("start", [(-2.0, 0.0), (-1.0, -3.0), (-3.0, 0.5), (-0.5, -2.0)])
def test_around_a_wall_the_way_follows_tangents_and_arcs(start):
    """Lengths are at most 1 % above the exact ones, and not below."""
    goal = (2.03, 0.02)
    field = geodesic_field(room(boxes=[(-0.1, -4.0, 0.1, 1.0)]), goal, RADIUS)
    exact = around(start, goal, 0.1, 1.0)
    assert exact - 1e-9 <= length_from(field, *start) < 1.01 * exact


def test_lengths_obey_the_triangle_inequality_along_clear_lines():
    """Two places that see each other differ by no more than the line between them, within 1 %."""
    made, rng = make_room("spn-env7"), np.random.default_rng(1)
    field = geodesic_field(made, (3.0, -1.0), RADIUS)
    seen = 0
    for _ in range(300):
        task = random_task(made, rng, RADIUS, min_distance=0.2)
        here, there = (task.start.x, task.start.y), task.goal
        if is_clear(*here, *there, made.boxes, made.circles, RADIUS):
            one, other = length_from(field, *here), length_from(field, *there)
            assert abs(one - other) < np.hypot(*np.subtract(here, there)) + 0.02 * max(one, other)
            seen += 1
    assert seen > 50


def test_a_door_is_as_wide_as_the_disc():
    """A door of the disc's width is passed, one a centimetre narrower is not."""
    for width, reached in ((0.4, True), (0.39, False)):
        made = room(boxes=[(0.0, -4.0, 0.1, -width / 2), (0.0, width / 2, 0.1, 4.0)])
        field = geodesic_field(made, (2.0, 0.0), RADIUS)
        assert np.isfinite(length_from(field, -2.0, 0.3)) == reached


def test_a_goal_in_an_obstacle_is_reached_from_nowhere():
    """Every length is infinite."""
    field = geodesic_field(room(circles=[(1.0, 1.0, 0.5)]), (1.0, 1.0), RADIUS)
    assert not np.isfinite(field.rests).any()


def test_a_line_is_clear_if_a_dense_sample_of_it_is():
    """The exact test agrees with the clearance of 400 points, but for touches within 1 mm."""
    made, rng = make_room("spn-env4"), np.random.default_rng(2)
    shares, verdicts = np.linspace(0.0, 1.0, 400)[:, None], []
    for a, b in rng.uniform(-3.7, 3.7, (600, 2, 2)):
        least = made.clearance(a + shares * (b - a)).min()
        if abs(least - RADIUS) > 1e-3:
            verdicts.append(is_clear(*a, *b, made.boxes, made.circles, RADIUS))
            assert verdicts[-1] == (least > RADIUS)
    assert 50 < sum(verdicts) < 500


def test_a_line_of_no_length_is_a_point():
    """A disc at rest is clear where it fits."""
    made = room(boxes=[(1.0, -0.5, 2.0, 0.5)], circles=[(-1.0, 0.0, 0.3)])
    for x, clear in ((0.75, True), (0.85, False), (1.5, False), (-0.45, True), (-0.55, False)):
        assert is_clear(x, 0.0, x, 0.0, made.boxes, made.circles, RADIUS) == clear
