"""Rollouts among movers: yield, wait, pass behind, get out of the way; without tracks, as ever."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.navigation.mover_tracks import TrackedMovers
from tests.support.rollout_plans import CELL, LIMIT, ROBOT, SPEED, rollouts_of, synthetic

RADIUS, PERIOD = 0.25, 0.5
FAR = (12.0, 0.0)


def mover(place, velocity, radius=RADIUS):
    """Return one mover, as tracks tell it."""
    one = np.array([place], dtype=float), np.array([velocity], dtype=float)
    return TrackedMovers(*one, np.array([radius]), np.ones(1), np.full(1, 0.3), np.zeros(1))


def corridor(half):
    """Return a straight way between two walls [m] with a goal at its end."""
    return synthetic(goal=FAR, clearance=lambda x, y: np.maximum(half - np.abs(y), 0.0))


def drive(plan, start, velocity, steps=24, radius=RADIUS, sees=True, fast=2.0):
    """Return commands, poses and the least gap of the outline to a mover on its way."""
    rollouts, pose, given, poses, gaps = rollouts_of(), np.zeros(3), [], [], []
    rollouts = rollouts_of(max_speed_scale=fast)
    for k in range(steps):
        place = np.array(start) + k * PERIOD * np.array(velocity)
        told = mover(place, velocity, radius) if sees else None
        command = rollouts.select(plan, CELL, pose[:2], pose[2], 0.0, told)
        given.append(command)
        poses.append(pose.copy())
        for _ in range(5):
            pose[2] += command.angular * PERIOD / 5
            step = command.linear * PERIOD / 5
            pose[:2] += step * np.array([np.cos(pose[2]), np.sin(pose[2])])
            place = place + PERIOD / 5 * np.array(velocity)
            c, s = np.cos(pose[2]), np.sin(pose[2])
            ahead, left = np.array([[c, s], [-s, c]]) @ (place - pose[:2])
            out = np.array([abs(ahead) - ROBOT.length / 2, abs(left) - ROBOT.width / 2])
            gaps.append(np.hypot(*np.maximum(out, 0.0)) - radius)
    return given, np.array(poses), min(gaps)


@pytest.mark.parametrize("speed", [0.5, 0.8, 1.3])
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("meeting", [1.5, 2.0, 2.5])
def test_it_lets_a_crossing_walker_pass(speed, side, meeting):
    """Without tracks it would be hit, or nearly; with them it never comes near, and arrives."""
    time = meeting / (2 * SPEED)
    start, velocity = (meeting, side * speed * time), (0.0, -side * speed)
    plan = synthetic(goal=FAR)
    assert drive(plan, start, velocity, sees=False)[2] < 0.1
    given, poses, gap = drive(plan, start, velocity)
    assert gap > 0.15
    assert poses[-1, 0] > 4.0
    assert all(abs(command.angular) <= LIMIT for command in given)


def test_where_there_is_no_way_round_it_waits_and_does_not_turn():
    """In a corridor a walker crosses slowly: the robot stands, then goes on straight."""
    plan = corridor(0.6)
    given, poses, gap = drive(plan, (2.0, -1.6), (0.0, 0.35), steps=30)
    assert gap > 0.1
    assert Twist(0.0, 0.0) in given
    assert all(command.linear > 0.0 or command.angular == 0.0 for command in given)
    assert poses[-1, 0] > 4.0
    assert np.abs(poses[:, 2]).max() < 0.5


@pytest.mark.parametrize("aside", [-0.1, 0.05])
def test_it_gets_out_of_the_way_of_who_comes_at_it(aside):
    """Head on at a metre a second: whoever stands, or goes on straight, is hit."""
    plan = synthetic(goal=FAR)
    assert drive(plan, (5.0, aside), (-1.0, 0.0), sees=False)[2] < 0.0
    assert drive(plan, (5.0, aside), (-1.0, 0.0))[2] > 0.05


def test_it_backs_out_before_who_comes_along_a_corridor():
    """Where nothing leads past it gains time backwards."""
    given, _, _ = drive(corridor(0.6), (3.0, 0.0), (-0.3, 0.0), steps=10)
    assert min(command.linear for command in given) < 0.0


@pytest.mark.parametrize(
    ("place", "velocity"), [((-3.0, 0.0), (-1.0, 0.0)), ((4.0, 4.0), (0.0, 1.0))]
)
def test_who_goes_away_slows_nobody_down(place, velocity):
    """The command is driven as fast as without."""
    plan = synthetic(goal=FAR)
    alone = rollouts_of().select(plan, CELL, np.zeros(2), 0.0, 0.0)
    assert alone == Twist(2 * SPEED, 0.0)
    assert rollouts_of().select(plan, CELL, np.zeros(2), 0.0, 0.0, mover(place, velocity)) == alone


@pytest.mark.parametrize("speed", [np.nan, np.inf, 50.0])
def test_tracks_that_cannot_be_change_nothing(speed):
    """A velocity that is no number, or faster than anything, is not steered by."""
    plan = synthetic(goal=FAR)
    told = mover((1.5, 0.0), (-speed, 0.0))
    command = rollouts_of().select(plan, CELL, np.zeros(2), 0.0, 0.0, told)
    assert command == Twist(2 * SPEED, 0.0)


def test_waiting_is_no_loss_of_the_way():
    """Who waits for a mover does not begin to keep less clearance."""
    rollouts, plan = rollouts_of(no_progress_time=2.0), corridor(0.6)
    blocked = mover((1.6, 0.0), (0.0, 0.0))
    for _ in range(20):
        command = rollouts.select(plan, CELL, np.zeros(2), 0.0, 0.0, blocked)
    assert command == Twist(0.0, 0.0)
    assert rollouts._relaxed(np.zeros(2)).radius == rollouts._body.radius
