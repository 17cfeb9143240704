"""Navigator: readings in, wheel speeds out; without a scan or a pose the robot stands still."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.localization.initial_pose import initial_pose
from andabata.localization.localizer import Health
from andabata.machine.kinematics import Twist
from andabata.machine.pose import wrap
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import SensorReadings, VehicleState, WheelSpeeds
from andabata.models import Models
from andabata.navigation.arrival import ArrivalConfig
from andabata.navigation.controller import NoPlanner, Steering
from andabata.navigation.navigator import Navigator
from andabata.navigation.perception import assembler_of
from andabata.navigation.reactive import StraightController
from andabata.records.messages import NS, MessageBuilder
from andabata.records.recorder import MessageQueue, Recorder
from andabata.records.topics import DIAGNOSTICS
from tests.support.situations import (
    StubController,
    StubLocalizer,
    StubPerception,
    pose_at,
    scan_of,
)
from worlds.world import Start

ROBOT = RobotModel()
STANDSTILL = WheelSpeeds(0.0, 0.0)


class StubPlanner(NoPlanner):
    """Planner that changes the heading error and the command, and keeps what it was given."""

    def __init__(self):
        self.guided, self.selected, self.layers, self.resets = [], [], [], 0

    def reset(self):
        self.resets += 1

    def guide(self, situation, layers):
        self.guided.append(situation)
        self.layers.append(layers)
        return situation._replace(heading_error=1.5)

    def select(self, situation, command):
        self.selected.append((situation, command))
        return Twist(command.linear, command.angular / 2)


def make(*twists, planner=None, repeat=1, pose=None, odometry=None, scan=None, **more):
    """Return a navigator of stubs with its localizer, perception and controller."""
    localizer, perception = StubLocalizer(pose, odometry), StubPerception(scan)
    controller = StubController(*(twists or (Twist(0.3, 0.0),)))
    steering = Steering(controller, planner or NoPlanner(), repeat)
    navigator = Navigator(ROBOT, localizer, perception, steering, **more)
    return navigator, localizer, perception, controller


def steps(navigator, count):
    """Return the results of some steps."""
    return [navigator.step(SensorReadings(0.1 * (k + 1))) for k in range(count)]


def driven(wheels):
    """Return forward speed and yaw rate of wheel speeds [m/s, rad/s]."""
    left, right = wheels.left * ROBOT.wheel_radius, wheels.right * ROBOT.wheel_radius
    return (left + right) / 2, (right - left) / ROBOT.effective_track


@pytest.mark.parametrize(
    ("goal", "error"),
    [((2.0, 4.0), 0.0), ((2.0, 9.0), 0.0), ((-3.0, 1.0), np.pi / 2), ((7.0, 1.0), -np.pi / 2)],
)
def test_the_heading_error_is_the_goals_bearing_less_the_heading(goal, error):
    """Positive to the left; distance and goal are those of the map's pose, not of odometry."""
    navigator, *_, controller = make(pose=pose_at(2.0, 1.0, np.pi / 2), odometry=pose_at(7.0))
    navigator.set_goal(np.array(goal))
    steps(navigator, 1)
    (given,) = controller.situations
    assert given.heading_error == pytest.approx(error)
    assert given.goal_distance == pytest.approx(np.hypot(goal[0] - 2.0, goal[1] - 1.0))
    np.testing.assert_array_equal(given.goal, goal)


@pytest.mark.parametrize(("yaw", "error"), [(3.0, 2 * np.pi - 6.0), (-3.0, 6.0 - 2 * np.pi)])
def test_the_heading_error_is_wrapped(yaw, error):
    """The short way round is taken across the heading of pi."""
    navigator, *_, controller = make(pose=pose_at(yaw=yaw))
    navigator.set_goal(10.0 * np.array([np.cos(-yaw), np.sin(-yaw)]))
    steps(navigator, 1)
    assert controller.situations[0].heading_error == pytest.approx(error)


def test_a_situation_holds_what_the_robot_knows():
    """Stamp, scan, both poses, truth and geofence reach the controller."""
    pose, odometry, scan = pose_at(1.0, 2.0, 0.3), pose_at(4.0, 5.0, -0.3), scan_of(3.0)
    navigator, *_, controller = make(pose=pose, odometry=odometry, scan=scan)
    navigator.geofence = (-1.0, -2.0, 30.0, 40.0)
    truth = VehicleState(0.7, pose, np.zeros(3), np.zeros(3), STANDSTILL)
    navigator.step(SensorReadings(0.7, truth=truth))
    (given,) = controller.situations
    assert given.stamp == 0.7
    assert given.perceived is scan
    assert given.scan is scan
    assert given.pose is pose
    assert given.odometry is odometry
    assert given.truth is truth
    assert given.geofence == (-1.0, -2.0, 30.0, 40.0)


