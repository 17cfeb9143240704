"""What the local planner shows to a controller, and when it takes in scans and plans anew."""

import numpy as np
import pytest

from andabata.machine.kinematics import Twist
from andabata.navigation.planning.local_planner import LocalPlanner, LocalPlannerConfig
from andabata.navigation.planning.occupancy_config import OccupancyGridConfig
from andabata.navigation.planning.trajectory_rollouts import TrajectoryRolloutsConfig
from tests.support.local_plans import scans, seen, wall_ahead
from tests.support.situations import (
    GRID,
    ORIGIN,
    between,
    odds_of,
    pose_at,
    scan_of,
    sector_of,
    situation,
)


def test_the_controller_is_shown_the_sub_goals_bearing():
    """It counts from the heading in odom, whatever the pose in the map says."""
    for yaw in (0.0, 2.5):
        planner = seen(LocalPlanner(GRID), wall_ahead(), yaw=yaw)
        given = situation(scan_of(), pose=pose_at(50.0, 60.0, 1.0), odometry=pose_at(yaw=yaw))
        guided = planner.guide(given, None)
        ahead = planner.target
        expected = np.arctan2(ahead[1], ahead[0]) - yaw
        assert np.cos(guided.heading_error - expected) == pytest.approx(1.0)
        assert abs(guided.heading_error) > np.deg2rad(35)
        assert -np.pi < guided.heading_error <= np.pi
        assert (guided.goal_distance, guided.goal) == (given.goal_distance, given.goal)


def test_without_a_sub_goal_the_goal_itself_is_shown():
    """On free ground heading error and target are the goal's."""
    planner = LocalPlanner(GRID)
    guided = planner.guide(situation(heading_error=0.7, odometry=pose_at(2.0, 3.0, 0.3)), None)
    assert guided.heading_error == 0.7
    np.testing.assert_allclose(planner.target, [2.0 + 8.0 * np.cos(1.0), 3.0 + 8.0 * np.sin(1.0)])


@pytest.mark.parametrize("yaw", [0.0, -1.2])
def test_the_controllers_scan_ends_at_remembered_obstacles_on_their_own_side(yaw):
    """An obstacle to the left that the scan does not show ends the left range of ``scan`` alone."""
    planner = LocalPlanner(GRID)
    odometry = pose_at(4.0, -3.0, yaw)
    seen(planner, odds_of(between(30, 60, 2.0)), 20, odometry.position[:2], yaw)
    given = situation(scan_of(), odometry=odometry)
    guided = planner.guide(given, None)
    left, right = sector_of(np.pi / 4), sector_of(-np.pi / 4)
    assert guided.scan.ranges[left] == pytest.approx(2.0, abs=0.25)
    assert np.isinf(guided.scan.ranges[right])
    assert guided.perceived is given.perceived
    assert np.isinf(given.scan.ranges).all()
    assert guided.scan.max_range == given.scan.max_range


def test_remembered_obstacles_end_ranges_up_to_the_lookahead():
    """What is farther than the farthest sub-goal does not end a range."""
    ended = []
    for reach in (3.0, 5.0):
        planner = LocalPlanner(GRID, LocalPlannerConfig(max_lookahead=reach))
        seen(planner, wall_ahead(3.5), 60)
        ended.append(np.isfinite(planner.guide(situation(scan_of()), None).scan.ranges).any())
    assert ended == [False, True]


def test_scans_are_taken_in_at_intervals():
    """The first scan and then each n-th one change the occupancy grid."""
    config = LocalPlannerConfig(occupancy=OccupancyGridConfig(update_every=3))
    planner = LocalPlanner(GRID, config)
    blocked, changes = situation(scan_of(2.0)), []
    for _ in range(7):
        before = planner.occupancy.log_odds.copy()
        planner.guide(blocked, None)
        changes.append(not np.array_equal(before, planner.occupancy.log_odds))
    assert changes == [True, False, False, True, False, False, True]


def test_plans_are_made_at_intervals_or_for_another_goal():
    """A plan serves n scans; a goal that jumps by more than three metres is planned for at once."""
    planner = LocalPlanner(GRID, LocalPlannerConfig(replan_every=4))
    plans, plan = [], planner.plan.plan

    def counted(*arguments):
        plans.append(arguments[-1])
        return plan(*arguments)

    planner.plan.plan = counted
    scans(planner, situation(), 9)
    assert len(plans) == 3
    scans(planner, situation(heading_error=0.3), 3)  # The goal moves by 2.4 m.
    assert len(plans) == 3
    scans(planner, situation(heading_error=0.3), 1)
    assert len(plans) == 4
    scans(planner, situation(heading_error=0.8), 1)  # And now by 4 m.
    assert len(plans) == 5
    np.testing.assert_allclose(plans[-1], 8.0 * np.array([np.cos(0.8), np.sin(0.8)]))


def test_a_reset_forgets_everything():
    """Grid, plan, target and the counter of scans begin anew."""
    planner = LocalPlanner(GRID, rollouts=TrajectoryRolloutsConfig())
    given = situation(scan_of(between(-60, 60, 2.0)))
    first = scans(planner, given, 3)[0]
    planner.reset()
    assert not planner.occupancy.log_odds.any()
    np.testing.assert_array_equal(planner.target, ORIGIN)
    again = planner.guide(given, None)
    assert again.heading_error == first.heading_error
    np.testing.assert_array_equal(again.scan.ranges, first.scan.ranges)


def test_fewer_scans_make_for_shorter_intervals():
    """Numbers of scans are divided by the steps between two, and stay at least one."""
    config = LocalPlannerConfig(
        replan_every=7, occupancy=OccupancyGridConfig(update_every=10, driven_memory=600)
    )
    fewer = config.decimated(3)
    assert fewer.replan_every == 2
    assert fewer.occupancy.update_every == 3
    assert fewer.occupancy.driven_memory == 200
    fewest = config.decimated(50)
    assert (fewest.replan_every, fewest.occupancy.update_every) == (1, 1)
    assert fewest.occupancy.driven_memory == 12
    unchanged = {"replan_every": 7, "occupancy": config.occupancy}
    assert fewer.model_copy(update=unchanged) == config
    assert config.decimated(1) == config


def test_commands_pass_without_rollouts():
    """A planner without rollouts leaves each command as it is."""
    command = Twist(0.1, -0.4)
    assert LocalPlanner(GRID).select(situation(), command) is command


def test_rollouts_check_commands_at_the_pose_in_odom():
    """A wall ahead in odom replaces the command straight on, whatever the map's pose says."""
    planner = LocalPlanner(GRID, rollouts=TrajectoryRolloutsConfig())
    odometry = pose_at(3.0, 1.0, 0.8)
    given = situation(scan_of(between(-35, 60, 1.2)), pose=pose_at(), odometry=odometry)
    for _ in range(100):
        guided = planner.guide(given, None)
    command = planner.select(guided, Twist(0.3, 0.0))
    assert command.angular < 0  # The way round is shorter on the right.
    free = LocalPlanner(GRID, rollouts=TrajectoryRolloutsConfig(max_speed_scale=1.0))
    guided = free.guide(situation(scan_of(), odometry=odometry), None)
    assert free.select(guided, Twist(0.3, 0.2)) == Twist(0.3, 0.2)
