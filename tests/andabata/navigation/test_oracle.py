"""The oracle knows the map and must still drive as the robot does."""

import numpy as np
import pytest

from andabata.machine.kinematic_vehicle import KinematicVehicle
from andabata.machine.kinematics import SkidSteer
from andabata.machine.robot import RobotModel
from andabata.navigation.controller import ControllerInput
from andabata.navigation.oracle import OracleController
from andabata.tasks.episode_monitor import EpisodeMonitor, Outcome, TerminationConfig
from terrain.classes import SemanticClass
from terrain.objects import frustum
from traversability.virtual_scan import VirtualScan
from worlds.world import Start

ROBOT = RobotModel()
BLIND = VirtualScan(np.full(32, np.inf, dtype=np.float32), 10.0)


def drive(world, start, goal):
    """Return the monitor and the outcome of the oracle's drive."""
    vehicle = KinematicVehicle(world, ROBOT, np.random.default_rng(0))
    vehicle.place(start)
    oracle = OracleController(world, ROBOT)
    monitor = EpisodeMonitor(world, TerminationConfig())
    monitor.begin(vehicle.state, np.array(goal))
    outcome = None
    while outcome is None:
        state = vehicle.state
        view = ControllerInput(
            state.stamp,
            BLIND,
            0.0,
            0.0,
            (0.0, 0.0),
            state.pose,
            state.pose,
            np.array(goal),
            truth=state,
        )
        vehicle.drive(SkidSteer(ROBOT).wheel_speeds(ROBOT.speed, oracle.steer(view)), 10)
        outcome = monitor.watch(vehicle.state)
    return monitor, outcome


@pytest.mark.parametrize("bearing", [0.0, 1.2, -1.6, 2.5, 3.1])
def test_it_does_not_circle_a_goal_that_it_could_reach(make_ground, bearing):
    goal = (2.5 * np.cos(bearing), 2.5 * np.sin(bearing))
    monitor, outcome = drive(make_ground(), Start(0.0, 0.0, 0.0), goal)
    assert outcome is Outcome.GOAL
    assert monitor.distance < 1.5 + 2 * np.pi * ROBOT.speed / ROBOT.max_steering


def test_it_goes_round_when_the_gap_is_too_narrow(make_ground):
    half = np.arange(0.55, 4.0, 0.2)
    posts = [frustum(SemanticClass.WALL, (0, y, 0), (0.2, 0.2), 2.0) for y in [*-half[::-1], *half]]
    world = make_ground(objects=posts)
    monitor, outcome = drive(world, Start(-4.0, 0.0, 0.0), (4.0, 0.0))
    assert outcome is Outcome.GOAL
    assert monitor.distance > 10.0
    assert monitor.forbidden_distance == 0.0
