"""Rollouts: a command stands where it is safe; else a cheaper arc, a turn, or backing out."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.planning.trajectory_rollouts import arc_fan
from tests.support.rollout_plans import (
    AHEAD,
    CELL,
    CONFIG,
    LIMIT,
    ROBOT,
    SPEED,
    checked,
    chosen,
    nowhere,
    planner_of,
    prices,
    rollouts_of,
    selected,
    synthetic,
)
from tests.support.situations import GRID, ORIGIN, between


def test_a_safe_command_stands():
    """Straight on and a gentle turn towards a free goal are driven as commanded."""
    free = planner_of(np.inf)
    assert selected(free, 0.0) == Twist(SPEED, 0.0)
    assert selected(free, 0.2) == Twist(SPEED, 0.2)


def test_a_command_into_a_wall_is_replaced():
    """The robot steers around the wall on the shorter side."""
    command = selected(planner_of(between(-35, 60, 1.2)), 0.0)
    assert command.angular < 0  # The way round is shorter on the right.
    assert command.linear == SPEED


def test_walls_are_kept_away_from_where_there_is_space():
    """Both ways lead on; the straight one passes the wall at a hand's breadth."""
    beside = planner_of(between(20, 160, 0.75))
    needed = ROBOT.half_radius + CONFIG.margin
    places = np.array([[x, 0.0] for x in np.arange(0.0, 1.2, 0.2)]) - beside.plan.corner
    clearance = beside.plan.clearance[tuple((places / CELL).astype(int).T)] * CELL
    assert (clearance > needed).all()
    assert selected(beside, 0.0, cost_share=0.0).angular == 0.0
    assert selected(beside, 0.0).angular < 0.0


def test_where_every_arc_ends_in_a_wall_it_turns_on_the_spot():
    """In a pocket it turns at the limit; once it faces the way out, it drives."""
    pocket = planner_of(between(-150, 150, 0.8), np.array([-8.0, 0.0]))
    command = selected(pocket, 0.0)
    assert (abs(command.angular), command.linear) == (LIMIT, 0.0)
    assert selected(pocket, 0.0, yaw=np.pi) == Twist(SPEED, 0.0)


def test_a_goal_behind_is_turned_to_rather_than_circled():
    """With clearance for an arc it is driven; without the cost of stops it turns on the spot."""
    behind = planner_of(np.inf, np.array([-8.0, 0.5]))
    assert selected(behind, 0.5).linear == SPEED
    assert selected(behind, -0.5, stop_cost=0.0) == Twist(0.0, 0.5)


def test_a_turn_that_has_begun_goes_on():
    """Between two ways of equal cost the robot does not alternate."""
    pocket = planner_of(between(-150, 150, 0.8), np.array([-8.0, 0.0]))
    rollouts = rollouts_of()
    first = rollouts.select(pocket.plan, CELL, ORIGIN, 0.0, 0.0)
    for yaw in np.sign(first.angular) * np.array([-0.2, 0.5, 1.0, 2.0]):
        assert rollouts.select(pocket.plan, CELL, ORIGIN, yaw, 0.0) == first


@pytest.mark.parametrize("heading", [0.0, 0.5, 2.0, -1.1])
def test_the_way_that_it_came_is_a_way_back(heading):
    """Even when nothing else is left; backwards where there is no space to turn round."""
    planner = LocalPlanner(GRID, rollouts=CONFIG)
    blocked = np.full((GRID.n_sectors, GRID.n_rings), np.inf, dtype=np.float32)
    ahead = np.array([np.cos(heading), np.sin(heading)])
    for x in np.arange(-4.0, 0.05, 0.1):
        planner.occupancy.update(blocked, x * ahead, heading)
    planner.subgoal(ORIGIN, -4.0 * ahead)
    turned = selected(planner, 0.0, yaw=heading + np.pi)
    assert abs(turned.angular) <= 0.25
    assert turned.linear == SPEED * CONFIG.max_speed_scale
    backwards = selected(planner, 0.0, yaw=heading)
    assert abs(backwards.angular) <= 0.25
    assert backwards.linear == -SPEED


