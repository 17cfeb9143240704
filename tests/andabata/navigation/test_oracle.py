"""The oracle knows the true map and still moves as the robot does."""

import numpy as np
import pytest

from andabata.machine.kinematic_vehicle import KinematicVehicle
from andabata.machine.kinematics import SkidSteer
from andabata.machine.robot import RobotModel
from andabata.navigation.oracle import OracleConfig, OracleController
from andabata.tasks.episode_monitor import EpisodeMonitor, Outcome, TerminationConfig
from terrain.classes import SemanticClass
from terrain.objects import frustum
from tests.support.situations import situation
from worlds.world import Start

ROBOT = RobotModel()


def seen_from(state, goal):
    """Return the situation of a true state."""
    return situation(pose=state.pose, goal=np.array(goal), truth=state)


def drive(world, start, goal):
    """Return the monitor and the outcome of the oracle's drive."""
    vehicle = KinematicVehicle(world, ROBOT, np.random.default_rng(0))
    vehicle.place(start)
    oracle = OracleController(world, ROBOT)
    monitor = EpisodeMonitor(world, TerminationConfig())
    monitor.begin(vehicle.state, np.array(goal))
    outcome = None
    while outcome is None:
        twist = oracle.act(seen_from(vehicle.state, goal))
        assert twist.linear == ROBOT.speed
        vehicle.drive(SkidSteer(ROBOT).wheel_speeds(twist.linear, twist.angular), 10)
        outcome = monitor.update(vehicle.state)
    return monitor, outcome


@pytest.mark.parametrize("bearing", [0.0, 1.2, -1.6, 2.5, 3.1])
def test_a_goal_within_reach_is_not_circled(make_ground, bearing):
    """A near goal is reached within one turning circle, wherever it lies."""
    goal = (2.5 * np.cos(bearing), 2.5 * np.sin(bearing))
    monitor, outcome = drive(make_ground(), Start(0.0, 0.0, 0.0), goal)
    assert outcome is Outcome.GOAL
    assert monitor.distance < 1.5 + 2 * np.pi * ROBOT.speed / ROBOT.max_steering


def test_a_gap_that_is_too_narrow_is_avoided(make_ground):
    """The oracle drives around a row of posts and never over forbidden ground."""
    half = np.arange(0.55, 4.0, 0.2)
    posts = [frustum(SemanticClass.WALL, (0, y, 0), (0.2, 0.2), 2.0) for y in [*-half[::-1], *half]]
    world = make_ground(objects=posts)
    monitor, outcome = drive(world, Start(-4.0, 0.0, 0.0), (4.0, 0.0))
    assert outcome is Outcome.GOAL
    assert monitor.distance > 10.0
    assert monitor.forbidden_distance == 0.0


def first_rate(world, start, goal):
    """Return the yaw rate of the oracle's first decision."""
    vehicle = KinematicVehicle(world, ROBOT, np.random.default_rng(0))
    vehicle.place(start)
    return OracleController(world, ROBOT).act(seen_from(vehicle.state, goal)).angular


@pytest.mark.parametrize(("bearing", "rate"), [(1.6, 0.5), (-1.6, -0.5), (0.0, None)])
@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_the_first_arc_leads_to_the_goals_side(make_ground, yaw, bearing, rate):
    """At the limit to the side of a goal abeam; not at the limit for one ahead."""
    goal = (6.0 * np.cos(yaw + bearing), 6.0 * np.sin(yaw + bearing))
    first = first_rate(make_ground(), Start(0.0, 0.0, yaw), goal)
    assert abs(first) <= 0.25 if rate is None else first == rate


def test_a_new_goal_gives_a_new_way(make_ground):
    """The cost to go is computed again for another goal, and after a reset."""
    world = make_ground()
    vehicle = KinematicVehicle(world, ROBOT, np.random.default_rng(0))
    vehicle.place(Start(0.0, 0.0, 0.0))
    oracle = OracleController(world, ROBOT)
    rates = [oracle.act(seen_from(vehicle.state, (0.0, y))).angular for y in (6.0, -6.0)]
    oracle.reset()
    rates.append(oracle.act(seen_from(vehicle.state, (0.0, 6.0))).angular)
    assert rates == [0.5, -0.5, 0.5]


def test_clearance_is_worth_a_detour(make_ground):
    """With a price for clearance the oracle passes a wall at more distance than without."""
    wall = frustum(SemanticClass.WALL, (2.0, 0.6, 0), (0.3, 0.3), 2.0)
    world = make_ground(objects=[wall])
    closest = []
    for cost in (0.0, 5.0):
        vehicle = KinematicVehicle(world, ROBOT, np.random.default_rng(0))
        vehicle.place(Start(0.0, 0.0, 0.0))
        oracle = OracleController(world, ROBOT, OracleConfig(clearance_cost=cost))
        distances = []
        for _ in range(130):
            twist = oracle.act(seen_from(vehicle.state, (6.0, 0.0)))
            vehicle.drive(SkidSteer(ROBOT).wheel_speeds(twist.linear, twist.angular), 10)
            distances.append(np.hypot(*(vehicle.state.pose.position[:2] - [2.0, 0.6])))
        closest.append(min(distances))
    assert closest[1] > closest[0] + 0.1


def test_the_oracle_needs_the_true_state(make_ground):
    """Outside of a simulation the oracle is refused."""
    with pytest.raises(ValueError, match="truth: expected the true state"):
        OracleController(make_ground(), ROBOT).act(situation())
