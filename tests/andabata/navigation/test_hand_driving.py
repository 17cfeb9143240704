"""Driving by hand: keys to twists, and a planner that looks on."""

from types import SimpleNamespace

import pytest

from andabata.machine.kinematics import Twist
from andabata.machine.robot import RobotModel
from andabata.navigation.controller import NoPlanner, Steering
from andabata.navigation.hand_driving import HandController, Onlooker, by_hand, led_by

ROBOT = RobotModel()


@pytest.mark.parametrize(
    ("keys", "speed", "turn"),
    [
        ((), 0, 0),
        (("forward",), 1, 0),
        (("back",), -1, 0),
        (("left",), 0, 1),
        (("forward", "right"), 1, -1),
        (("forward", "back"), 0, 0),
    ],
)
def test_the_twist_is_the_sum_of_the_keys(keys, speed, turn):
    """Forward is the robot's speed, left its largest yaw rate."""
    hand = HandController(ROBOT)
    for key in keys:
        hand.press(key)
    assert hand.act(None) == Twist(speed * ROBOT.speed, turn * ROBOT.max_steering)


def test_a_key_that_is_not_pressed_again_is_let_go():
    """A page that has gone leaves the robot standing in less than a second."""
    hand = HandController(ROBOT)
    hand.press("forward")
    speeds = [hand.act(None).linear for _ in range(12)]
    assert speeds == [ROBOT.speed] * 8 + [0.0] * 4


def test_releasing_stops_at_once_and_taking_over_does_not():
    """A key that is pressed to take over counts."""
    hand = HandController(ROBOT)
    hand.press("forward")
    hand.reset()
    assert hand.act(None).linear > 0
    hand.release()
    assert hand.act(None) == Twist(0.0, 0.0)


def test_an_unknown_key_is_refused():
    """The error names those that there are."""
    with pytest.raises(ValueError, match="expected forward, back, left, right, got 'up'"):
        HandController(ROBOT).press("up")


class Remembering(NoPlanner):
    """Planner that counts what it was shown."""

    shown = 0

    def guide(self, situation, layers):
        self.shown += 1
        return SimpleNamespace()

    def select(self, situation, command):
        return Twist(0.0, 9.0)


def test_the_planner_looks_on_as_often_as_before_and_changes_nothing():
    """Its map goes on at its own rate; situations and commands pass."""
    planner = Remembering()
    steering = by_hand(HandController(ROBOT), Steering(None, planner, 5))
    situation, command = object(), Twist(0.1, 0.2)
    for _ in range(11):
        assert steering.planner.guide(situation, None) is situation
        assert steering.planner.select(situation, command) is command
    assert planner.shown == 3
    assert steering.action_repeat == 1


def test_an_onlooker_is_seen_through_once():
    """By hand after by hand, the planner is still the first one."""
    planner = Remembering()
    again = by_hand(HandController(ROBOT), Steering(None, Onlooker(planner, 5), 1))
    assert led_by(again.planner) is planner
    assert led_by(planner) is planner
