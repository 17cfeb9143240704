"""Prices of first actions on a true map: straight on, turns, walls, stops, and left as right."""

import math

import numpy as np
import pytest

from andabata.machine.robot import RobotModel
from andabata.navigation.map_observation import action_table, mirrored_actions
from andabata.training.action_prices import ActionPrices, ActionPricesConfig
from andabata.training.map_labels import DECISION_TIME
from tests.support.true_maps import map_of_blocks

ROBOT, PERIOD = RobotModel(), DECISION_TIME
TABLE = action_table(ROBOT)
AHEAD = int(np.flatnonzero((TABLE[:, 0] > 0.5) & (TABLE[:, 1] == 0))[0])
SLOW = int(np.flatnonzero((TABLE[:, 0] == 0.3) & (TABLE[:, 1] == 0))[0])
TURN_RIGHT, TURN_LEFT = np.flatnonzero(TABLE[:, 0] == 0).tolist()
BACK = int(np.flatnonzero((TABLE[:, 0] < 0) & (TABLE[:, 1] == 0))[0])


def prices(truth, pose, goal, speed=0.0, rate=0.0, **settings):
    """Return the prices of all actions at a pose (x, y, yaw)."""
    teacher = ActionPrices(truth, ROBOT, TABLE, ActionPricesConfig(**settings))
    teacher.head_for(np.array(goal))
    return teacher.prices(np.array(pose[:2]), pose[2], speed, rate)


def test_straight_on_is_best_where_the_goal_is_ahead():
    """Fast before slow before all else; what is lost is what the wait costs."""
    found = prices(map_of_blocks(), (3.0, 10.0, 0.0), (15.0, 10.0))
    assert int(np.argmin(found)) == AHEAD
    assert found[SLOW] - found[AHEAD] == pytest.approx(
        ActionPricesConfig().hold * 0.3 / 0.6, abs=0.15
    )
    assert min(found[BACK], found[TURN_LEFT]) > found[SLOW]


def test_a_goal_behind_is_turned_to():
    """On the spot or in an arc, to the nearer side."""
    left = prices(map_of_blocks(), (10.0, 10.0, 0.0), (4.0, 12.0))
    right = prices(map_of_blocks(), (10.0, 10.0, 0.0), (4.0, 8.0))
    assert TABLE[np.argmin(left), 1] > 0
    assert TABLE[np.argmin(right), 1] < 0


def test_what_would_hit_costs_more():
    """Ahead stands a wall within reach of the action: every way ahead is dear, a turn is not."""
    truth = map_of_blocks([(5.0, 6.0, 4.0, 16.0)])
    found = prices(truth, (4.4, 10.0, 0.0), (15.0, 10.0))
    assert found[AHEAD] > found.min() + 6.0
    assert TABLE[np.argmin(found), 0] <= 0.0


def test_a_gap_is_driven_slowly():
    """Haste beside walls costs: the slow action is the better one there, the fast one outside."""
    truth = map_of_blocks([(8.0, 12.0, 0.0, 9.5), (8.0, 12.0, 10.5, 20.0)])
    inside = prices(truth, (9.0, 10.0, 0.0), (15.0, 10.0), speed=0.3)
    outside = prices(truth, (2.0, 10.0, 0.0), (15.0, 10.0), speed=0.3)
    assert inside[SLOW] < inside[AHEAD]
    assert outside[AHEAD] < outside[SLOW]


def test_left_and_right_are_alike():
    """A mirrored place has the mirrored prices."""
    images = mirrored_actions(TABLE)
    left_block, right_block = (map_of_blocks([(6.0, 7.0, *y)]) for y in ((10.3, 13.0), (7.0, 9.7)))
    left = prices(left_block, (4.0, 10.0, 0.3), (12.0, 11.0), rate=0.2, hold=0.5)
    right = prices(right_block, (4.0, 10.0, -0.3), (12.0, 9.0), rate=-0.2, hold=0.5)
    np.testing.assert_allclose(right[images], left, atol=0.35)


def test_stops_cost():
    """To reverse or to turn on the spot from a speed, and to turn back on the spot."""
    pose, goal = (3.0, 10.0, 0.0), (15.0, 10.0)
    still = prices(map_of_blocks(), pose, goal)
    moving = prices(map_of_blocks(), pose, goal, speed=0.3)
    extra = moving - still
    assert np.all(extra[TABLE[:, 0] <= 0] == pytest.approx(1.5))
    assert np.all(extra[TABLE[:, 0] > 0] == 0)
    turning = prices(map_of_blocks(), pose, goal, rate=0.5) - still
    assert turning[TURN_RIGHT] == pytest.approx(1.5)
    assert np.all(np.delete(turning, TURN_RIGHT) == 0)


def test_the_teacher_arrives():
    """By its own cheapest actions, exactly executed, round a wall and through a gap.

    It changes sides in few decisions: a student would learn to turn to and fro.
    """
    truth = map_of_blocks(
        [(9.0, 10.0, 3.0, 20.0), (13.0, 14.0, 0.0, 9.0), (13.0, 14.0, 10.4, 20.0)]
    )
    teacher = ActionPrices(truth, ROBOT, TABLE)
    goal = np.array([17.0, 15.0])
    teacher.head_for(goal)
    x, y, yaw, speed, rate, time = 4.0, 15.0, 2.0, 0.0, 0.0, 0.0
    changes = 0
    while math.hypot(goal[0] - x, goal[1] - y) > 0.8 and time < 120.0:
        best = int(np.argmin(teacher.prices(np.array([x, y]), yaw, speed, rate)))
        changes += TABLE[best, 1] * rate < 0.0
        speed, rate = TABLE[best].tolist()
        x, y = x + speed * PERIOD * math.cos(yaw), y + speed * PERIOD * math.sin(yaw)
        yaw, time = yaw + rate * PERIOD, time + PERIOD
        assert truth.at(x, y)[1] > 0.25
    assert 50.0 < time < 90.0
    assert changes < 0.1 * time / PERIOD


def test_a_price_without_a_goal_is_refused():
    """The teacher has to know where to."""
    teacher = ActionPrices(map_of_blocks(), ROBOT, TABLE)
    with pytest.raises(ValueError, match="head_for"):
        teacher.prices(np.zeros(2), 0.0, 0.0, 0.0)


def test_room_around_the_body_is_worth_a_detour():
    """Beside a wall that straight on would graze, an arc away from it is the cheaper one."""
    truth = map_of_blocks([(5.0, 9.0, 10.4, 12.0)])
    pose, goal = (4.5, 10.0, 0.0), (15.0, 10.0)
    away = np.flatnonzero((TABLE[:, 0] > 0.5) & (TABLE[:, 1] < 0))

    def detour(**settings):
        teacher = ActionPrices(truth, ROBOT, TABLE, ActionPricesConfig(**settings))
        teacher.head_for(np.array(goal))
        found = teacher.prices(np.array(pose[:2]), pose[2], 0.6, 0.0)
        return found[AHEAD] - found[away].min()

    assert detour() > detour(margin=0.0) + 0.1
    assert detour(nearness=0.0) == pytest.approx(detour(margin=0.0))
    assert detour() > 0.0