def test_previous_steering_is_what_was_executed_newest_first():
    """The last two yaw rates, after limit and dead zone; zero at the start."""
    navigator, *_, controller = make(*(Twist(0.3, rate) for rate in (0.2, 0.9, 0.1, -0.4)))
    steps(navigator, 4)
    previous = [given.previous_steering for given in controller.situations]
    assert previous == [(0.0, 0.0), (0.2, 0.0), (0.5, 0.2), (0.0, 0.5)]


def test_a_reset_forgets_the_last_drive():
    """Localizer, perception, planner and controller are reset; the executed rates are forgotten."""
    planner = StubPlanner()
    navigator, localizer, perception, controller = make(Twist(0.3, 0.4), planner=planner, repeat=4)
    steps(navigator, 1)
    pose = pose_at(1.0)
    navigator.reset(pose, 5.0, rough=True)
    assert localizer.resets == [(pose, 5.0, True)]
    assert (perception.resets, planner.resets, controller.resets) == (1, 1, 1)
    assert navigator.start == (pose, 5.0)
    steps(navigator, 1)  # A decision is due again at once.
    assert len(controller.situations) == 2
    assert controller.situations[1].previous_steering == (0.0, 0.0)


def test_the_perceived_scan_is_that_of_the_last_decision():
    """Between decisions it stays, a planner changes nothing of it, and a reset forgets it."""
    navigator, _, perception, _ = make(planner=StubPlanner(), repeat=2)
    assert navigator.perceived is None
    seen = []
    for result in steps(navigator, 4):
        seen.append(result.situation)
        perception.result = scan_of(5.0)
    assert navigator.perceived is seen[2].perceived
    assert seen[3] is None
    navigator.reset(pose_at(1.0), 5.0)
    assert navigator.perceived is None
    perception.result = None
    assert navigator.observe(SensorReadings(5.1)) is None
    assert navigator.perceived is None