def test_a_turn_on_the_spot_is_simulated_as_far_ahead_as_an_arc():
    """With a shorter horizon a turn would seem freer than an arc."""
    moves, motion = rollouts_of()._candidates, rollouts_of()._motion
    assert abs(motion.points + moves.after_arc.shape[1] - moves.after_turn.shape[1]) <= 1


def test_arcs_move_as_the_robot_does():
    """All sequences of rates, at constant speed, with the heading of their chords."""
    paths, first = arc_fan(ROBOT, CONFIG.rates, CONFIG.arcs, CONFIG.arc_time)
    assert paths.shape == (125, 33, 3)
    steps = np.hypot(*np.diff(paths[..., :2], axis=1).transpose(2, 0, 1))
    np.testing.assert_allclose(steps, SPEED * 0.2, rtol=2e-3)
    assert set(np.round(first, 3)) == {-0.5, -0.25, 0.0, 0.25, 0.5}
    np.testing.assert_allclose(paths[first == 0][0, 10], [0.66, 0.0, 0.0], atol=1e-9)
    # A left circle of radius speed over rate, within the error of its chords.
    left = paths[(first == 0.5) & (np.abs(paths[:, -1, 2] - 3.3) < 1e-9)][0]
    time = 0.2 * np.arange(1, 34)
    np.testing.assert_allclose(left[:, 2], 0.5 * time, atol=1e-9)
    np.testing.assert_allclose(left[:, 0], 0.6 * np.sin(0.5 * time), atol=1e-3)
    np.testing.assert_allclose(left[:, 1], 0.6 * (1 - np.cos(0.5 * time)), atol=1e-3)


@pytest.mark.parametrize(("relaxation", "gets_out"), [(0.0, False), (0.2, True)])
def test_a_robot_without_progress_keeps_less_clearance_in_the_end(relaxation, gets_out):
    """A pen whose gap seems too narrow, since obstacles are whole cells, is left after a while."""
    planner = LocalPlanner(GRID, rollouts=CONFIG)
    log_odds = planner.occupancy.log_odds
    log_odds[:] = -2.0
    for k in range(-9, 10):
        for i, j in ((k, -9), (k, 8), (-9, k), (8, k)):
            log_odds[i % 256, j % 256] = 3.0
    log_odds[8, [-1, 0]] = -2.0
    planner.subgoal(ORIGIN, AHEAD)
    rollouts = rollouts_of(clearance_relaxation=relaxation, action_repeat=5)
    position, yaw, left = np.zeros(2), 0.0, 0
    for step in range(200):
        command = rollouts.select(planner.plan, CELL, position, yaw, 0.0)
        position = position + 0.5 * command.linear * np.array([np.cos(yaw), np.sin(yaw)])
        yaw += 0.5 * command.angular
        if np.abs(position).max() > 2.2:
            left = step
            break
    assert (left > 0) == gets_out
    if gets_out:
        assert 0.5 * left > CONFIG.no_progress_time


def test_a_first_arc_into_an_obstacle_is_replaced():
    """A thin obstacle that the first arc passes, and the following arcs no more, counts."""
    plan = synthetic(
        clearance=lambda x, y: np.where((np.abs(x - 0.3) < 0.2) & (y > -0.2), 0.0, 3.0)
    )
    assert chosen(plan, 0.0) != Twist(2.0 * SPEED, 0.0)
    assert chosen(plan, 0.0).angular < 0 or chosen(plan, 0.0).linear <= 0


@pytest.mark.parametrize("yaw", [0.0, 1.3])
def test_backing_out_leads_backwards(yaw):
    """Where the way on is behind and neither arc nor turn is free, the robot drives backwards."""
    c, s = np.cos(yaw), np.sin(yaw)
    plan = synthetic(goal=(-8.0 * c, -8.0 * s), clearance=lambda x, y: 0.47 - c * x - s * y)
    assert chosen(plan, 0.0, yaw=yaw).linear == -SPEED
    _, _, back = np.split(rollouts_of()._prices, [6, 18])
    assert len(back) == 3


