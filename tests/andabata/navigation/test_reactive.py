"""The reactive law steers round what is in the way and at the goal when nothing is."""

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.navigation.controller import ControllerInput
from andabata.navigation.reactive import ReactiveController, StraightController
from traversability.grid import PolarGrid
from traversability.virtual_scan import VirtualScan

GRID = PolarGrid()


def view(ranges, heading_error, distance=20.0):
    pose = Pose.from_euler(np.zeros(3), 0, 0, 0)
    scan = VirtualScan(np.asarray(ranges, dtype=np.float32), 10.0)
    goal = np.array([20.0, 0.0])
    return ControllerInput(0.0, scan, heading_error, distance, (0.0, 0.0), pose, pose, goal, None)


def blocked(bearing_low, bearing_high, distance):
    ranges = np.full(GRID.n_sectors, np.inf)
    ranges[(GRID.bearings >= bearing_low) & (GRID.bearings <= bearing_high)] = distance
    return ranges


@pytest.mark.parametrize("error", [-1.0, -0.3, 0.0, 0.3, 1.0])
def test_free_space_steers_at_the_goal(error):
    controller = ReactiveController(RobotModel(), GRID)
    steering = controller.steer(view(np.full(32, np.inf), error))
    assert steering == pytest.approx(5.5 * error, abs=5.5 * np.pi / 32)


def test_an_obstacle_ahead_and_left_turns_right():
    controller = ReactiveController(RobotModel(), GRID)
    assert controller.steer(view(blocked(-0.25, 1.5, 1.5), 0.0)) < -0.5


def test_an_obstacle_aside_does_not_disturb():
    controller = ReactiveController(RobotModel(), GRID)
    assert abs(controller.steer(view(blocked(1.4, 2.5, 2.0), 0.0))) < 0.6


def test_a_gap_narrower_than_the_body_is_not_taken():
    ranges = np.full(32, 1.2)
    ranges[16] = np.inf  # One sector is 0.24 m wide at 1.2 m.
    ranges[:8] = np.inf
    steering = ReactiveController(RobotModel(), GRID).steer(view(ranges, 0.1))
    assert abs(steering) > 5.5 * np.pi / 4


def test_straight_looks_at_nothing():
    assert StraightController().steer(view(blocked(-1, 1, 0.7), 0.2)) == pytest.approx(1.1)
