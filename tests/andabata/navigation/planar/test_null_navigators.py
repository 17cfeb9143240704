"""Navigators that see nothing: the law of the one, the draws of the other."""

import math

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.null_navigators import (
    RandomNavigator,
    StraightConfig,
    StraightNavigator,
)

VEHICLE = PLANAR_VEHICLES["barn"]


def readings(x=0.0, y=0.0, yaw=0.0):
    ranges = np.full(3, 0.1, dtype=np.float32)
    return PlanarReadings(0.0, PlanarPose(x, y, yaw), Twist(0.0, 0.0), ranges)


@pytest.mark.parametrize("bearing", [0.0, 0.5, -0.5, 2.0, -2.0])
def test_straight_turns_to_the_goal_and_drives_by_the_cosine(bearing):
    """From any pose: the gain times the bearing, no speed away from the goal."""
    straight = StraightNavigator(StraightConfig(gain=3.0, speed=0.8))
    yaw, place = 0.7, (1.0, -2.0)
    course = yaw + bearing
    goal = (place[0] + 4.0 * math.cos(course), place[1] + 4.0 * math.sin(course))
    straight.reset(PlanarLidarConfig(), goal)
    command = straight.act(readings(*place, yaw))
    assert command.angular == pytest.approx(3.0 * bearing)
    assert command.linear == pytest.approx(0.8 * max(math.cos(bearing), 0.0))


def test_random_commands_are_held_drawn_within_limits_and_new_after_a_reset():
    """Five periods each; forward alone, to both sides, up to half of the fastest turn."""
    aimless = RandomNavigator(VEHICLE, np.random.default_rng(0), hold=5)
    commands = [aimless.act(readings()) for _ in range(2000)]
    drawn = commands[::5]
    assert [drawn[k // 5] for k in range(2000)] == commands
    assert len(set(drawn)) == 400
    speeds = np.array([command.linear for command in drawn])
    rates = np.array([command.angular for command in drawn])
    fastest = VEHICLE.max_wheel_speed / VEHICLE.half_track / 2
    assert 0.0 <= speeds.min() < 0.1 * VEHICLE.max_speed < 0.9 * VEHICLE.max_speed < speeds.max()
    assert speeds.max() <= VEHICLE.max_speed
    assert -fastest <= rates.min() < -0.9 * fastest < 0.9 * fastest < rates.max() <= fastest
    held = aimless.act(readings())
    aimless.reset(PlanarLidarConfig(), (0.0, 0.0))
    assert aimless.act(readings()) != held
