"""Drives of a robot with dynamics to one goal: readings, clock, ends."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.planar.vehicle import PlanarVehicleConfig
from andabata.tasks.rooms.planar_drive import (
    BARN_LIDAR,
    DriveRules,
    SimulatedPlanarRobot,
    drive_to_goal,
    goal_in_odometry,
)
from andabata.tasks.terminations import Outcome
from worlds.rooms.movers import MoverPlan
from worlds.rooms.room import Room, RoomTask
from worlds.world import Start

EXACT = PlanarVehicleConfig(
    delay=0,
    lag=0,
    acceleration=100,
    yaw_acceleration=1000,
    gain_spread=0,
    slip=0,
    odometry_scale=0,
    odometry_turn=0,
    speed_noise=0,
    yaw_rate_noise=0,
    range_noise=0,
)
FOUR = PlanarLidarConfig(fov_deg=270, resolution_deg=90, max_range=4, x=0.1)
UP = RoomTask(Start(1.0, 2.0, np.pi / 2), (1.0, 12.0))


def room(circles=(), boxes=(), movers=()):
    """Return an open room."""
    return Room(
        "r",
        (9.0, 9.0),
        np.array(boxes, dtype=float).reshape(-1, 4),
        np.array(circles, dtype=float).reshape(-1, 3),
        movers=movers,
    )


def course(*rows, radius=0.5):
    """Return a mover on a course of times and places."""
    return MoverPlan(radius=radius, place=rows[0][1:], course=rows)


def robot(made=None, config=EXACT, lidar=FOUR, task=UP, seed=0):
    """Return a robot at the start of a task."""
    rng = np.random.default_rng(seed)
    return SimulatedPlanarRobot(room() if made is None else made, task, config, lidar, rng)


class Steady:
    """Navigator that waits for some periods, then gives the same command."""

    def __init__(self, speed, wait=0, turn=0.0):
        self.command, self.wait, self.goal = Twist(speed, turn), wait, None

    def reset(self, lidar, goal):
        self.goal, self.lidar = goal, lidar

    def act(self, readings):
        self.wait -= 1
        return self.command if self.wait < 0 else Twist(0.0, 0.0)


def test_speeds_are_measured_with_noise_that_nothing_else_depends_on():
    """Deviations are those of the settings; ranges and odometry are the same without them."""
    noisy = EXACT.model_copy(update={"speed_noise": 0.02, "yaw_rate_noise": 0.05})
    drives = [robot(room([(1.0, 5.0, 0.5)]), config) for config in (noisy, EXACT)]
    found, exact = [], []
    for _ in range(400):
        one, other = (drive.read() for drive in drives)
        found.append((one.velocity.linear, one.velocity.angular))
        exact.append(other.velocity)
        np.testing.assert_array_equal(one.ranges, other.ranges)
        assert one.odometry == other.odometry
    np.testing.assert_allclose(np.std(found, axis=0), (0.02, 0.05), rtol=0.15)
    np.testing.assert_allclose(np.mean(found, axis=0), 0.0, atol=0.01)
    assert exact == [Twist(0.0, 0.0)] * len(exact)


def test_the_laser_of_the_benchmark_has_720_beams():
    """270 degrees, 30 m; 0.120 m of the front mount less the benchmark's offset of 0.065 m."""
    assert BARN_LIDAR.count == 720
    assert (BARN_LIDAR.max_range, BARN_LIDAR.y, BARN_LIDAR.yaw_deg) == (30, 0, 0)
    assert BARN_LIDAR.x == pytest.approx(0.120 - 0.065)
    np.testing.assert_allclose(np.degrees(BARN_LIDAR.bearings[[0, -1]]), [-135, 135])


def test_beams_begin_at_the_laser_and_end_at_what_stands():
    """A circle ahead, a wall to the left, nothing elsewhere."""
    made = room(circles=[(1.0, 5.0, 0.5)], boxes=[(-2.0, 1.0, -1.0, 3.0)])
    ranges = robot(
        made, lidar=PlanarLidarConfig(fov_deg=180, resolution_deg=90, max_range=4, x=0.1)
    )
    found = ranges.read().ranges
    np.testing.assert_allclose(found, [np.inf, 2.4, 2.0], rtol=1e-6)


