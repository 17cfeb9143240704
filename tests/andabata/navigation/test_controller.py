"""Seams of the navigator: the planner that plans nothing, and the default steering."""

from andabata.machine.kinematics import Twist
from andabata.navigation.controller import NoPlanner, Steering
from tests.support.situations import situation


def test_no_planner_leaves_goal_and_command_as_they_are():
    """Situation and command come back as the same objects."""
    given, command = situation(heading_error=0.4), Twist(0.2, -0.3)
    planner = NoPlanner()
    planner.reset()
    assert planner.guide(given, None) is given
    assert planner.select(given, command) is command


def test_steering_decides_at_each_step_without_a_planner_by_default():
    """A default steering has no controller, no planner, and an action repeat of one."""
    steering = Steering()
    assert steering.controller is None
    assert isinstance(steering.planner, NoPlanner)
    assert steering.action_repeat == 1


def test_each_steering_has_a_planner_of_its_own():
    """Two robots share no planner."""
    assert Steering().planner is not Steering().planner