@pytest.mark.parametrize("repeat", [1, 3])
def test_a_decision_is_repeated_for_as_many_steps_as_asked(repeat):
    """The controller acts at steps 0, n, 2n; in between its command is driven again."""
    twists = [Twist(0.3, rate) for rate in (0.2, -0.2, 0.4)]
    navigator, _, perception, controller = make(*twists, repeat=repeat)
    results = steps(navigator, 2 * repeat + 1)
    due = [result.situation is not None for result in results]
    assert due == [k % repeat == 0 for k in range(2 * repeat + 1)]
    assert perception.scans == len(controller.situations) == 3
    assert [r.twist for r in results] == [twists[k // repeat] for k in range(2 * repeat + 1)]


def test_a_new_goal_is_decided_on_at_once():
    """Another goal ends the repetition of a command; the same one again does not."""
    navigator, *_, controller = make(repeat=10)
    navigator.set_goal(np.array([5.0, 0.0]))
    steps(navigator, 2)
    navigator.set_goal(np.array([5.0, 0.0]))
    steps(navigator, 1)
    assert len(controller.situations) == 1
    navigator.set_goal(np.array([5.0, 1.0]))
    (result,) = steps(navigator, 1)
    assert len(controller.situations) == 2
    np.testing.assert_array_equal(result.goal, [5.0, 1.0])


def test_a_goal_that_is_changed_from_outside_stays_as_it_was_given():
    """The navigator keeps a copy of its goal."""
    navigator, *_, controller = make()
    goal = np.array([5.0, 0.0])
    navigator.set_goal(goal)
    goal[:] = -5.0
    steps(navigator, 1)
    np.testing.assert_array_equal(controller.situations[0].goal, [5.0, 0.0])


def test_the_planner_guides_the_controller_and_checks_its_command():
    """The controller sees the planner's situation, the wheels its command."""
    planner = StubPlanner()
    navigator, _, perception, controller = make(Twist(0.3, 0.4), planner=planner)
    perception.layers = object()
    (result,) = steps(navigator, 1)
    assert controller.situations[0].heading_error == 1.5
    assert planner.selected == [(controller.situations[0], Twist(0.3, 0.4))]
    assert planner.layers == [perception.layers]
    assert result.situation is controller.situations[0]
    assert result.twist == Twist(0.3, 0.2)
    assert driven(result.wheels) == pytest.approx((0.3, 0.2))


@pytest.mark.parametrize(
    ("selected", "is_overridden"),
    [
        (Twist(0.6, 0.4), False),
        (Twist(0.0, 0.4), True),
        (Twist(-0.3, 0.4), True),
        (Twist(0.3, 0.3), True),
    ],
)
def test_a_command_that_is_turned_elsewhere_is_overridden(selected, is_overridden):
    """Another speed alone is not; between two decisions there is nothing to say."""
    planner = StubPlanner()
    planner.select = lambda situation, command: selected
    navigator, *_ = make(Twist(0.3, 0.4), planner=planner, repeat=2)
    first, second = steps(navigator, 2)
    assert (first.is_overridden, second.is_overridden) == (is_overridden, None)


@pytest.mark.parametrize("linear", [0.3, 0.6, -0.3, 0.1])
def test_the_commanded_speed_reaches_the_wheels(linear):
    """Twice the robot's speed, half of it and driving backwards are driven as commanded."""
    navigator, *_ = make()
    twist, wheels = navigator.execute(Twist(linear, 0.3))
    assert twist == Twist(linear, 0.3)
    assert driven(wheels) == pytest.approx((linear, 0.3))


def test_a_turn_on_the_spot_turns_the_wheels_against_each_other():
    """Without forward speed the sides turn alike in opposite directions."""
    navigator, *_ = make()
    _, wheels = navigator.execute(Twist(0.0, 0.5))
    assert wheels.left == -wheels.right < 0.0
    _, driving = navigator.execute(Twist(ROBOT.speed, 0.5))
    mean = (driving.left + driving.right) / 2 * ROBOT.wheel_radius
    assert mean == pytest.approx(ROBOT.speed)


@pytest.mark.parametrize(
    ("rate", "executed"), [(2.0, 0.5), (-2.0, -0.5), (0.14, 0.0), (-0.14, 0.0), (0.16, 0.16)]
)
def test_limit_and_dead_zone_apply_to_what_is_executed(rate, executed):
    """The executed twist, its wheel speeds and the next situation agree."""
    navigator, *_ = make()
    twist, wheels = navigator.execute(Twist(0.3, rate))
    assert twist == Twist(0.3, executed)
    assert driven(wheels) == pytest.approx((0.3, executed))
    situation = navigator.observe(SensorReadings(0.1))
    assert situation.previous_steering == (executed, 0.0)


@pytest.mark.parametrize("command", [Twist(np.nan, 0.0), Twist(0.3, np.inf)])
def test_a_command_that_is_not_finite_is_refused(command):
    """No wheel gets a speed that is no number."""
    navigator, *_ = make()
    with pytest.raises(ValueError, match="expected a finite twist"):
        navigator.execute(command)


def test_a_lost_robot_stands_still_and_remembers_it():
    """What is executed while lost is a standstill, also in the next situation."""
    navigator, localizer, *_ = make()
    navigator.execute(Twist(0.3, 0.4))
    localizer.health = Health.LOST
    assert navigator.execute(Twist(0.3, 0.4)) == (Twist(0.0, 0.0), STANDSTILL)
    localizer.health = Health.DEGRADED
    assert navigator.observe(SensorReadings(0.1)).previous_steering == (0.0, 0.4)
    assert navigator.execute(Twist(0.3, 0.4))[0] == Twist(0.3, 0.4)


def test_a_robot_without_a_heading_creeps():
    """Speed is a tenth of a metre a second at most, either way; it turns as it is told."""
    navigator, localizer, *_ = make()
    localizer.health = Health.DISORIENTED
    assert navigator.execute(Twist(0.3, 0.4))[0] == Twist(0.1, 0.4)
    assert navigator.execute(Twist(-0.3, 0.4))[0] == Twist(-0.1, 0.4)
    assert navigator.execute(Twist(0.05, 0.0))[0] == Twist(0.05, 0.0)


def test_without_a_scan_the_robot_stands_still_and_asks_again():
    """No decision is made before the first scan; each step tries again."""
    navigator, _, perception, controller = make(Twist(0.3, 0.4), repeat=5)
    scan, perception.result = perception.result, None
    results = steps(navigator, 3)
    assert [result.wheels for result in results] == [STANDSTILL] * 3
    assert [result.twist for result in results] == [Twist(0.0, 0.0)] * 3
    assert perception.scans == 3
    assert not controller.situations
    assert navigator.observe(SensorReadings(0.4)) is None
    perception.result = scan
    assert steps(navigator, 1)[0].twist == Twist(0.3, 0.4)


def test_observers_see_each_step_and_change_nothing():
    """For observers the scan is made at each step; decisions and commands stay the same."""
    twists = [Twist(0.3, rate) for rate in (0.2, -0.2, 0.4)]
    alone, _, lone_perception, lone = make(*twists, repeat=3)
    watched, _, perception, controller = make(*twists, repeat=3)
    seen, also = [], []
    watched.observers += [seen.append, also.append]
    results, expected = steps(watched, 7), steps(alone, 7)
    assert seen == also == results
    assert [r.wheels for r in results] == [r.wheels for r in expected]
    assert [r.twist for r in results] == [r.twist for r in expected]
    assert len(controller.situations) == len(lone.situations) == 3
    assert (perception.scans, lone_perception.scans) == (7, 3)
    assert all(result.scan is perception.result for result in results)
    assert [r.scan is not None for r in expected] == [r.situation is not None for r in expected]


def test_readings_pass_the_filter_before_anything_sees_them():
    """Localizer, perception, situation and result get the filtered readings."""
    late = lambda readings: replace(readings, stamp=readings.stamp + 100.0)  # noqa: E731
    navigator, localizer, perception, controller = make(readings_filter=late)
    readings = SensorReadings(1.0)
    result = navigator.step(readings)
    assert readings.stamp == 1.0
    assert localizer.readings[0].stamp == perception.readings[0].stamp == 101.0
    assert controller.situations[0].stamp == result.readings.stamp == 101.0
    assert navigator.update(readings).stamp == 101.0


def test_a_learner_drives_from_outside():
    """Without a controller the robot is driven through update, observe and execute."""
    navigator = Navigator(ROBOT, StubLocalizer(), StubPerception())
    readings = navigator.update(SensorReadings(0.1))
    assert navigator.observe(readings).stamp == 0.1
    with pytest.raises(ValueError, match="controller: expected one, got None"):
        navigator.step(SensorReadings(0.2))


@pytest.fixture
def simulated_robot(make_scene):
    config = SimulatedRobotConfig(plant="kinematic")
    scene = make_scene(size=60.0, cell=0.2)
    robot = SimulatedRobot(scene, config, Models(), Steering(StraightController(ROBOT.speed)))
    robot.readings = robot.place(Start(0, 0, 0), np.array([25.0, 0.0]), np.random.default_rng(0))
    yield robot
    robot.close()


def drive(robot, seconds, change=lambda readings: readings):
    """Return the wheel speeds of some seconds whose readings change on their way in."""
    commands = []
    for _ in range(round(seconds * 10)):
        wheels = robot.navigator.step(change(robot.readings)).wheels
        commands.append(wheels)
        robot.readings = robot.simulator.step(wheels)
    return commands


def frozen(readings):
    """Return readings whose sweeps are all the first one of a drive's seventh second."""
    first = frozen.ranges if frozen.ranges is not None else readings.sweeps.ranges[:1]
    frozen.ranges = first
    ranges = np.repeat(first, len(readings.sweeps.ranges), axis=0)
    return replace(readings, sweeps=replace(readings.sweeps, ranges=ranges))


def invalid(readings):
    """Return readings whose sweeps are no numbers."""
    return replace(
        readings, sweeps=replace(readings.sweeps, ranges=readings.sweeps.ranges * np.nan)
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda readings: replace(readings, sweeps=None), "laser: silent for 0.4 s"),
        (invalid, "laser: silent for 0.4 s, what arrives is invalid"),
        (frozen, "laser: silent for 0.4 s, it repeats its last ranges"),
    ],
)
def test_the_robot_stops_by_the_last_arrival_and_goes_on_afterwards(simulated_robot, change, words):
    """0.3 s and a control step after the last ranges that count it stands, however young the cloud
    is, and its health says why; the next ranges end it.
    """
    frozen.ranges = None
    assert drive(simulated_robot, 6.0)[-1] != STANDSTILL
    silent = drive(simulated_robot, 0.3, change)
    # The first frozen sweep is the last that counts.
    until = 4 if change is frozen else 3
    silent += drive(simulated_robot, 0.1 * (until - 2), change)
    assert [wheels == STANDSTILL for wheels in silent] == [False] * until + [True]
    status = simulated_robot.localizer.status
    assert (status.health, status.causes) == (Health.DEGRADED, (words,))
    assert drive(simulated_robot, 2.0, change)[-1] == STANDSTILL
    assert drive(simulated_robot, 0.2)[-1] != STANDSTILL
    assert simulated_robot.localizer.status.causes == ()