def test_noise_is_on_what_returns_alone():
    """Ranges spread as stated about the true one; beams that meet nothing stay infinite."""
    made = room(circles=[(1.0, 5.0, 0.5)])
    ahead = PlanarLidarConfig(fov_deg=10, resolution_deg=20, max_range=4)
    one = robot(made, EXACT.model_copy(update={"range_noise": 0.01}), ahead)
    values = [float(one.read().ranges[0]) for _ in range(400)]
    assert np.std(values) == pytest.approx(0.01, rel=0.15)
    assert np.mean(values) == pytest.approx(2.5, abs=0.003)
    assert np.isinf(robot(config=PlanarVehicleConfig()).read().ranges).all()


def test_goals_are_in_the_frame_of_the_odometry():
    """10 m ahead is (10, 0) whatever the heading, and aside is aside."""
    np.testing.assert_allclose(goal_in_odometry(UP), (10.0, 0.0), atol=1e-12)
    aside = RoomTask(Start(1.0, 2.0, np.pi / 2), (0.0, 2.0))
    np.testing.assert_allclose(goal_in_odometry(aside), (0.0, 1.0), atol=1e-12)


def test_the_clock_runs_from_a_tenth_of_a_metre():
    """At 1 m/s the goal's metre is reached after 9 m, of which 0.1 m come before the clock."""
    navigator = Steady(1.0, wait=40)
    result = drive_to_goal(navigator, robot(), UP, DriveRules())
    assert result.outcome is Outcome.GOAL
    # 0.15 m is the first period beyond 0.1 m, and 9.05 m the first within the last metre.
    assert result.time == pytest.approx(9.05 - 0.10)
    assert result.goal_distance == pytest.approx(0.95)
    assert len(result.path) == 1 + 40 + 181
    assert navigator.goal == pytest.approx((10.0, 0.0))


def test_contact_ends_a_drive():
    """The box's front at 0.254 m meets a circle of 0.1 m, 4 m ahead."""
    result = drive_to_goal(Steady(2.0), robot(room([(1.0, 6.0, 0.1)])), UP, DriveRules())
    assert result.outcome is Outcome.COLLISION
    assert result.path[-1, 1] - 2.0 == pytest.approx(4.0 - 0.354, abs=0.021)
    assert result.speed == pytest.approx(2.0)
    inside = drive_to_goal(Steady(2.0), robot(room([(1.0, 2.1, 0.1)])), UP, DriveRules())
    assert (inside.outcome, inside.time, len(inside.path)) == (Outcome.COLLISION, 0.0, 1)


def test_contact_at_the_goal_is_no_arrival():
    """The period that touches a circle also comes within the goal's radius."""
    touched = room([(1.0, 11.4, 0.1)])
    result = drive_to_goal(Steady(2.0), robot(touched), UP, DriveRules())
    assert result.goal_distance < DriveRules().goal_radius
    assert result.outcome is Outcome.COLLISION


def test_time_is_up_by_the_clock_and_without_one():
    """Turning on the way past the goal, and never leaving the start."""
    rules = DriveRules(time_limit=3.0)
    moving = drive_to_goal(Steady(1.0, turn=1.0), robot(), UP, rules)
    assert (moving.outcome, moving.time) == (Outcome.TIMEOUT, pytest.approx(3.0))
    still = drive_to_goal(Steady(0.0), robot(), UP, rules)
    assert (still.outcome, still.time) == (Outcome.TIMEOUT, 0.0)
    assert len(still.path) == 61


def test_the_same_seed_gives_the_same_noise_whatever_is_driven():
    """Draws of a period do not depend on the commands: controllers meet the same noise."""
    config = PlanarVehicleConfig()
    drawn = []
    for speed in (0.0, 1.0):
        one = robot(config=config)
        for _ in range(5):
            one.read()
            one.step(Twist(speed, 0.0))
        drawn.append(one._rng.standard_normal())
    assert drawn[0] == drawn[1]


def test_beams_end_at_movers_where_they_are_now():
    """One that comes nearer at 1 m/s, ahead of the laser, from period to period."""
    made = room(movers=(course((0, 1.0, 6.0), (2, 1.0, 4.0)),))
    ahead = PlanarLidarConfig(fov_deg=10, resolution_deg=20, max_range=9)
    one = robot(made, lidar=ahead)
    found = []
    for _ in range(3):
        found.append(float(one.read().ranges[0]))
        one.step(Twist(0.0, 0.0))
    np.testing.assert_allclose(found, 3.5 - 0.05 * np.arange(3), rtol=1e-6)
    np.testing.assert_allclose(one.movers.places[0, 0], (1.0, 6.0 - 0.15))


