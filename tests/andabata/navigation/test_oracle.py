"""The oracle knows the true map and pose, and has the moves of the robot's planner."""

import numpy as np
import pytest

from andabata.machine.kinematic_vehicle import KinematicVehicle
from andabata.machine.kinematics import SkidSteer, executed_twist
from andabata.machine.robot import RobotModel
from andabata.navigation.oracle import OracleController
from andabata.navigation.planning.trajectory_rollouts import TrajectoryRolloutsConfig
from andabata.tasks.episode_monitor import EpisodeMonitor, Outcome, TerminationConfig
from terrain.classes import SemanticClass
from terrain.objects import frustum
from tests.support.situations import situation
from worlds.world import Start

ROBOT = RobotModel()
REPEAT = TrajectoryRolloutsConfig().action_repeat


def seen_from(state, goal):
    """Return the situation of a true state, whose estimated pose is of no use."""
    return situation(pose=state.pose, goal=np.array(goal), truth=state, heading_error=3.0)


def post(x, y):
    """Return a post of 0.4 m."""
    return frustum(SemanticClass.WALL, (x, y, 0), (0.2, 0.2), 2.0)


def placed(world, start):
    """Return a vehicle at a start."""
    vehicle = KinematicVehicle(world, ROBOT, np.random.default_rng(0))
    vehicle.place(start)
    return vehicle


def drive(world, start, goal, rollouts=None):
    """Return the monitor, the outcome and the commands of the oracle's drive."""
    vehicle = placed(world, start)
    oracle = OracleController(world, ROBOT, rollouts=rollouts)
    monitor = EpisodeMonitor(world, TerminationConfig())
    monitor.begin(vehicle.state, np.array(goal))
    outcome, commands = None, []
    while outcome is None:
        if len(commands) % REPEAT == 0:
            command = oracle.act(seen_from(vehicle.state, goal))
        commands.append(executed_twist(command, ROBOT))
        twist = commands[-1]
        vehicle.drive(SkidSteer(ROBOT).wheel_speeds(twist.linear, twist.angular), 10)
        outcome = monitor.update(vehicle.state)
    return monitor, outcome, commands


@pytest.mark.parametrize("bearing", [0.0, 1.2, -1.6, 2.5, 3.1])
def test_a_goal_within_reach_is_not_circled(make_ground, bearing):
    """A near goal is reached within one turning circle at full speed, wherever it lies."""
    goal = (2.5 * np.cos(bearing), 2.5 * np.sin(bearing))
    monitor, outcome, _ = drive(make_ground(), Start(0.0, 0.0, 0.0), goal)
    assert outcome is Outcome.GOAL
    fastest = TrajectoryRolloutsConfig().max_speed_scale * ROBOT.speed
    assert monitor.distance < 1.5 + 2 * np.pi * fastest / ROBOT.max_steering


def test_a_gap_that_is_too_narrow_is_avoided(make_ground):
    """The oracle drives around a row of posts and never over forbidden ground."""
    half = np.arange(0.55, 4.0, 0.2)
    world = make_ground(objects=[post(0, y) for y in [*-half[::-1], *half]])
    monitor, outcome, _ = drive(world, Start(-4.0, 0.0, 0.0), (4.0, 0.0))
    assert outcome is Outcome.GOAL
    assert monitor.distance > 10.0
    assert monitor.forbidden_distance == 0.0


def test_open_ground_is_driven_at_the_planners_speed(make_ground):
    """With no obstacle near it drives as fast as the rollouts allow, and no faster."""
    _, _, commands = drive(make_ground(), Start(-4.0, 0.0, 0.0), (6.0, 0.0))
    fastest = max(twist.linear for twist in commands)
    assert fastest == TrajectoryRolloutsConfig().max_speed_scale * ROBOT.speed
    slow = TrajectoryRolloutsConfig(max_speed_scale=1.0)
    _, _, commands = drive(make_ground(), Start(-4.0, 0.0, 0.0), (6.0, 0.0), slow)
    assert max(twist.linear for twist in commands) == ROBOT.speed


def test_a_dead_end_is_left_by_a_turn_on_the_spot_or_backwards(make_ground):
    """With walls before it and at both sides no arc forward leads on: it stops, and comes out."""
    walls = [post(1.2, y) for y in np.arange(-1.2, 1.3, 0.3)]
    walls += [post(x, y) for y in (-1.2, 1.2) for x in np.arange(-1.0, 1.3, 0.3)]
    world = make_ground(objects=walls)
    monitor, outcome, commands = drive(world, Start(0.2, 0.0, 0.0), (-5.0, 0.0))
    assert outcome is Outcome.GOAL
    assert any(twist.linear <= 0.0 for twist in commands)
    assert monitor.forbidden_distance == 0.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("yaw", [0.0, 2.0])
def test_the_first_move_leads_to_the_goals_side(make_ground, yaw, side):
    """It turns to the side of a goal abeam, by the true pose."""
    goal = (6.0 * np.cos(yaw + side * 1.6), 6.0 * np.sin(yaw + side * 1.6))
    world = make_ground()
    state = placed(world, Start(0.0, 0.0, yaw)).state
    assert side * OracleController(world, ROBOT).act(seen_from(state, goal)).angular > 0.25


def test_a_new_goal_gives_a_new_way(make_ground):
    """The cost to go is computed again for another goal, and after a reset."""
    world = make_ground()
    state = placed(world, Start(0.0, 0.0, 0.0)).state
    oracle = OracleController(world, ROBOT)
    sides = [np.sign(oracle.act(seen_from(state, (0.0, y))).angular) for y in (6.0, -6.0)]
    oracle.reset()
    sides.append(np.sign(oracle.act(seen_from(state, (0.0, 6.0))).angular))
    assert sides == [1.0, -1.0, 1.0]


def test_the_oracle_needs_the_true_state(make_ground):
    """Outside of a simulation the oracle is refused."""
    with pytest.raises(ValueError, match="truth: expected the true state"):
        OracleController(make_ground(), ROBOT).act(situation())