def test_the_command_is_replaced_only_by_a_way_that_is_cheaper_by_the_margin():
    """A detour that costs less than the margin stands; without a margin it is replaced."""
    plan = nowhere(cost=lambda x, y: 1.0 + np.clip(0.6 * y, 0.0, 1.0))
    arcs, *_ = prices(plan, rate=0.5)
    gain = arcs[0] - arcs.min()
    assert 0.05 < gain < 0.3
    assert chosen(plan, 0.5).angular == 0.5
    assert chosen(plan, 0.5, override_margin=gain + 0.001).angular == 0.5
    assert chosen(plan, 0.5, override_margin=gain - 0.001).angular < 0.5


@pytest.mark.parametrize("yaw", [0.0, 2.2])
def test_position_and_heading_place_the_rollouts_in_the_plan(yaw):
    """A robot elsewhere, that faces elsewhere, steers to the side of its goal."""
    position = np.array([5.0, -7.0])
    for side in (1.0, -1.0):
        goal = position + 6.0 * np.array([np.cos(yaw + side * 1.2), np.sin(yaw + side * 1.2)])
        command = chosen(synthetic(goal), 0.0, position, yaw)
        assert np.sign(command.angular) == side


def test_without_a_way_on_the_nearest_end_to_the_goal_is_taken():
    """Where the plan knows no way the distance to the goal decides."""
    for side in (1.0, -1.0):
        plan = synthetic(goal=(3.0, side * 6.0), rest=np.inf)
        assert np.sign(chosen(plan, 0.0).angular) == side
        arcs, *_ = prices(plan)
        assert (arcs > 1000.0).all()


@pytest.mark.parametrize(
    "command", [Twist(0.6, 0.5), Twist(0.3, 1.0), Twist(0.0, 1.0), Twist(-0.3, 0.5), Twist(0.3, 0)]
)
def test_a_command_with_a_speed_of_its_own_stands_where_the_body_has_room(command):
    """Whatever it is, dear ways too: the rollouts only check that nothing is in the body's way."""
    assert checked(nowhere(), command) == command
    assert checked(synthetic(goal=(-8.0, 0.0), cost=3.0), command) == command


@pytest.mark.parametrize(
    ("speed", "begin", "stands"),
    [(0.6, 1.52, True), (0.6, 1.37, False), (0.3, 1.04, True), (0.3, 0.89, False)],
)
def test_it_is_checked_as_far_as_its_speed_leads(speed, begin, stands):
    """Before a wall the body needs its half length beyond 1.6 s of its way."""
    ahead = synthetic(clearance=lambda x, y: np.clip(begin - x, 0.0, 6.0))
    reach = speed * CONFIG.check_time + ROBOT.length / 4 + ROBOT.half_radius
    assert (begin > reach) is stands
    command = checked(ahead, Twist(speed, 0.0))
    assert (command == Twist(speed, 0.0)) is stands


def test_a_turn_on_the_spot_needs_the_room_of_its_corners():
    """The circle that the body sweeps, without the margin."""
    swing = np.hypot(ROBOT.length, ROBOT.width) / 2
    for extra, stands in ((0.02, True), (-0.02, False)):
        plan = synthetic(clearance=swing + extra)
        assert (checked(plan, Twist(0.0, LIMIT)) == Twist(0.0, LIMIT)) is stands


def test_without_progress_the_rollouts_steer():
    """After the patience, until the robot comes nearer."""
    behind = synthetic(goal=(-8.0, 0.0))
    command = Twist(0.6, 0.0)
    assert checked(behind, command, stalled_time=24.9) == command
    replaced = checked(behind, command, stalled_time=25.1)
    assert replaced == chosen(behind, 0.0)
    assert abs(replaced.angular) == LIMIT


def test_decisions_of_a_check_count_for_the_time_about_a_place():
    """A robot that a policy keeps about a place gives up clearance there as another one does."""
    rollouts = rollouts_of()
    tight = synthetic(clearance=ROBOT.half_radius - 0.05)
    command = Twist(0.3, 0.0)
    assert checked(tight, command, rollouts=rollouts) != command
    for _ in range(130):
        passed = checked(tight, command, rollouts=rollouts)
    assert passed == command