def test_a_robot_without_a_laser_has_none_to_miss():
    """Without any arrival a learner that steers by something else drives on."""
    navigator, *_ = make()
    assert STANDSTILL not in [result.wheels for result in steps(navigator, 100)]


def test_the_robot_stops_when_it_is_lost(simulated_robot):
    """Without inertial readings and encoders the filter is lost, until they are back."""
    assert drive(simulated_robot, 6.0)[-1] != STANDSTILL
    deaf = drive(simulated_robot, 1.0, lambda readings: replace(readings, imu=None, encoders=None))
    assert simulated_robot.localizer.health is Health.LOST
    assert deaf[3] == STANDSTILL  # 0.2 s after the time-outs of 0.1 and 0.2 s.
    assert drive(simulated_robot, 1.0)[-1] != STANDSTILL
    assert simulated_robot.localizer.health is not Health.LOST


def test_commands_are_finite_whatever_the_imu_sends(simulated_robot):
    """Inertial readings that are no numbers never become wheel speeds that are none."""
    spoilt = drive(
        simulated_robot, 6.0, lambda s: s if s.imu is None else replace(s, imu=s.imu * np.nan)
    )
    assert all(np.isfinite([w.left, w.right]).all() for w in spoilt)
    assert all(isinstance(w, WheelSpeeds) for w in spoilt)


