"""The oracle of rooms: known numbers of steps, and plans that the simulator drives."""

import itertools
import math

import numpy as np
import pytest

from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.tasks.rooms.batch import DiscRobotConfig, RoomBatch
from andabata.tasks.rooms.lattice_oracle import geodesic_length, oracle_plan, oracle_steps
from worlds.rooms.catalogue import make_room
from worlds.rooms.room import Room, RoomPlan, RoomTask, random_task
from worlds.world import Start

ROBOT = DiscRobotConfig()
GOAL_RADIUS = 0.3


def room(half=(3.0, 2.0), **parts):
    """Return a room of 6 by 4 m."""
    return Room.of("test", RoomPlan(about="test", half=half, **parts))


def steps_of(made, start, goal):
    """Return the oracle's number of steps."""
    return oracle_steps(made, RoomTask(Start(*start), goal), ROBOT, GOAL_RADIUS)


def test_straight_ahead_takes_the_way_over_the_stride():
    """4.95 m at 0.1 m a step come within 0.3 m of the goal with the 47th step."""
    assert steps_of(room(), (-2.5, 0.0, 0.0), (2.45, 0.0)) == 47
    assert steps_of(room(), (0.0, -1.5, math.pi / 2), (0.0, 1.25)) == 25
    assert steps_of(room(), (0.0, 0.0, 0.0), (0.2, 0.0)) == 0


def test_a_robot_slower_than_a_bin_a_step_arrives():
    """Strides of 1.5 cm are a third of a room's cell: bins are finer, and it takes 47 of them."""
    snail = DiscRobotConfig(max_speed=0.15, period=0.1)
    task = RoomTask(Start(-0.5, 0.013, 0.0), (0.5, 0.013))
    assert oracle_steps(room(half=(1.5, 1.0)), task, snail, GOAL_RADIUS) == 47


def test_a_half_turn_costs_less_than_turning_on_the_spot():
    """A goal behind costs more than one ahead, but less than 15 steps of 12 degrees more."""
    ahead = steps_of(room(), (-1.5, 0.0, 0.0), (1.45, 0.0))
    behind = steps_of(room(), (-1.5, 0.0, math.pi), (1.45, 0.0))
    assert ahead == 27
    assert ahead + 5 < behind < ahead + 15


def test_in_a_corridor_the_half_turn_is_on_the_spot():
    """Where the robot has 1 cm on each side it turns before it drives."""
    corridor = room(half=(3.0, 0.21))
    ahead = steps_of(corridor, (-1.5, 0.0, 0.0), (1.45, 0.0))
    behind = steps_of(corridor, (-1.5, 0.0, math.pi), (1.45, 0.0))
    assert ahead == 27
    assert ahead + 12 <= behind <= ahead + 16


def test_a_detour_is_as_long_as_its_way():
    """Around an L the steps are those of the shortest way, with a few more for turning."""
    made = room(boxes=[(-0.5, -2.0, 0.5, 1.0)])
    task = RoomTask(Start(-1.0, -1.5, math.pi / 2), (1.0, -1.5))
    # Past two corners of the box: three straight pieces and two quarters of a circle.
    reach = math.hypot(0.5, 2.5)
    tangent, lean = math.sqrt(reach**2 - 0.2**2), math.asin(0.2 / reach) - math.atan2(0.5, 2.5)
    way = 2 * tangent + 1.0 + 2 * 0.2 * (math.pi / 2 + lean)
    assert geodesic_length(made, task, 0.2, GOAL_RADIUS) == pytest.approx(way - 0.3, rel=0.01)
    fewest = oracle_steps(made, task, ROBOT, GOAL_RADIUS)
    assert math.ceil((way - 0.3) / 0.1) <= fewest <= 1.1 * way / 0.1


