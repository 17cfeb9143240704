"""Navigator for flat ground at speed: arrives among posts with unknown dynamics."""

import math

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.footprint import Obstacles
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.readings import PlanarPose, PlanarReadings
from andabata.machine.planar.vehicle import PLANAR_VEHICLES, PlanarVehicle
from andabata.navigation.mover_forecast import NO_MOVERS
from andabata.navigation.planar.dynamics import PlanarDynamics
from andabata.navigation.planar.mpc_navigator import (
    WITH_MOVERS,
    WITH_TRUE_MOVERS,
    MpcNavigator,
    MpcNavigatorConfig,
)
from andabata.tasks.rooms.planar_drive import (
    BARN_LIDAR,
    DriveRules,
    SimulatedPlanarRobot,
    drive_to_goal,
)
from andabata.tasks.terminations import Outcome
from worlds.rooms.movers import MoverPlan
from worlds.rooms.moving_fields import TASK, moving_field
from worlds.rooms.room import Room, RoomTask
from worlds.world import Start

LIDAR = PlanarLidarConfig(fov_deg=270, resolution_deg=0.75, max_range=10.0)
RADIUS = 0.075
POSTS = np.array([(1.5, 0.1), (2.6, -0.5), (2.6, 0.6), (3.6, 0.0), (4.4, 0.7), (4.5, -0.6)])
GOAL = (6.0, 0.0)
NONE = np.zeros((0, 4))
CROSSED = RoomTask(Start(0.0, 0.0, 0.0), GOAL)
START, REST = PlanarPose(0.0, 0.0, 0.0), Twist(0.0, 0.0)


def ranges_from(pose, posts=POSTS):
    """Return the ranges of the laser among posts [m]."""
    angles = pose.yaw + LIDAR.bearings
    dx, dy = posts[:, 0] - pose.x, posts[:, 1] - pose.y
    along = np.cos(angles)[:, None] * dx + np.sin(angles)[:, None] * dy
    aside = np.cos(angles)[:, None] * dy - np.sin(angles)[:, None] * dx
    depth = np.sqrt(np.maximum(RADIUS**2 - aside**2, 0.0))
    seen = np.where((np.abs(aside) < RADIUS) & (along > 0), along - depth, np.inf)
    return seen.min(axis=1).astype(np.float32)


def readings(pose=START, velocity=REST, ranges=None):
    """Return readings at a pose."""
    return PlanarReadings(0.0, pose, velocity, ranges_from(pose) if ranges is None else ranges)


def made(config=None, are_dynamics_known=False, vehicle="barn"):
    """Return a navigator."""
    rng = np.random.default_rng(0)
    return MpcNavigator(PLANAR_VEHICLES[vehicle], rng, config, are_dynamics_known)


def driven(navigator, vehicle, seconds=8.0):
    """Drive to the goal; return the time it took [s], infinite for contact, and the robot."""
    circles = np.column_stack([POSTS, np.full(len(POSTS), RADIUS)])
    robot = PlanarVehicle(
        PLANAR_VEHICLES[vehicle],
        START,
        Obstacles(NONE, circles, NONE),
        np.random.default_rng(4),
    )
    navigator.reset(LIDAR, GOAL)
    for k in range(round(seconds / 0.05)):
        if math.dist(robot.pose[:2], GOAL) < 0.5:
            return k * 0.05, robot
        robot.step(
            navigator.act(
                PlanarReadings(k * 0.05, robot.odometry, robot.velocity, ranges_from(robot.pose))
            )
        )
    return math.inf, robot


@pytest.mark.parametrize("vehicle", ["barn", "barn-slow"])
def test_it_arrives_among_posts_without_contact_and_knows_the_dynamics(vehicle):
    """Nobody told it the delay, lag and acceleration, and it is fast all the same."""
    navigator, config = made(), PLANAR_VEHICLES[vehicle]
    time, robot = driven(navigator, vehicle)
    assert not robot.has_contact
    assert time < 6.0
    found = navigator.dynamics
    assert found.delay + found.lag == pytest.approx(config.delay + config.lag, abs=0.05)
    assert found.acceleration == pytest.approx(config.acceleration, rel=0.2)


def test_told_dynamics_are_kept():
    """Nothing is identified then."""
    navigator = made(are_dynamics_known=True, vehicle="barn-slow")
    navigator.reset(LIDAR, GOAL)
    for _ in range(5):
        navigator.act(readings(velocity=Twist(0.5, 0.0)))
    assert navigator.dynamics == PlanarDynamics(0.15, 0.25, 1.5, 8.0)


def test_after_a_reset_it_commands_the_same_again():
    """Map, plan, dynamics and random numbers begin anew."""
    navigator, twists = made(), []
    for _ in range(2):
        navigator.reset(LIDAR, GOAL)
        poses = [PlanarPose(0.02 * k, 0.0, 0.0) for k in range(6)]
        twists.append([navigator.act(readings(pose, Twist(0.4, 0.0))) for pose in poses])
    assert twists[0] == twists[1]