class Writer:
    """Message writer that keeps what it is given."""

    ros = 1

    def __init__(self):
        self.messages = []

    def write(self, topic, stamp_ns, message):
        self.messages.append((topic, stamp_ns, message))


def test_a_silent_laser_is_reported_when_the_robot_stops(simulated_robot):
    """Diagnostics warn before the first cloud and of a silent laser, and fail when none is left."""
    robot, written, builder = simulated_robot, Writer(), MessageBuilder(1)
    recorder = Recorder(
        MessageQueue(written, builder),
        robot.localizer,
        assembler_of(robot.perception),
        robot.config.grid.bearings,
        clouds=False,
    )
    robot.navigator.observers.append(recorder.record)
    drive(robot, 6.0)
    silent = drive(robot, 9.0, lambda readings: replace(readings, sweeps=None))
    held = 6.0 + [wheels != STANDSTILL for wheels in silent].index(False) / 10
    reported = [
        (stamp - builder.epoch_ns) / NS
        for topic, stamp, message in written.messages
        if topic is DIAGNOSTICS and "laser: silent for 0.4 s" in message.status[0].message
    ]
    assert reported[0] == pytest.approx(held)
    levels = [m.status[0].level for topic, _, m in written.messages if topic is DIAGNOSTICS]
    assert levels[0] == 1  # No cloud yet.
    assert 0 in levels
    assert levels[-1] == 2


def test_a_robot_at_rest_finds_its_initial_pose(simulated_robot):
    """Two and a half seconds of readings at rest give position, heading and tilt."""
    robot = simulated_robot
    robot.readings = robot.place(
        Start(3.0, -2.0, 0.7), np.array([25.0, 0.0]), np.random.default_rng(0)
    )
    assert initial_pose(robot.readings, robot.config.sensing.geo_reference) is None
    kept = [robot.simulator.step(STANDSTILL) for _ in range(25)]
    rows = {
        name: np.concatenate([getattr(s, name) for s in kept if len(getattr(s, name))])
        for name in ("imu", "mag", "gnss")
    }
    pose = initial_pose(SensorReadings(2.5, **rows), robot.config.sensing.geo_reference)
    truth = kept[-1].truth.pose
    assert np.hypot(*(pose.position - truth.position)[:2]) < 3.0
    assert abs(wrap(pose.yaw - truth.yaw)) < np.deg2rad(10)
    assert np.abs(pose.quaternion[:2] - truth.quaternion[:2]).max() < 0.02


def test_another_controller_takes_over_in_the_middle_of_a_drive():
    """It begins afresh, decides at once, and the planner keeps what it knows."""
    planner, second = StubPlanner(), StubController(Twist(0.1, 0.4))
    navigator, *_ = make(Twist(0.3, 0.2), planner=planner, repeat=5, scan=scan_of())
    navigator.reset(pose_at(0.0, 0.0), 0.0)
    resets = planner.resets
    navigator.step(SensorReadings(0.0))
    navigator.steer(Steering(second, navigator.planner, 1))
    assert navigator.step(SensorReadings(0.1)).twist == Twist(0.1, 0.2)
    assert planner.resets == resets
    assert navigator.steering == Steering(second, planner, 1)