def test_near_goals_take_what_the_best_of_all_sequences_takes():
    """Up to four steps every sequence of moves can be tried; hardly ever is one shorter."""
    made = room()
    speeds, rates = (0.0, 0.25, 0.5), math.pi / 3 * np.array([-1.0, -0.5, 0.0, 0.5, 1.0])
    moves = np.array(list(itertools.product(speeds, rates)))
    x, y, yaw = (np.zeros(1) for _ in range(3))
    ends = []
    for _ in range(4):
        turn = moves[:, 1] * 0.2
        chord = moves[:, 0] * 0.2 * np.sinc(turn / 2 / np.pi)
        heading = yaw[:, None] + turn / 2
        x, y = (
            (x[:, None] + chord * np.cos(heading)).ravel(),
            (y[:, None] + chord * np.sin(heading)).ravel(),
        )
        yaw = (yaw[:, None] + turn).ravel()
        ends.append((x, y))
    rng = np.random.default_rng(1)
    found = []
    for _ in range(40):
        bearing, distance = rng.uniform(-1.2, 1.2), rng.uniform(0.31, 0.6)
        goal = (distance * math.cos(bearing), distance * math.sin(bearing))
        fewest = [
            k + 1
            for k, (x, y) in enumerate(ends)
            if np.hypot(x - goal[0], y - goal[1]).min() < GOAL_RADIUS
        ]
        if fewest:
            found.append(steps_of(made, (0.0, 0.0, 0.0), goal) - fewest[0])
    assert len(found) > 20
    assert min(found) == 0
    assert sum(found) <= 2


FAST, SLOW = (DiscRobotConfig(max_speed=v, period=0.1, substeps=1) for v in (0.8, 0.4))


@pytest.mark.parametrize(
    ("name", "robot"),
    [
        ("spn-env3", ROBOT),
        ("spn-env6", ROBOT),
        ("random-4", ROBOT),
        ("spn-env6", FAST),
        ("spn-crowded", FAST),
        ("spn-crowded", SLOW),
    ],
)
def test_a_plan_driven_in_the_simulator_arrives_without_contact(name, robot):
    """The last step, and none before, ends within the goal's radius; nothing was touched."""
    made, rng = make_room(name), np.random.default_rng(7)
    for task in [*made.tasks[:2], *(random_task(made, rng, robot.radius) for _ in range(4))]:
        plan = oracle_plan(made, task, robot, GOAL_RADIUS)
        batch = RoomBatch(1, [made], robot, PlanarLidarConfig(resolution_deg=90))
        batch.place(0, 0, task.start)
        distances = []
        for twist in plan:
            state = batch.step(twist[None], np.ones(1, dtype=bool))
            assert not state.contacts[0]
            distances.append(math.dist(state.poses[0, :2], task.goal))
        assert [distance < GOAL_RADIUS for distance in distances] == [False] * (len(plan) - 1) + [
            True
        ]
        way = geodesic_length(made, task, robot.radius, GOAL_RADIUS)
        stride = robot.max_speed * robot.period
        assert way / stride < len(plan) + 1 < 1.25 * way / stride + 20


def test_the_goal_region_shortens_the_way():
    """The length ends at the goal's edge, and is 0 for who is there."""
    task = RoomTask(Start(-1.0, 0.0, 2.0), (1.0, 0.0))
    assert geodesic_length(room(), task, 0.2, 0.3) == pytest.approx(1.7)
    assert geodesic_length(room(), task, 0.2, 0.5) == pytest.approx(1.5)
    assert geodesic_length(room(), task, 0.2, 2.5) == 0.0


@pytest.mark.parametrize(
    ("start", "goal", "reason"),
    [
        ((-1.0, 0.0, 0.0), (1.0, 0.5), "no way"),
        ((-1.0, 0.0, 0.0), (9.0, 0.5), "no way"),
        ((-0.1, 0.0, 0.0), (-1.0, 0.5), "in contact"),
        ((8.0, 0.0, 0.0), (-1.0, 0.5), "in contact"),
    ],
)
def test_what_cannot_be_reached_is_refused(start, goal, reason):
    """An error names the room and the goal."""
    made = room(walls=[(0.0, -2.0, 0.0, 2.0)])
    task = RoomTask(Start(*start), goal)
    message = rf"room test.*\({goal[0]}, {goal[1]}\).*{reason}"
    with pytest.raises(ValueError, match=message):
        oracle_steps(made, task, ROBOT, GOAL_RADIUS)
    with pytest.raises(ValueError, match=message):
        geodesic_length(made, task, 0.2, GOAL_RADIUS)
