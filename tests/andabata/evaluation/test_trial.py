"""A trial: goals in a row until one drive fails, measured by the true map."""

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.strict_verdict import StrictMeasures
from andabata.evaluation.trial import is_strict_success, run_trial, safe_length, strict_row
from andabata.machine.kinematics import Twist
from andabata.machine.planar.mover_contact import Contact
from andabata.machine.pose import Pose
from andabata.machine.sensor_readings import SensorReadings, VehicleState, WheelSpeeds
from andabata.navigation.navigator import StepResult
from andabata.tasks.episode_monitor import Outcome, TerminationConfig
from terrain.classes import SemanticClass
from terrain.objects import box
from tests.support.situations import scan_of
from tests.support.walking_worlds import agent, peopled
from worlds.world import Start, Task


class Puppet:
    """A robot that glides straight to its goal, half a metre a step, and tips over at ``bad``.

    It believes to be ``off`` of where it is, and says that it has arrived within 0.9 m.
    """

    config = SimulatedRobotConfig()

    def __init__(self, world, bad=None, speed=5.0, off=0.0):
        self.scene = SimpleNamespace(world=world)
        self.navigator = SimpleNamespace(
            set_goal=self._set_goal, has_arrived=False, perceived=None, spectators=[]
        )
        self.localizer, self._off = SimpleNamespace(), np.array([off, 0.0])
        self.goals, self.starts, self.steps = [], [], 0
        self._bad, self._speed, self._stamp = bad, speed, 0.0

    def _set_goal(self, goal):
        self.goals.append(tuple(goal))
        self.navigator.has_arrived = False

    def place(self, start, goal, rng):
        self.starts.append(start)
        self.first_goal = tuple(goal)
        self._place = np.array([start.x, start.y])
        return self._readings()

    def step(self, readings):
        self.steps += 1
        self._stamp += 0.1
        # Localised before the step, as a navigator does.
        believed = self._place + self._off
        self.localizer.pose = Pose.from_euler(np.array([*believed, 0.0]), 0.0, 0.0, 0.0)
        to_goal = np.array(self.goals[-1]) - believed
        self.navigator.has_arrived = np.hypot(*to_goal) < 0.9
        if self.navigator.has_arrived:
            return self._readings()
        self._place = self._place + 0.1 * self._speed * to_goal / np.hypot(*to_goal)
        return self._readings()

    def _readings(self):
        truth = VehicleState(
            stamp=self._stamp,
            pose=Pose.from_euler(np.array([*self._place, 0.0]), 0.0, 0.0, 0.0),
            linear=np.zeros(3),
            angular=np.zeros(3),
            wheels=WheelSpeeds(0.0, 0.0),
            tipped=bool(self.goals) and self.goals[-1] == self._bad,
        )
        return SensorReadings(self._stamp, truth=truth)


class StruckPuppet(Puppet):
    """A robot that a walker meets in its fifth step, while it stands."""

    def _readings(self):
        readings = super()._readings()
        struck = self.steps == 5
        contact = Contact.HIT_AT_REST if struck else Contact.NONE
        truth = replace(readings.truth, collided=struck, contact=contact)
        return replace(readings, truth=truth, walkers=np.array([[0.0, 0.5, 0.0, 0.3, 0.8]]))


GOALS = ((5.0, 0.0), (5.0, 5.0), (-4.0, 5.0), (-4.0, -4.0))
TASK = Task(Start(0.0, 0.0, 0.0), GOALS)
RULES = TerminationConfig(time_limit=30.0)


def test_an_attempt_says_who_drove_into_whom(make_ground):
    """Being hit is a collision, and its contact tells it apart, with the kind of the other."""
    robot = StruckPuppet(peopled(make_ground(), agent("animal", (0.0, 0.5))))
    (attempt,) = run_trial(robot, TASK, RULES, np.random.default_rng(0))
    assert (attempt.outcome, attempt.contact) == (Outcome.COLLISION, Contact.HIT_AT_REST)
    assert attempt.detail.walker == "animal"
    assert attempt.time == pytest.approx(0.5)


class NearPuppet(Puppet):
    """A robot that sees something at 0.7 m from its seventh step on, and touches nothing."""

    def step(self, readings):
        self.navigator.perceived = scan_of(0.7 if self.steps >= 6 else 0.8)
        return super().step(readings)


