"""Another planner's path becomes goals ahead of the robot, and its end the last of them."""

import numpy as np
import pytest

from andabata.records import map_messages, topics
from andabata.records.messages import NS, MessageBuilder
from andabata.records.topics import Topic
from andabata.ros.path_goals import PathGoals

PLAN = Topic("/plan", "/plan", topics.PATH, None)
BUILDER = MessageBuilder(2, 1_700_000_000 * NS)


def path(places, frame="map"):
    """Return a path over places (x, y) [m] in a frame."""
    points = np.array([(x, y, 0.0) for x, y in places]).reshape(-1, 3)
    message = map_messages.path(BUILDER, 0.0, points)
    message.header.frame_id = frame
    return message


def followed(places, start=(0.0, 0.0), step=0.2):
    """Return the goals [m], shape (k, 2), of a robot that heads straight for each, to the last."""
    goals, position = PathGoals(), np.array(start)
    goals.add(PLAN, path(places))
    found = []
    for _ in range(2000):
        goal = goals.goal(position)
        if not found or not np.array_equal(goal, found[-1]):
            found.append(goal)
        away = goal - position
        if np.hypot(*away) < step:
            break
        position = position + step * away / np.hypot(*away)
    return np.array(found)


def line(length, step=0.25):
    """Return places along x up to a length [m]."""
    return [(x, 0.0) for x in np.arange(0.0, length + step / 2, step)]


def test_there_is_no_goal_before_the_first_path():
    """A robot without a path has nowhere to go."""
    assert PathGoals().goal(np.zeros(2)) is None


def test_goals_lie_four_metres_ahead_and_the_last_is_the_end():
    """None of them is come near to but the last, whatever the distance of the path's points."""
    for step in (0.05, 0.25, 1.5):
        found = followed(line(20.0, step), step=0.05)
        assert found[0][0] == pytest.approx(4.0, abs=step)
        assert np.all(np.diff(found[:, 0]) > 0.0)
        assert found[-1] == pytest.approx((20.0, 0.0), abs=step)


def test_a_short_path_has_its_end_as_the_only_goal():
    """A path of one point, and one of a metre."""
    assert followed([(1.0, 2.0)]).tolist() == [[1.0, 2.0]]
    assert followed(line(1.0)).tolist() == [[1.0, 0.0]]


def test_a_robot_that_is_underway_begins_at_the_nearest_point():
    """A path that was sent a while ago does not lead back to its start."""
    assert followed(line(20.0), start=(9.0, 1.0))[0][0] == pytest.approx(13.0)


def test_a_path_that_comes_back_is_driven_whole():
    """Out and back along two lines 1 m apart: the far end comes before the end, at the start."""
    there = line(15.0)
    back = [(x, 1.0) for x, _ in reversed(there)]
    found = followed([*there, *back], start=(0.0, -1.0))
    assert found[:, 0].max() > 12.0
    assert found[-1] == pytest.approx((0.0, 1.0))


def test_a_new_path_takes_the_place_of_the_last():
    """From the next question on."""
    goals = PathGoals()
    goals.add(PLAN, path(line(20.0)))
    assert goals.goal(np.zeros(2))[1] == 0.0
    goals.add(PLAN, path([(0.0, y) for y in np.arange(0.0, 20.0, 0.5)]))
    assert goals.goal(np.zeros(2)) == pytest.approx((0.0, 4.0))


def test_paths_that_cannot_be_used_are_refused_once_and_the_last_stays():
    """Another frame, no pose, no number; our own path gets advice."""
    goals = PathGoals()
    goals.add(PLAN, path(line(20.0), "/map"))
    before = goals.goal(np.zeros(2))
    for _ in range(2):
        goals.add(PLAN, path(line(5.0), "odom"))
        goals.add(PLAN, path(line(5.0), "utm"))
        goals.add(PLAN, path([]))
        goals.add(PLAN, path([(0.0, 0.0), (np.nan, 1.0)]))
    assert goals.goal(np.zeros(2)) is before
    own, other, empty, nan = goals.refusals
    assert "got one in odom (if it is the navigator's own: --no-map" in own
    assert other == "/plan: expected a path in map, got one in utm; the last path stays"
    assert "got an empty one" in empty
    assert "finite" in nan
