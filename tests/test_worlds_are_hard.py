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


@pytest.mark.parametrize(("name", "most"), [("natural-test", 7), ("maze", 10)])
def test_blind_driving_rarely_arrives(name, most):
    """Driving straight at the goal with the true pose arrives in few of twenty trials."""
    arrived = failed = 0
    while failed < 20 - most:  # Then those that are left cannot change the verdict.
        trial = arrived + failed
        world = make_world(name, evaluation_world(1, trial))
        outcome = drive_straight(world, world.tasks[trial % len(world.tasks)])
        arrived, failed = (
            arrived + (outcome is Outcome.GOAL),
            failed + (outcome is not Outcome.GOAL),
        )
        assert arrived <= most