def test_a_near_range_ends_a_trial_by_its_rule_alone(make_ground):
    """By the scan of the step, as a collision without a contact whose cause has its own name."""
    rules = TerminationConfig(time_limit=30.0, collision_range=0.72)
    robot = NearPuppet(make_ground())
    (attempt,) = run_trial(robot, TASK, rules, np.random.default_rng(0))
    assert (attempt.outcome, attempt.contact) == (Outcome.COLLISION, Contact.NONE)
    assert (attempt.detail.cause, attempt.time) == ("near range", pytest.approx(0.7))
    free = run_trial(NearPuppet(make_ground()), TASK, RULES, np.random.default_rng(0))
    assert [each.outcome for each in free] == [Outcome.GOAL] * 4


def test_goals_are_visited_in_their_order(make_ground):
    """Each goal is tried once, one after the other, from where the last drive ended."""
    robot = Puppet(make_ground())
    attempts = run_trial(robot, TASK, RULES, np.random.default_rng(0))
    assert robot.first_goal == GOALS[0]
    assert robot.goals == list(GOALS)
    assert [attempt.detail.goal for attempt in attempts] == [1, 2, 3, 4]
    assert {attempt.outcome for attempt in attempts} == {Outcome.GOAL}
    for before, after in pairwise(attempts):
        np.testing.assert_array_equal(before.path[-1], after.path[0])
    for attempt, goal in zip(attempts, GOALS, strict=True):
        left = np.hypot(*(attempt.path[-1, :2] - goal))
        assert 0.4 <= left < 0.9  # It ends in the step in which the robot says so.
        assert attempt.detail.arrival_error == pytest.approx(left)
        assert attempt.detail.position_error == 0.0


@pytest.mark.parametrize("failing", [0, 1, 3])
def test_a_trial_ends_at_the_first_failure(make_ground, failing):
    """After a failed drive no further goal is tried, nor set, nor driven to."""
    robot = Puppet(make_ground(), bad=GOALS[failing])
    attempts = run_trial(robot, TASK, RULES, np.random.default_rng(0))
    assert len(attempts) == failing + 1
    assert robot.goals == list(GOALS[: failing + 1])
    outcomes = [attempt.outcome for attempt in attempts]
    assert outcomes == [Outcome.GOAL] * failing + [Outcome.TIPOVER]
    assert sum(len(attempt.path) - 1 for attempt in attempts) == robot.steps


def test_measures_are_those_of_the_drive(make_ground):
    """Time, distance, shortest path and SPL of an attempt on open ground."""
    robot = Puppet(make_ground())
    task = Task(TASK.start, GOALS[:2])
    attempts = run_trial(robot, task, RULES, np.random.default_rng(0))
    for attempt in attempts:
        steps = len(attempt.path) - 1
        assert attempt.time == pytest.approx(0.1 * steps)
        assert attempt.distance == pytest.approx(0.5 * (steps - 1))  # It stands while it says so.
        assert attempt.detail.forbidden_distance == 0.0
        assert attempt.detail.energy is None
        assert attempt.spl == pytest.approx(min(attempt.shortest / attempt.distance, 1.0))
    length = np.hypot(*(np.array(GOALS[1]) - attempts[1].path[0, :2]))
    assert attempts[1].shortest == pytest.approx(length - 1.0, abs=0.1)


class OverriddenPuppet(Puppet):
    """A robot that decides in every second step, and is overridden on the way to its first goal."""

    def step(self, readings):
        readings = super().step(readings)
        twist, wheels = Twist(0.3, 0.0), WheelSpeeds(0.0, 0.0)
        overridden = None if self.steps % 2 else len(self.goals) == 1
        for watch in self.navigator.spectators:
            watch(StepResult(readings, None, None, np.zeros(2), twist, wheels, False, overridden))
        return readings


def test_decisions_that_were_overridden_are_counted_by_goal(make_ground):
    """As a share of those on the way to it; None of a robot that decided nothing."""
    task = Task(TASK.start, GOALS[:2])
    robot = OverriddenPuppet(make_ground())
    attempts = run_trial(robot, task, RULES, np.random.default_rng(0))
    assert [attempt.detail.overridden for attempt in attempts] == [1.0, 0.0]
    assert robot.navigator.spectators == []
    idle = run_trial(Puppet(make_ground()), task, RULES, np.random.default_rng(0))
    assert [attempt.detail.overridden for attempt in idle] == [None, None]


