"""All navigators on flat ground: the seam, open ground, a wall, a gate, the same again."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.machine.planar.vehicle import PLANAR_VEHICLES
from andabata.navigation.planar.catalogue import PLANAR_NAVIGATORS
from andabata.navigation.planar.follow_gap import FollowGapConfig, FollowGapNavigator
from andabata.navigation.planar.null_navigators import RandomNavigator, StraightNavigator

LIDAR = PlanarLidarConfig(fov_deg=270, resolution_deg=270 / 719, max_range=30, x=0.12)
BEARINGS = LIDAR.bearings
SEEING = ["arcs", "dwa", "dwa-goal", "gap", "mpc"]
VEHICLE = PLANAR_VEHICLES["barn"]


def readings(ranges=None, stamp=0.0, pose=(0.0, 0.0, 0.0), velocity=(0.0, 0.0)):
    """Return readings; all beams meet nothing by default."""
    found = np.full(LIDAR.count, np.inf) if ranges is None else ranges
    seen, nobody = found.astype(np.float32), np.zeros((0, 5))
    return PlanarReadings(stamp, PlanarPose(*pose), Twist(*velocity), seen, nobody)


def wall_ahead(far, half_width=9.0, gate=None):
    """Return ranges to a wall across the heading, with a gate between two places in it [m]."""
    with np.errstate(divide="ignore"):
        along = np.where(
            np.abs(BEARINGS) < np.pi / 2 - 0.01, (far - LIDAR.x) / np.cos(BEARINGS), np.inf
        )
    aside = along * np.sin(BEARINGS)
    is_open = np.abs(aside) > half_width
    if gate is not None:
        is_open |= (aside > gate[0]) & (aside < gate[1])
    return np.where(is_open, np.inf, along)


def first(name, goal, ranges=None, velocity=(0.0, 0.0), count=1):
    """Return the last of some commands on the same readings."""
    navigator = PLANAR_NAVIGATORS[name](VEHICLE, np.random.default_rng(0))
    navigator.reset(LIDAR, goal)
    for k in range(count):
        command = navigator.act(readings(ranges, 0.05 * k, velocity=velocity))
    return command


@pytest.mark.parametrize("name", SEEING)
def test_on_open_ground_they_drive_to_the_goal(name):
    """Ahead: forward with hardly a turn; aside: a turn to that side."""
    ahead = first(name, (8.0, 0.0))
    assert ahead.linear > 0.1
    assert abs(ahead.angular) < 0.3
    assert first(name, (2.0, 6.0)).angular > 0.1
    assert first(name, (2.0, -6.0)).angular < -0.1


@pytest.mark.parametrize("name", SEEING)
def test_before_a_wall_they_do_not_drive_on(name):
    """0.15 m before the bumper: no command that gets much nearer."""
    command = first(name, (8.0, 0.0), wall_ahead(0.254 + 0.15))
    assert command.linear < 0.25


@pytest.mark.parametrize("name", ["arcs", "dwa", "gap"])
def test_they_turn_to_a_gate(name):
    """A wall 1.5 m ahead with a gate of 1.2 m to the left, or to the right."""
    left = wall_ahead(1.5, gate=(0.5, 1.7))
    assert first(name, (8.0, 0.0), left).angular > 0.05
    assert first(name, (8.0, 0.0), left[::-1].copy()).angular < -0.05


@pytest.mark.parametrize("name", list(PLANAR_NAVIGATORS))
def test_a_reset_forgets(name):
    """The first command of a second drive is that of a new navigator; all are finite."""
    one = PLANAR_NAVIGATORS[name](VEHICLE, np.random.default_rng(0))
    one.reset(LIDAR, (1.0, 6.0))
    for k in range(3):
        command = one.act(readings(wall_ahead(1.2), 0.05 * k, (0.02 * k, 0.0, 0.1 * k)))
        assert np.isfinite([command.linear, command.angular]).all()
    if name == "random":
        return  # Its draws go on.
    one.reset(LIDAR, (8.0, 0.0))
    new = PLANAR_NAVIGATORS[name](VEHICLE, np.random.default_rng(0))
    new.reset(LIDAR, (8.0, 0.0))
    assert one.act(readings()) == new.act(readings())


@pytest.mark.parametrize("name", SEEING)
def test_beams_that_measured_nothing_do_no_harm(name):
    """NaN and 0 are no obstacles: the command is that of open ground."""
    ranges = np.full(LIDAR.count, np.inf)
    ranges[::3], ranges[1::3] = np.nan, 0.0
    assert first(name, (8.0, 0.0), ranges) == first(name, (8.0, 0.0))


def test_the_middle_of_a_gap_is_between_its_obstacles():
    """Posts at 1 m to the left and 2 m to the right: the middle of the line between, not of the
    angle (equation 10 of Sezer and Gokasan)."""
    config = FollowGapConfig(radius=0.1, look=4.0, alpha=1e6, gain=1.0, max_yaw_rate=9.0)
    navigator = FollowGapNavigator(VEHICLE, config)
    lidar = PlanarLidarConfig(fov_deg=180, resolution_deg=1.0, max_range=30)
    navigator.reset(lidar, (20.0, 0.0))
    ranges = np.full(lidar.count, np.inf)
    # Walls close both sides up to the posts.
    ranges[:61], ranges[120:] = 2.0, 1.0
    pose = PlanarPose(0.0, 0.0, 0.0)
    command = navigator.act(PlanarReadings(0.0, pose, Twist(0, 0), ranges.astype(np.float32)))
    right, left = 2.0 * np.exp(-1j * np.radians(30)), np.exp(1j * np.radians(30))
    assert command.angular == pytest.approx(np.angle(right + left), abs=0.05)


def test_straight_sees_nothing_and_random_holds():
    """The law of the first, and ten periods of the second's commands."""
    straight = StraightNavigator()
    straight.reset(LIDAR, (0.0, 3.0))
    command = straight.act(readings(wall_ahead(0.5)))
    assert command.linear == pytest.approx(0.0, abs=1e-12)
    assert command.angular == pytest.approx(np.pi)
    aimless = RandomNavigator(VEHICLE, np.random.default_rng(0))
    aimless.reset(LIDAR, (0.0, 3.0))
    commands = [aimless.act(readings()) for _ in range(20)]
    assert len(set(commands)) == 2
    assert len(set(commands[:10])) == 1
