"""Mover shield: gets out of the way of what comes, leaves commands alone that meet no mover."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.navigation.planar.hit_layer import LaserPose
from andabata.navigation.planar.mover_shield import MoverShield
from tests.support.mover_scans import LASER, PERIOD, RADIUS, Scanner, straight

AHEAD, STAND = Twist(1.0, 0.0), Twist(0.0, 0.0)
ROBOT = 0.2
"""Radius of the robot [m]."""


def shield():
    """Return the shield of a robot that drives 1 m/s and turns 1 rad/s."""
    return MoverShield(LASER, ROBOT, Twist(1.0, 1.0), PERIOD)


def drive(made, command, start, velocity, steps=40, half=5.0):
    """Return the least gap to a mover, and the commands that were driven; no shield is None."""
    scan, pose, given, gaps = Scanner(half=half), np.zeros(3), [], []
    for place in straight(steps, start, velocity):
        gaps.append(np.hypot(*(np.array(place) - pose[:2])) - RADIUS - ROBOT)
        given.append(command)
        if made is not None:
            made.update(LaserPose(*pose.tolist()), scan(place, pose))
            given[-1] = made.safe(command)
        yaw = pose[2] + 0.5 * given[-1].angular * PERIOD
        way = given[-1].linear * PERIOD
        pose += np.array([way * np.cos(yaw), way * np.sin(yaw), given[-1].angular * PERIOD])
    return min(gaps), given


@pytest.mark.parametrize(
    ("command", "start", "velocity"),
    [
        (STAND, (2.5, 0.1), (-0.8, 0.0)),
        (AHEAD, (4.0, 0.0), (-0.8, 0.0)),
        (AHEAD, (2.0, 2.0), (0.0, -1.0)),
        (Twist(0.3, 0.0), (-2.0, 0.0), (0.8, 0.0)),
    ],
)
def test_it_gets_out_of_the_way(command, start, velocity):
    """A mover that comes from ahead, from the side or from behind would hit the robot."""
    assert drive(None, command, start, velocity)[0] < 0.0
    gap, given = drive(shield(), command, start, velocity)
    assert gap > 0.0
    assert given[0] == command


@pytest.mark.parametrize(
    ("start", "velocity"),
    [((2.0, 2.0), (0.0, 0.5)), ((2.0, 0.0), (1.2, 0.0)), ((1.5, 0.5), (0, 0))],
)
def test_commands_pass_that_meet_no_mover(start, velocity):
    """One that goes away leaves every command as it is, and so does a post that stands."""
    _, given = drive(shield(), AHEAD, start, velocity, steps=25, half=9.0)
    assert given == [AHEAD] * 25


def test_it_does_not_flee_into_a_wall():
    """In a way 1.2 m wide that the mover fills it stays clear of the walls as long as it can."""
    made, scan = shield(), Scanner()
    for place in straight(12, (2.5, 0.0), (-0.8, 0.0)):
        ranges = np.minimum(
            scan(place),
            0.6 / np.maximum(np.abs(np.sin(LASER.bearings)), 1e-9),
        )
        made.update(LaserPose(), ranges)
        given = made.safe(Twist(1.0, 1.0))
    yaw = given.angular * 0.5
    assert abs(given.linear * 0.5 * np.sin(yaw)) < 0.6 - ROBOT


def test_it_forgets_at_a_reset():
    """What came in the last drive holds no command up in the next."""
    made = shield()
    drive(made, STAND, (1.4, 0.0), (-0.8, 0.0), steps=8)
    assert made.safe(AHEAD) != AHEAD
    made.reset()
    assert made.safe(AHEAD) == AHEAD
