"""Rollouts: the wish stands where it does no harm; else the map steers, or turns on the spot."""

import numpy as np
import pytest

from andabata.localization.noisy_ground_truth import (
    NoisyGroundTruthConfig,
    NoisyGroundTruthLocalizer,
)
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.navigation.navigator import Navigator
from andabata.navigation.perception import HorizontalPerception
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.planning.trajectory_rollouts import (
    AROUND,
    TrajectoryRollouts,
    TrajectoryRolloutsConfig,
    fan,
)
from traversability.grid import PolarGrid
from traversability.virtual_scan import VirtualScan

GRID, ROBOT = PolarGrid(), RobotModel()
ORIGIN, AHEAD = np.zeros(2), np.array([8.0, 0.0])


def mapped(ranges, goal=AHEAD):
    """Return a map that has seen sectors free so far [m], with a plan to a goal."""
    local_planner = LocalPlanner(GRID, around=AROUND)
    full = np.broadcast_to(np.asarray(ranges, dtype=np.float32), GRID.n_sectors)
    for _ in range(20):
        local_planner.evidence.mark(
            VirtualScan(full, GRID.outer_radius).log_odds_of(GRID), ORIGIN, 0.0
        )
    local_planner.subgoal(ORIGIN, goal)
    return local_planner


def chosen(local_planner, wish, yaw=0.0, config=None):
    return TrajectoryRollouts(ROBOT, config or TrajectoryRolloutsConfig()).choose(
        local_planner, ORIGIN, yaw, wish
    )


def between(low, high, distance):
    """Return ranges with a wall between two bearings [deg]."""
    bearings = np.rad2deg(GRID.bearings)
    return np.where((bearings > low) & (bearings < high), distance, np.inf)


def test_a_wish_stands_where_it_does_no_harm():
    free = mapped(np.inf)
    assert chosen(free, 0.0) == (0.0, 1.0)
    assert chosen(free, 0.2) == (0.2, 1.0)


def test_a_wish_into_a_wall_is_vetoed():
    wall = mapped(between(-35, 60, 1.2))
    rate, pace = chosen(wall, 0.0)
    assert (np.sign(rate), pace) == (-1.0, 1.0)  # The way round is shorter on the right.


def test_where_there_is_room_it_keeps_away_from_walls():
    """Both ways lead on; the straight one passes the wall at a hand's breadth."""
    beside = mapped(between(20, 160, 0.75))
    room = ROBOT.half_radius + TrajectoryRolloutsConfig().margin
    cells = np.array([[x, 0.0] for x in np.arange(0.0, 1.2, 0.2)]) - beside.plan.corner
    gaps = beside.plan.gaps[tuple((cells / beside.config.cell).astype(int).T)] * beside.config.cell
    assert (gaps > room).all()
    assert chosen(beside, 0.0, config=TrajectoryRolloutsConfig(crowd=0.0))[0] == 0.0
    assert chosen(beside, 0.0)[0] < 0.0


def test_where_every_arc_ends_in_a_wall_it_turns_on_the_spot():
    pocket = mapped(between(-150, 150, 0.8), np.array([-8.0, 0.0]))
    rate, pace = chosen(pocket, 0.0)
    assert (abs(rate), pace) == (ROBOT.max_steering, 0.0)
    # Once it looks at the way out, it drives.
    assert chosen(pocket, 0.0, yaw=np.pi) == (0.0, 1.0)


def test_it_turns_rather_than_circle_a_goal_behind():
    behind = mapped(np.inf, np.array([-8.0, 0.5]))
    assert chosen(behind, 0.5)[1] == 1.0  # There is room for an arc.
    hasty = TrajectoryRolloutsConfig(pause=0.0)
    assert chosen(behind, -0.5, config=hasty) == (0.5, 0.0)


def test_a_turn_that_has_begun_goes_on():
    """Between two ways round that cost the same it does not dither."""
    pocket = mapped(between(-150, 150, 0.8), np.array([-8.0, 0.0]))
    rollouts = TrajectoryRollouts(ROBOT, TrajectoryRolloutsConfig())
    first, _ = rollouts.choose(pocket, ORIGIN, 0.0, 0.0)
    for yaw in np.sign(first) * np.array([-0.2, 0.5, 1.0, 2.0]):
        assert rollouts.choose(pocket, ORIGIN, yaw, 0.0) == (first, 0.0)


@pytest.mark.parametrize("heading", [0.0, 0.5, 2.0, -1.1])
def test_the_way_that_it_came_is_a_way_back(heading):
    """Even when nothing else is left; backwards where there is no room to turn round."""
    local_planner = LocalPlanner(GRID, around=AROUND)
    red = np.full((GRID.n_sectors, GRID.n_rings), np.inf, dtype=np.float32)
    ahead = np.array([np.cos(heading), np.sin(heading)])
    for x in np.arange(-4.0, 0.05, 0.1):
        local_planner.evidence.mark(red, x * ahead, heading)
    local_planner.subgoal(ORIGIN, -4.0 * ahead)
    rate, pace = chosen(local_planner, 0.0, yaw=heading + np.pi)
    assert (abs(rate) <= 0.25, pace) == (True, TrajectoryRolloutsConfig().haste)
    rate, pace = chosen(local_planner, 0.0, yaw=heading)
    assert (abs(rate) <= 0.25, pace) == (True, -1.0)