@pytest.mark.parametrize(
    ("speed", "rows", "contact"),
    [
        (1.0, ((0, 1.0, 5.0), (9, 1.0, 5.1)), Contact.MOVER),
        (0.5, ((0, 1.0, 8.0), (3, 1.0, 2.0)), Contact.HIT),
        (0.0, ((0, 1.0, 8.0), (3, 1.0, 2.0)), Contact.HIT_AT_REST),
        (1.0, ((0, -1.2, 3.0), (4, 4.8, 3.0)), Contact.HIT),
    ],
)
def test_who_drove_into_whom_is_told(speed, rows, contact):
    """The robot into a slow one, a fast one into the robot, into one that stands, or its side."""
    made = room(movers=(course(*rows),))
    result = drive_to_goal(Steady(speed), robot(made), UP, DriveRules(time_limit=9.0))
    assert (result.outcome, result.contact) == (Outcome.COLLISION, contact)


def test_a_drive_keeps_where_movers_were():
    """At the times of its path: along the course, with the radius; without any there are none."""
    made = room(movers=(course((0, 5.0, 5.0), (9, 5.0, 14.0)),))
    result = drive_to_goal(Steady(1.0), robot(made), UP, DriveRules(time_limit=1.0))
    times = 0.05 * np.arange(len(result.path))
    np.testing.assert_allclose(result.movers[:, 0, 0], 5.0)
    np.testing.assert_allclose(result.movers[:, 0, 1], 5.0 + times, atol=1e-9)
    np.testing.assert_allclose(result.movers[:, 0, 2], 0.5)
    alone = drive_to_goal(Steady(1.0), robot(), UP, DriveRules(time_limit=1.0))
    assert alone.movers.shape == (len(alone.path), 0, 3)


def test_contact_with_a_mover_is_exact():
    """The front at 0.254 m meets a circle of 0.5 m that stands on its course, within a step."""
    made = room(movers=(course((0, 1.0, 5.0), (99, 1.0, 5.0001)),))
    result = drive_to_goal(Steady(1.0), robot(made), UP, DriveRules())
    assert result.path[-1, 1] == pytest.approx(5.0 - 0.754, abs=0.011)
    # Aside by more than half of the robot's width and the radius nothing is touched.
    clear = room(movers=(course((0, 1.72, 5.0), (99, 1.72, 5.0001)),))
    passed = drive_to_goal(Steady(1.0), robot(clear), UP, DriveRules())
    assert (passed.outcome, passed.contact) == (Outcome.GOAL, Contact.NONE)


def test_what_stands_counts_before_a_mover():
    """A wall that is touched in the same step."""
    made = room(circles=[(1.0, 5.0, 0.5)], movers=(course((0, 1.0, 5.0), (99, 1.0, 5.0001)),))
    result = drive_to_goal(Steady(1.0), robot(made), UP, DriveRules())
    assert result.contact is Contact.OBSTACLE


def test_movers_change_no_noise_of_the_robot():
    """Slip and ranges are those of the room without them."""
    config = PlanarVehicleConfig()
    drawn = []
    for movers in ((), (MoverPlan(radius=0.3, speed=0.5),)):
        one = robot(room(movers=movers), config)
        for _ in range(5):
            one.read()
            one.step(Twist(1.0, 0.0))
        drawn.append((one._rng.standard_normal(), one.vehicle.pose))
    assert drawn[0] == drawn[1]


def test_the_simulator_tells_what_moves_as_the_odometry_has_it():
    """From the robot's true pose it lies as it does from the believed one; it turns with it."""
    drifts = EXACT.model_copy(update={"odometry_scale": 0.3, "odometry_turn": 0.3})
    one = robot(room(movers=(course((0, 4, 2), (4, 4, 6)),)), drifts)
    for _ in range(20):
        one.step(Twist(1.0, 0.8))
    true, believed = one.vehicle.pose, one.vehicle.odometry
    assert abs(true.yaw - believed.yaw) > 0.02
    (row,) = one.read().movers
    place = (4.0, 2.0 + 20 * EXACT.period)
    ahead, left = _from(true, place)
    np.testing.assert_allclose(_from(believed, row[:2]), (ahead, left), atol=1e-9)
    turn = believed.yaw - true.yaw
    np.testing.assert_allclose(row[2:], (-np.sin(turn), np.cos(turn), 0.5), atol=1e-9)
    assert robot().read().movers.shape == (0, 5)


def _from(pose, place):
    """Return how far a place is ahead and to the left of a pose [m]."""
    dx, dy = place[0] - pose.x, place[1] - pose.y
    c, s = np.cos(pose.yaw), np.sin(pose.yaw)
    return c * dx + s * dy, c * dy - s * dx