def test_each_drive_has_its_own_time_limit(make_ground):
    """The limit holds for each goal, not for the trial."""
    robot = Puppet(make_ground(), speed=2.0)
    attempts = run_trial(robot, TASK, TerminationConfig(time_limit=4.6), np.random.default_rng(0))
    assert len(attempts) == 4
    assert sum(attempt.time for attempt in attempts) > 10.0
    slow = run_trial(
        Puppet(make_ground(), speed=1.0),
        TASK,
        TerminationConfig(time_limit=3.0),
        np.random.default_rng(0),
    )
    assert [attempt.outcome for attempt in slow] == [Outcome.TIMEOUT]
    assert slow[0].detail.arrival_error is None


def test_a_word_that_is_false_ends_the_trial(make_ground):
    """Too far from the goal in truth: its own outcome and cause; the errors are in the row."""
    robot = Puppet(make_ground(), off=2.0)
    (attempt,) = run_trial(robot, TASK, RULES, np.random.default_rng(0))
    assert (attempt.outcome, attempt.detail.cause) == (Outcome.FALSE_ARRIVAL, "own estimate")
    assert 1.36 < attempt.detail.arrival_error < 2.9
    assert attempt.detail.position_error == pytest.approx(2.0)
    assert robot.goals == [GOALS[0]]


def test_the_tolerance_is_that_of_the_receiver_unless_it_is_given(make_ground):
    """A slow error of 2 m makes a word that is 2 m off true; no tolerance makes it false again."""
    task, drifting = Task(TASK.start, GOALS[:1]), SimulatedRobotConfig(reality={"gnss_drift": 2.0})

    def outcome(tolerance, config=drifting):
        robot = Puppet(make_ground(), off=2.0)
        robot.config = config
        (attempt,) = run_trial(robot, task, RULES, np.random.default_rng(0), tolerance=tolerance)
        return attempt.outcome

    assert outcome(None) is Outcome.GOAL
    assert outcome(0.0) is Outcome.FALSE_ARRIVAL
    assert outcome(None, SimulatedRobotConfig()) is Outcome.FALSE_ARRIVAL
    assert outcome(2.0, SimulatedRobotConfig()) is Outcome.GOAL


def test_a_strict_success_is_a_success_with_a_clean_outline(make_ground):
    """A drive past a wall at a hand's breadth is none; records without a verdict have none."""
    task = Task(TASK.start, GOALS[:1])
    wall = box(SemanticClass.WALL, (2.5, 0.39, 1.0), (5.0, 0.2, 2.0))
    clear, close = (
        run_trial(Puppet(make_ground(objects=some)), task, RULES, np.random.default_rng(0))[0]
        for some in ([], [wall])
    )
    assert is_strict_success(clear) is True
    assert is_strict_success(replace(clear, outcome=Outcome.STUCK)) is False
    assert is_strict_success(close) is False
    assert "solid" in strict_row(close)["strict_failure"]
    old = replace(clear, detail=replace(clear.detail, strict=None))
    assert set(strict_row(old).values()) == {None}
    late = StrictMeasures(0.6, None)
    assert is_strict_success(replace(clear, detail=replace(clear.detail, strict=late))) is False


def test_the_start_is_jittered_by_the_seed(make_ground):
    """The same seed gives the same start, others give others, near the task's own."""
    starts = []
    for seed in (1, 1, 2):
        robot = Puppet(make_ground())
        run_trial(robot, Task(TASK.start, GOALS[:1]), RULES, np.random.default_rng(seed))
        starts += robot.starts
    assert starts[0] == starts[1] != starts[2]
    for start in starts:
        assert 0 < np.hypot(start.x, start.y) <= 0.2 * 2**0.5
        assert 0 < abs(start.yaw) <= 0.3