def driven_up_to(ranges):
    """Return a map of a robot that came from behind and saw sectors free so far [m]."""
    local_planner = LocalPlanner(GRID, around=AROUND)
    odds = VirtualScan(np.asarray(ranges, dtype=np.float32), GRID.outer_radius).log_odds_of(GRID)
    for x in np.arange(-4.0, 0.05, 0.1):
        local_planner.evidence.mark(odds, np.array([x, 0.0]), 0.0)
    local_planner.subgoal(ORIGIN, AHEAD)
    return local_planner


def test_it_hastens_over_ground_that_it_knows_with_room_on_both_sides():
    free = driven_up_to(np.full(GRID.n_sectors, np.inf))
    assert chosen(free, 0.1) == (0.1, 2.0)
    assert chosen(free, 0.1, config=TrajectoryRolloutsConfig(haste=1.0)) == (0.1, 1.0)
    assert chosen(mapped(np.inf), 0.1) == (0.1, 1.0)  # Nobody has seen the ground before it.
    # A wall beside its way.
    paces = [chosen(driven_up_to(between(60, 120, far)), 0.0)[1] for far in (2.4, 1.2, 0.8)]
    assert paces == [2.0, 1.5, 1.0]


def test_whoever_hastens_is_looked_at_as_far_as_that_takes_it():
    """The wall ahead is in the way of the fast arc alone."""
    ahead = driven_up_to(between(-20, 20, 3.0))
    assert chosen(ahead, 0.0, config=TrajectoryRolloutsConfig(haste=1.0, leg_time=1.0))[1] == 1.0
    paces = [
        chosen(ahead, 0.0, config=TrajectoryRolloutsConfig(haste=h, leg_time=2.2))[1]
        for h in (1.2, 3.0)
    ]
    assert paces == [1.2, 1.0]


def test_a_turn_on_the_spot_is_looked_at_as_far_ahead_as_an_arc():
    """Whoever looks less far ahead seems to have more room, and the robot dithers."""
    rollouts = TrajectoryRollouts(ROBOT, TrajectoryRolloutsConfig())
    after_arc, after_turn = rollouts._tails.shape[1], rollouts._ways.shape[1]
    assert abs(rollouts._points + after_arc - after_turn) <= 1


def test_rollouts_move_as_the_robot_does():
    paths, first = fan(ROBOT, TrajectoryRolloutsConfig())
    assert paths.shape == (125, 33, 3)
    steps = np.hypot(*np.diff(paths[..., :2], axis=1).transpose(2, 0, 1))
    np.testing.assert_allclose(steps, ROBOT.speed * 0.2, rtol=2e-3)
    assert set(np.round(first, 3)) == {-0.5, -0.25, 0.0, 0.25, 0.5}
    np.testing.assert_allclose(paths[first == 0][0, 10], [0.66, 0.0, 0.0], atol=1e-9)


@pytest.mark.parametrize("wish", [-3.0, 3.0])
def test_wishes_beyond_the_limit_are_judged_at_the_limit(wish):
    assert chosen(mapped(np.inf, np.array([0.0, np.sign(wish) * 6.0])), wish)[0] == wish


def test_a_turn_on_the_spot_turns_the_wheels_against_each_other():
    rng = np.random.default_rng(0)
    localizer = NoisyGroundTruthLocalizer(NoisyGroundTruthConfig(), rng)
    navigator = Navigator(ROBOT, localizer, HorizontalPerception(GRID))
    navigator.reset(Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0), 0.0)
    wheels = navigator.command(0.5, 0.0)
    assert wheels.left == -wheels.right < 0.0
    driving = navigator.command(0.5)
    mean = (driving.left + driving.right) / 2 * ROBOT.wheel_radius
    assert mean == pytest.approx(ROBOT.speed)


@pytest.mark.parametrize(("squeeze", "gets_out"), [(0.0, False), (0.2, True)])
def test_who_gets_nowhere_keeps_less_room_in_the_end(squeeze, gets_out):
    """A pen with a gap that the map thinks too narrow; its walls are whole cells, so that more of
    the gap may be free."""
    local_planner = LocalPlanner(GRID, around=AROUND)
    local_planner.evidence.values[:] = -2.0
    for k in range(-9, 10):
        for i, j in ((k, -9), (k, 8), (-9, k), (8, k)):
            local_planner.evidence.values[i % 256, j % 256] = 3.0
    local_planner.evidence.values[8, [-1, 0]] = -2.0
    local_planner.subgoal(ORIGIN, AHEAD)
    rollouts = TrajectoryRollouts(ROBOT, TrajectoryRolloutsConfig(squeeze=squeeze, hold=5))
    here, yaw, left = np.zeros(2), 0.0, 0
    for step in range(200):
        rate, pace = rollouts.choose(local_planner, here, yaw, 0.0)
        here = here + 0.5 * pace * ROBOT.speed * np.array([np.cos(yaw), np.sin(yaw)])
        yaw += 0.5 * rate
        if np.abs(here).max() > 2.2:
            left = step
            break
    assert (left > 0) == gets_out
    if gets_out:
        assert 0.5 * left > TrajectoryRolloutsConfig().patience