def test_spectators_see_each_step_and_cost_no_scan():
    """Between decisions they get none, while observers get one at every step."""
    seen = {"spectators": [], "observers": []}
    for kind, scans in seen.items():
        navigator, *_ = make(repeat=3, scan=scan_of())
        navigator.reset(pose_at(0.0, 0.0), 0.0)
        getattr(navigator, kind).append(lambda result, scans=scans: scans.append(result.scan))
        for k in range(4):
            navigator.step(SensorReadings(0.1 * k))
    assert [scan is not None for scan in seen["spectators"]] == [True, False, False, True]
    assert all(scan is not None for scan in seen["observers"])


def arriving(distance, **more):
    """Return a navigator whose goal is at a distance ahead [m], and its controller."""
    navigator, localizer, _, controller = make(**more)
    navigator.set_goal(np.array([distance, 0.0]))
    return navigator, localizer, controller


def test_a_robot_that_has_arrived_stands_still_until_there_is_another_goal():
    """It asks its controller no more, says so in each step, and drives on to a new goal at once."""
    navigator, localizer, controller = arriving(5.0, repeat=4)
    assert not steps(navigator, 2)[-1].has_arrived  # In the middle of a command.
    localizer.pose = pose_at(4.8)
    results = steps(navigator, 6)
    assert all(result.has_arrived for result in results)
    assert navigator.has_arrived
    assert {result.wheels for result in results} == {STANDSTILL}
    assert {result.situation for result in results} == {None}
    assert len(controller.situations) == 1
    navigator.set_goal(np.array([9.0, 0.0]))
    assert not navigator.has_arrived
    (result,) = steps(navigator, 1)
    assert driven(result.wheels)[0] == pytest.approx(0.3)
    assert not result.has_arrived


def test_the_word_outlives_a_fix_and_the_same_goal_again():
    """The estimate moves by two metres, a graph repeats its goal: the robot has arrived."""
    navigator, localizer, _ = arriving(0.2)
    steps(navigator, 1)
    localizer.pose = pose_at(-2.0)
    navigator.set_goal(np.array([0.2, 0.0]))
    assert steps(navigator, 1)[0].has_arrived
    navigator.reset(pose_at(-2.0), 1.0)
    assert not navigator.has_arrived


@pytest.mark.parametrize("health", [Health.LOST, Health.DISORIENTED])
def test_a_robot_that_does_not_know_where_it_is_declares_nothing(health):
    """At its goal by an estimate that is no good it goes on as if it were not there."""
    navigator, localizer, _ = arriving(0.2)
    localizer.health = health
    assert not any(result.has_arrived for result in steps(navigator, 5))


def test_without_a_goal_there_is_nothing_to_arrive_at():
    """A robot that was never sent anywhere is not at its goal, the origin included once sent."""
    navigator, *_ = make()
    assert not steps(navigator, 1)[0].has_arrived
    navigator.set_goal(np.zeros(2))
    assert steps(navigator, 1)[0].has_arrived


def test_the_rules_of_arrival_are_the_robots():
    """A larger distance is reached sooner."""
    rules = ArrivalConfig(distance=1.5)
    assert not steps(arriving(1.4)[0], 1)[0].has_arrived
    assert steps(arriving(1.4, arrival=rules)[0], 1)[0].has_arrived


@pytest.mark.parametrize("knows_truth", [True, False])
def test_the_oracle_arrives_by_the_true_pose(knows_truth):
    """Who drives by the truth does not err about its own place; all others do."""
    navigator, _, controller = arriving(5.0)
    navigator.steer(Steering(controller, knows_truth=knows_truth))
    assert navigator.steering.knows_truth is knows_truth
    truth = VehicleState(0.1, pose_at(4.9), np.zeros(3), np.zeros(3), STANDSTILL)
    assert navigator.step(SensorReadings(0.1, truth=truth)).has_arrived is knows_truth


def test_a_learner_that_drives_from_outside_is_not_stopped():
    """``update``, ``observe`` and ``execute`` know of no arrival."""
    navigator, *_ = arriving(0.1)
    for _ in range(3):
        assert navigator.observe(navigator.update(SensorReadings(0.1))) is not None
        assert navigator.execute(Twist(0.3, 0.0))[0].linear == 0.3
    assert not navigator.has_arrived
