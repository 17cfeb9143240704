"""The oracle: fewest steps on known ways, drives that the simulator repeats, clear errors."""

import numpy as np
import pytest

from andabata.machine.planar_lidar import PlanarLidarConfig
from andabata.tasks.lattice_oracle import UnreachableGoalError, oracle_drive, shortest_length
from andabata.tasks.room_batch import DiscRobotConfig, RoomBatch
from worlds.room_catalogue import make_room
from worlds.rooms import Room, RoomPlan, RoomTask, random_task
from worlds.world import Start

ROBOT = DiscRobotConfig()


def room(**parts):
    """Return a room of 8 by 8 m."""
    return Room.of("test", RoomPlan(about="test", half=(4.0, 4.0), **parts))


def task(x, y, yaw, goal):
    """Return a task."""
    return RoomTask(Start(x, y, yaw), goal)


@pytest.mark.parametrize("yaw", [0.0, 0.7, np.pi / 2, -2.0])
def test_straight_ahead_takes_the_steps_of_its_length(yaw):
    """A goal 3 m ahead is nearer than 0.3 m after 2.7 m, 0.1 m a step, whatever the heading."""
    found = oracle_drive(room(), task(0.0, 0.0, yaw, (3 * np.cos(yaw), 3 * np.sin(yaw))))
    assert found.length == pytest.approx(2.7)
    assert found.steps in (27, 28)


def test_a_goal_behind_costs_a_turn():
    """Half a turn takes 15 steps on the spot, less what the robot gains by turning as it drives."""
    found = oracle_drive(room(), task(0.0, 0.0, 0.0, (-3.0, 0.0)))
    assert 28 + 6 < found.steps <= 28 + 15


def test_a_goal_that_is_reached_takes_no_step():
    """Within the goal's radius there is nothing to drive."""
    found = oracle_drive(room(), task(0.0, 0.0, 0.0, (0.2, 0.1)))
    assert found.steps == 0
    assert found.length == 0.0
    assert found.twists.shape == (0, 2)
    assert found.poses.shape == (1, 3)


def test_a_detour_takes_the_steps_of_its_length_and_few_more():
    """Around an L-shaped wall no drive is shorter than the geodesic, and the oracle is near it."""
    made = room(boxes=[(-0.1, -4.0, 0.1, 1.0), (-2.0, 0.9, -0.1, 1.0)])
    found = oracle_drive(made, task(-1.0, -1.0, np.pi, (1.0, -1.0)))
    # Around the L's tip at (-2, 1), over its top and down again.
    assert found.length > 2 * np.hypot(1.0, 2.0) + 2.1 - 0.3
    assert found.length / 0.1 - 1 < found.steps < 1.08 * found.length / 0.1


@pytest.mark.parametrize("name", ["spn-env2", "spn-env3", "spn-env7"])
def test_the_simulator_repeats_the_drive(name):
    """The twists lead a robot of the batch along the poses, without contact, into the goal."""
    made, rng = make_room(name), np.random.default_rng(3)
    tasks = (*made.tasks, *(random_task(made, rng, ROBOT.radius) for _ in range(4)))
    batch = RoomBatch(1, [made], ROBOT, PlanarLidarConfig(resolution_deg=90.0))
    for each in tasks:
        found = oracle_drive(made, each)
        batch.place(0, 0, each.start)
        for twist, pose in zip(found.twists, found.poses[1:], strict=True):
            state = batch.step(twist[None], np.ones(1, bool))
            assert not state.contacts[0]
            np.testing.assert_allclose(state.poses[0], pose, atol=1e-12)
        away = np.hypot(*(found.poses[:, :2] - each.goal).T)
        assert away[-1] < 0.3
        assert (away[:-1] >= 0.3).all()
        assert found.steps >= found.length / 0.1 - 0.5


def test_limits_of_the_robot_count():
    """At half the speed a way takes twice the steps; a larger disc takes the longer way around."""
    slow = oracle_drive(room(), task(0.0, 0.0, 0.0, (3.0, 0.0)), DiscRobotConfig(max_speed=0.25))
    assert slow.steps in (54, 55)
    doors = room(boxes=[(0, -4, 0.1, -2.6), (0, -1.6, 0.1, -0.3), (0, 0.3, 0.1, 4)])
    ways = task(-1.5, 0.0, 0.0, (1.5, 0.0))
    assert shortest_length(doors, ways, 0.2) == pytest.approx(2.7)
    assert shortest_length(doors, ways, 0.35) > 4.0


def test_the_goals_radius_shortens_the_way():
    """A goal of half a metre is reached two steps before one of 0.3 m."""
    near, far = (
        oracle_drive(room(), task(0.0, 0.0, 0.0, (2.95, 0.0)), goal_radius=radius).steps
        for radius in (0.5, 0.3)
    )
    assert far - near == 2


def test_what_cannot_be_driven_is_an_error():
    """A closed room, a start in contact and a goal in a wall are named with room and places."""
    closed = room(boxes=[(0.0, -4.0, 0.1, 4.0)])
    with pytest.raises(UnreachableGoalError, match=r"room test.*0\.2 m.*\(2\.00, 0\.00\)"):
        oracle_drive(closed, task(-2.0, 0.0, 0.0, (2.0, 0.0)))
    with pytest.raises(UnreachableGoalError, match=r"-0\.15"):
        oracle_drive(closed, task(-0.15, 0.0, 0.0, (-2.0, 0.0)))
    with pytest.raises(UnreachableGoalError):
        shortest_length(closed, task(-2.0, 0.0, 0.0, (0.05, 0.0)), 0.2)


def test_a_goal_too_narrow_for_headings_is_an_error_too():
    """A disc that fits nowhere on the way is stopped by the search, not only by the geodesic."""
    made = room(boxes=[(0.0, -4.0, 0.1, -0.19), (0.0, 0.19, 0.1, 4.0)])
    with pytest.raises(UnreachableGoalError):
        oracle_drive(made, task(-2.0, 0.0, 0.0, (2.0, 0.0)))
