"""The judge of a drive: the robot says when it is over, the true state whether it is a success."""

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.evaluation.trial_monitor import TrialMonitor, arrival_tolerance
from andabata.machine.pose import Pose
from andabata.machine.reality import LEVELS
from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState, WheelSpeeds
from andabata.tasks.terminations import Outcome, TerminationConfig
from terrain.classes import SemanticClass
from terrain.objects import box
from tests.support.situations import scan_of

GOAL = np.array([5.0, 0.0])
RULES = TerminationConfig(time_limit=50.0)


def state(stamp, x, y=0.0, yaw=0.0, **others):
    """Return a true state on level ground."""
    return VehicleState(
        stamp=stamp,
        pose=Pose.from_euler(np.array([x, y, 0.0]), 0.0, 0.0, yaw),
        linear=np.zeros(3),
        angular=np.zeros(3),
        wheels=WheelSpeeds(0.0, 0.0),
        **others,
    )


@pytest.fixture
def monitor(make_ground):
    """A judge with 0.4 m of tolerance, in a world of 20 m, before a drive from the origin."""
    made = TrialMonitor(make_ground(), RobotModel(), RULES, 0.4)
    made.begin(state(0.0, 0.0), GOAL)
    return made


@pytest.mark.parametrize(
    ("x", "outcome"),
    [(5.0, Outcome.GOAL), (3.61, Outcome.GOAL), (3.59, Outcome.FALSE_ARRIVAL)],
)
def test_a_word_is_true_within_radius_and_tolerance(monitor, x, outcome):
    """1.0 m + 0.4 m; the true distance is kept."""
    assert monitor.judge(state(1.0, x), True) is outcome
    assert monitor.arrival_error == pytest.approx(abs(5.0 - x))
    assert monitor.ending.outcome is outcome
    assert monitor.goal_radius == 1.0  # Shortest paths end where they did.


def test_without_a_word_no_goal_is_reached(monitor):
    """At the goal the time runs on, and a robot that stands there is stuck."""
    assert monitor.judge(state(1.0, 5.0), False) is None
    assert monitor.arrival_error is None
    assert monitor.judge(state(22.0, 5.0), False) is Outcome.STUCK
    monitor.begin(state(0.0, 0.0), GOAL)
    assert monitor.judge(state(50.0, 5.0), False) is Outcome.TIMEOUT


@pytest.mark.parametrize("x", [5.0, 0.0])
def test_a_word_excuses_no_collision(monitor, x):
    """A body that hits something in the step of the word has failed by that."""
    assert monitor.judge(state(1.0, x, collided=True), True) is Outcome.COLLISION
    assert monitor.judge(state(1.0, x, tipped=True), True) is Outcome.TIPOVER


def test_a_false_word_comes_before_stuck_and_time(monitor):
    """It is what the robot stopped for."""
    assert monitor.judge(state(50.0, 0.0), True) is Outcome.FALSE_ARRIVAL


@pytest.mark.parametrize(
    ("x", "y", "yaw", "outcome"),
    [
        (9.6, 0.0, 0.0, None),
        (9.63, 0.0, 0.0, Outcome.LEFT_WORLD),
        (-9.63, 0.0, 0.0, Outcome.LEFT_WORLD),
        (0.0, 9.63, 0.0, None),
        (0.0, 9.7, 0.0, Outcome.LEFT_WORLD),
        (0.0, -9.63, np.pi / 2, Outcome.LEFT_WORLD),
        (9.55, 0.0, 0.7, Outcome.LEFT_WORLD),
        (30.0, 0.0, 0.0, Outcome.LEFT_WORLD),
    ],
)
def test_a_body_at_the_edge_has_left_the_world(monitor, x, y, yaw, outcome):
    """Within 5 cm of the edge of 10 m by its outline, whatever touched it there."""
    assert monitor.judge(state(1.0, x, y, yaw), False) is outcome
    if outcome is not None:
        assert monitor.judge(state(1.1, x, y, yaw, collided=True), True) is outcome


def test_the_strict_measures_are_those_of_the_drive(make_ground):
    """They begin anew with each drive, and weigh each state by its time."""
    wall = box(SemanticClass.WALL, (2.0, 0.0, 1.0), (0.5, 4.0, 2.0))
    monitor = TrialMonitor(make_ground(objects=[wall]), RobotModel(), RULES, 0.0)
    monitor.begin(state(10.0, 0.0), GOAL)
    monitor.judge(state(11.0, 1.0), False)
    assert monitor.strict.forbidden_time == 0.0
    monitor.judge(state(11.4, 1.5), False)
    assert monitor.strict.forbidden_time == pytest.approx(0.4)
    assert monitor.strict.solid_distance < 0.0
    monitor.begin(state(0.0, 0.0), GOAL)
    assert monitor.strict.forbidden_time == 0.0
    assert monitor.strict.solid_distance is None


def test_the_tolerance_is_the_slow_error_of_the_receiver():
    """Its root mean square in the plane; white noise and a lying receiver change nothing."""
    robot = SimulatedRobotConfig()
    assert arrival_tolerance(robot) == pytest.approx(2**0.5 * 0.25)
    field = SimulatedRobotConfig(reality=LEVELS["field"])
    assert arrival_tolerance(field) == pytest.approx((2 * (0.25**2 + 0.66**2)) ** 0.5)
    noisy = SimulatedRobotConfig(reality={"gnss_noise": 3.0, "gnss_sigma_ratio": 3.0})
    assert arrival_tolerance(noisy) == arrival_tolerance(robot)


def test_the_tolerance_of_a_true_pose_is_that_of_its_errors():
    """Without a receiver and with the filter there is none."""
    given = SimulatedRobotConfig(localizer="truth", errors={"position_sigma": 0.1})
    assert arrival_tolerance(given) == pytest.approx(2**0.5 * 0.1)
    blind = SimulatedRobotConfig(sensing={"proprioception": None})
    assert arrival_tolerance(blind) == 0.0


def test_a_near_range_is_judged_where_the_rules_say_so(make_ground):
    """With the latest scan of each step; who gives none is refused the rule by name."""
    rules = TerminationConfig(collision_range=0.72)
    monitor = TrialMonitor(make_ground(), RobotModel(), rules, 0.4, sees_scan=True)
    monitor.begin(state(0.0, 0.0), GOAL)
    assert monitor.judge(state(1.0, 0.3), False, scan_of(0.73)) is None
    assert monitor.judge(state(2.0, 0.6), False, scan_of(0.71)) is Outcome.COLLISION
    with pytest.raises(ValueError, match=r"terminations\.collision_range"):
        TrialMonitor(make_ground(), RobotModel(), rules, 0.4)