def test_readings_of_each_step_are_passed_on(make_ground):
    """``on_step`` gets the readings after every control step, in order."""
    robot, stamps = Puppet(make_ground()), []
    attempts = run_trial(
        robot, TASK, RULES, np.random.default_rng(0), lambda readings: stamps.append(readings.stamp)
    )
    assert len(stamps) == robot.steps
    assert stamps == sorted(stamps)
    assert stamps[-1] == pytest.approx(sum(attempt.time for attempt in attempts))


def test_without_a_truth_there_is_no_trial(make_ground):
    """A robot that gives no true state is refused."""
    robot = Puppet(make_ground())
    robot.place = lambda *_: SensorReadings(0.0)
    with pytest.raises(ValueError, match="truth: expected the simulator's true state"):
        run_trial(robot, TASK, RULES, np.random.default_rng(0))


def test_the_shortest_path_goes_round_and_ends_at_the_radius(make_ground):
    """The safe length is that to the goal's radius, round what is forbidden, 0 at the goal."""
    start = np.array([-4.0, 0.0])
    assert safe_length(make_ground(), start, (4.0, 0.0), 1.0) == pytest.approx(7.0, abs=0.1)
    assert safe_length(make_ground(), start, (4.0, 0.0), 2.0) == pytest.approx(6.0, abs=0.1)
    assert safe_length(make_ground(), start, (-3.5, 0.0), 1.0) == 0.0
    wall = box(SemanticClass.WALL, (0.0, 0.0, 1.0), (0.4, 6.0, 2.0))
    around = safe_length(make_ground(objects=[wall]), start, (4.0, 0.0), 1.0)
    assert 2 * np.hypot(4.0, 3.3) - 1.0 < around < 2 * np.hypot(4.0, 4.2) - 0.6


def test_attempts_say_what_drove_where(make_ground):
    """World, contender and repetition, and of a failure its place, its goal and its cause."""
    robot = Puppet(make_ground(), bad=GOALS[1])
    rng = np.random.default_rng(0)
    first, last = run_trial(robot, TASK, RULES, rng, contender="puppet", repetition=3)
    assert (last.contender, last.scenario, last.repetition) == ("puppet", "made", 3)
    assert (last.detail.goal_place, last.detail.goals) == (GOALS[1], 4)
    assert last.detail.end == tuple(last.path[-1, :2])
    assert (first.detail.cause, last.detail.cause) == ("", "free ground")


class StubOperator:
    """Operator that names a goal before some step, and may drive by hand."""

    def __init__(self, goals, is_driving=False):
        self.goals, self.is_driving, self.calls = goals, is_driving, 0

    def attend(self):
        self.calls += 1
        goal = self.goals.get(self.calls)
        return None if goal is None else np.array(goal)


def test_an_operator_names_another_goal(make_ground):
    """The attempt goes on to it, and its shortest path is the way so far and the rest."""
    robot, operator = Puppet(make_ground()), StubOperator({4: (0.0, 6.0)})
    task = Task(TASK.start, GOALS[:1])
    (attempt,) = run_trial(robot, task, RULES, np.random.default_rng(0), operator=operator)
    assert attempt.outcome is Outcome.GOAL
    assert np.hypot(*(attempt.path[-1][:2] - [0.0, 6.0])) < RULES.goal_radius
    assert operator.calls == robot.steps
    assert attempt.spl == pytest.approx(1.0, abs=0.05)


def test_an_operator_who_says_nothing_changes_nothing(make_ground):
    """Same attempts as without."""
    runs = [
        run_trial(Puppet(make_ground()), TASK, RULES, np.random.default_rng(0), operator=operator)
        for operator in (None, StubOperator({}))
    ]
    assert [[a.time, a.distance, a.shortest] for a in runs[0]] == [
        [a.time, a.distance, a.shortest] for a in runs[1]
    ]


@pytest.mark.parametrize(
    ("is_driving", "outcome"), [(False, Outcome.STUCK), (True, Outcome.TIMEOUT)]
)
def test_a_robot_that_is_driven_by_hand_may_stand(make_ground, is_driving, outcome):
    """It is never stuck; its time runs all the same."""
    robot = Puppet(make_ground(), speed=0.0)
    rules = TerminationConfig(time_limit=8.0, stuck_time=3.0)
    operator = StubOperator({}, is_driving)
    (attempt,) = run_trial(robot, TASK, rules, np.random.default_rng(0), operator=operator)
    assert attempt.outcome is outcome
