"""Brake shield: stops before contact, lets free commands pass, leads held-up robots out."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import Obstacles
from andabata.machine.planar.motion import SET_V, SET_W
from andabata.machine.planar.readings import PlanarPose
from andabata.machine.planar.vehicle import PLANAR_VEHICLES, PlanarVehicle
from andabata.navigation.planar.brake_shield import BrakeShield, BrakeShieldConfig
from andabata.navigation.planar.dynamics import MotionState, PlanarDynamics

EXACT = {"gain_spread": 0.0, "slip": 0.0, "odometry_scale": 0.0, "odometry_turn": 0.0}
POST = np.array([(3.0, 0.0, 0.075)])
EMPTY = np.zeros((0, 4))


def dynamics_of(vehicle):
    """Return the dynamics of a vehicle as the shield takes them."""
    return PlanarDynamics(
        vehicle.delay, vehicle.lag, vehicle.acceleration, vehicle.yaw_acceleration
    )


def rim(robot):
    """Return places all around the post in the robot's frame."""
    angles = np.linspace(0, 2 * np.pi, 60)
    places = POST[0, :2] + 0.075 * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    x, y, yaw = robot.pose
    c, s = np.cos(yaw), np.sin(yaw)
    return (places - (x, y)) @ np.array([[c, -s], [s, c]])


def drive(name, command, periods, shielded=True):
    """Return a robot after some periods of one command from (0, 0), and the shield's commands."""
    vehicle = PLANAR_VEHICLES[name].model_copy(update=EXACT)
    around = Obstacles(EMPTY, POST, EMPTY)
    robot = PlanarVehicle(vehicle, PlanarPose(0, 0, 0), around, np.random.default_rng(0))
    shield, past, given = BrakeShield(vehicle), np.zeros((20, 2)), []
    for _ in range(periods):
        found = command
        if shielded:
            speeds = (robot.velocity.linear, robot.velocity.angular)
            state = MotionState(0, 0, 0, *speeds, *robot.state[[SET_V, SET_W]].tolist())
            found = shield.safe(command, rim(robot), state, past, dynamics_of(vehicle))
        past = np.vstack([past[1:], [(found.linear, found.angular)]])
        robot.step(found)
        given.append(found)
    return robot, given


@pytest.mark.parametrize("name", ["barn", "barn-slow"])
@pytest.mark.parametrize("command", [Twist(2.0, 0.0), Twist(1.0, 0.02)])
def test_it_stops_before_contact(name, command):
    """At full speed and slower, by the robot's own braking distance, and not long before."""
    unshielded, _ = drive(name, command, 100, shielded=False)
    assert unshielded.has_contact
    robot, given = drive(name, command, 100)
    assert not robot.has_contact
    assert max(robot.pose.x, 0) > 3.0 - 0.075 - 0.254 - 0.45
    assert given[0] == command


def test_a_robot_that_is_held_up_backs_out():
    """After a while at rest, and then it tries again."""
    robot, given = drive("barn", Twist(1.0, 0.0), 200)
    assert not robot.has_contact
    back = [k for k, one in enumerate(given) if one.linear < 0]
    assert back
    assert max(one.linear for one in given[back[0] :]) > 0.2


def test_what_is_free_passes():
    """Away from the post, beside it, and with nothing around, bit for bit."""
    vehicle = PLANAR_VEHICLES["barn"]
    shield, rest = BrakeShield(vehicle), MotionState(0, 0, 0, 0, 0, 0, 0)
    beside = np.array([(0.5, 0.215 + 0.05), (0.5, -0.215 - 0.05)])
    for hits, command in (
        (np.zeros((0, 2)), Twist(2.0, 0.0)),
        (beside, Twist(2.0, 0.0)),
        (np.array([(0.254 + 0.03, 0.0)]), Twist(-0.5, 0.0)),
    ):
        found = shield.safe(command, hits, rest, np.zeros((20, 2)), dynamics_of(vehicle))
        assert found == command


def test_commands_on_the_way_count():
    """With 0.15 s of full speed still to come, the same command is refused earlier."""
    vehicle = PLANAR_VEHICLES["barn-slow"]
    rest = MotionState(0, 0, 0, 0, 0, 0, 0)
    hits, standing = np.array([(0.254 + 0.035, 0.0)]), np.zeros((20, 2))
    fast = np.tile((2.0, 0.0), (20, 1))
    slow = Twist(0.1, 0.0)
    dynamics = dynamics_of(vehicle)
    assert BrakeShield(vehicle).safe(slow, hits, rest, standing, dynamics) == slow
    assert BrakeShield(vehicle).safe(slow, hits, rest, fast, dynamics) == Twist(0.0, 0.0)


def test_a_robot_within_the_margin_may_leave():
    """10 mm from a post, with a margin of 20: backwards it may, forwards it may not."""
    vehicle, rest = PLANAR_VEHICLES["barn"], MotionState(0, 0, 0, 0, 0, 0, 0)
    shield = BrakeShield(vehicle, BrakeShieldConfig(margin=0.02))
    hits, past = np.array([(0.254 + 0.01, 0.0)]), np.zeros((20, 2))
    dynamics = dynamics_of(vehicle)
    back = Twist(-0.3, 0.0)
    assert shield.safe(back, hits, rest, past, dynamics) == back
    assert shield.safe(Twist(1.0, 0.0), hits, rest, past, dynamics).linear < 0.1


def test_a_robot_within_the_margin_does_not_creep():
    """However slow the command, it comes no nearer: a little in each period would be a contact."""
    vehicle, rest = PLANAR_VEHICLES["barn"], MotionState(0, 0, 0, 0, 0, 0, 0)
    shield = BrakeShield(vehicle, BrakeShieldConfig(margin=0.02))
    hits, past = np.array([(0.254 + 0.01, 0.0)]), np.zeros((20, 2))
    for speed in (0.3, 0.01, 0.001):
        found = shield.safe(Twist(speed, 0.0), hits, rest, past, dynamics_of(vehicle))
        assert found.linear == 0.0
