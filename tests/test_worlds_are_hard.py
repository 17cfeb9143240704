"""Worlds are hard: whoever does not look rarely arrives."""

import numpy as np
import pytest

from andabata.machine.kinematics import SkidSteer
from andabata.machine.pose import wrap
from andabata.machine.robot import RobotModel
from andabata.machine.wheels.vehicle import WheelsVehicle
from andabata.tasks.episode_monitor import EpisodeMonitor, Outcome, TerminationConfig
from worlds.catalogue import make_world
from worlds.splits import evaluation_world

ROBOT = RobotModel()


def drive_straight(world, task):
    """Drive the way-point law by the true pose: better than any estimate, and still blind."""
    vehicle = WheelsVehicle(world, ROBOT)
    vehicle.place(task.start)
    monitor = EpisodeMonitor(world, TerminationConfig())
    goal = np.array(task.goals[0])
    monitor.begin(vehicle.state, goal)
    outcome = None
    while outcome is None:
        pose = vehicle.state.pose
        bearing = np.arctan2(*(goal - pose.position[:2])[::-1])
        rate = float(np.clip(5.5 * wrap(float(bearing) - pose.yaw), -0.5, 0.5))
        vehicle.drive(SkidSteer(ROBOT).wheel_speeds(ROBOT.speed, rate), 10)
        outcome = monitor.update(vehicle.state)
    vehicle.close()
    return outcome


@pytest.mark.parametrize(("name", "most"), [("natural-test", 0.35), ("maze", 0.50)])
def test_blind_driving_rarely_arrives(name, most):
    """Worlds are hard: driving straight at the goal with the true pose rarely arrives."""
    outcomes = []
    for trial in range(20):
        world = make_world(name, evaluation_world(1, trial))
        outcomes.append(drive_straight(world, world.tasks[trial % len(world.tasks)]))
    assert np.mean([outcome is Outcome.GOAL for outcome in outcomes]) <= most