def test_a_robot_that_does_not_move_gives_up_its_margin():
    """Only after the time without displacement, and not once it moves again."""
    navigator = made(MpcNavigatorConfig(stuck_time=0.5, standing_time=0.2))
    navigator.reset(LIDAR, GOAL)
    here = np.zeros(2)
    shares = [navigator._stuck(here)[0] for _ in range(12)]
    assert shares[:9] == [0.0] * 9
    assert shares[-1] == navigator.config.recovery_risk
    assert navigator._stuck(np.array([1.0, 0.0]))[0] == 0.0


def test_a_robot_that_stood_may_back_out_until_it_is_away():
    """Ways backwards cost nothing from the standing time on, as far as the way out."""
    navigator = made(MpcNavigatorConfig(standing_time=0.3, recovery_distance=0.4))
    navigator.reset(LIDAR, GOAL)
    shares = [navigator._stuck(np.zeros(2))[1] for _ in range(8)]
    assert shares == [0.0] * 5 + [1.0] * 3
    ways = (0.2, 0.35, 0.45, 0.2)
    found = [navigator._stuck(np.array([-way, 0.0]))[1] for way in ways]
    assert found == [1.0, 1.0, 0.0, 1.0]
    navigator.reset(LIDAR, GOAL)
    assert navigator._stuck(np.zeros(2))[1] == 0.0


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({"pose": PlanarPose(math.nan, 0.0, 0.0)}, "expected finite pose and speeds"),
        ({"velocity": Twist(math.inf, 0.0)}, "expected finite pose and speeds"),
        ({"ranges": np.ones(3, dtype=np.float32)}, "one for each beam of the laser"),
    ],
)
def test_readings_that_cannot_be_used_are_refused(bad, message):
    """The message names what is wrong."""
    navigator = made()
    navigator.reset(LIDAR, GOAL)
    with pytest.raises(ValueError, match=message):
        navigator.act(readings(**bad))


def watched(config):
    """Return a navigator that stood and saw a circle of 0.4 m cross its way at 1 m/s."""
    plan = MoverPlan(radius=0.4, place=(3.0, -1.5), course=((0, 3.0, -1.5), (3, 3.0, 1.5)))
    room = Room("r", (9.0, 9.0), NONE, np.zeros((0, 3)), (CROSSED,), movers=(plan,))
    rng = np.random.default_rng(0)
    robot = SimulatedPlanarRobot(room, CROSSED, PLANAR_VEHICLES["barn"], LIDAR, rng)
    navigator = made(config)
    navigator.reset(LIDAR, GOAL)
    for _ in range(20):
        navigator.act(robot.read())
        robot.step(REST)
    return navigator, robot.movers.places[0, 0]


def test_what_moves_is_followed_and_none_of_its_hits_stays():
    """Its place and velocity are in the forecast, none of its hits is an obstacle."""
    navigator, place = watched(WITH_MOVERS)
    (found,), (velocity,) = navigator._forecast.places, navigator._forecast.velocities
    np.testing.assert_allclose(found, place - (0.0, 0.05), atol=0.1)
    np.testing.assert_allclose(velocity, (0.0, 1.0), atol=0.25)
    blind, _ = watched(None)
    assert blind._forecast is NO_MOVERS
    assert (blind.hits.log_odds > 0.5).any()
    assert not (navigator.hits.log_odds > 0.5).any()


@pytest.mark.parametrize("seed", [7301, 7303])
def test_it_gets_out_of_the_way_of_what_moves(seed):
    """Where it is hit without, it arrives with tracks."""
    world = moving_field(seed, "easy")
    ends = []
    for config in (None, WITH_MOVERS):
        rng, vehicle = np.random.default_rng(0), PLANAR_VEHICLES["barn"]
        robot = SimulatedPlanarRobot(world.room, TASK, vehicle, BARN_LIDAR, rng)
        result = drive_to_goal(made(config), robot, TASK, DriveRules(time_limit=20.0))
        ends.append(result)
    assert ends[0].outcome is Outcome.COLLISION
    assert ends[1].outcome is Outcome.GOAL


def test_one_that_is_told_what_moves_needs_no_sight_of_it():
    """It is in the forecast in the first period, without doubt, although no beam has met it."""
    movers = np.array([[3.0, 2.0, 0.0, -1.0, 0.4]])
    told = PlanarReadings(0.0, START, REST, np.full_like(ranges_from(START), np.inf), movers)
    navigator = made(WITH_TRUE_MOVERS)
    navigator.reset(LIDAR, GOAL)
    navigator.act(told)
    forecast = navigator._forecast
    np.testing.assert_allclose(forecast.places, movers[:, :2])
    np.testing.assert_allclose(forecast.velocities, movers[:, 2:4])
    assert (forecast.radii.tolist(), forecast.doubts.tolist()) == ([0.4], [0.0])
    with pytest.raises(ValueError, match="movers: expected those of a simulated robot, got none"):
        navigator.act(readings())
