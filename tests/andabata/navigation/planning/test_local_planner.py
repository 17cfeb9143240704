"""Local planner: it remembers, goes around obstacles, leaves dead ends, and prefers near scans."""

from dataclasses import replace

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.evaluation.trial import run_trial
from andabata.machine.kinematics import Twist
from andabata.machine.robot import RobotModel
from andabata.machine.simulator import SensingConfig
from andabata.models import shipped_ground_classifier
from andabata.navigation.controller import NoPlanner, Steering
from andabata.navigation.planning.ground_layer import GroundLayerConfig
from andabata.navigation.planning.local_planner import LocalPlanner, LocalPlannerConfig
from andabata.navigation.planning.occupancy_config import OccupancyGridConfig
from andabata.navigation.planning.trajectory_rollouts import TrajectoryRolloutsConfig
from andabata.navigation.reactive import ReactiveController
from andabata.tasks.episode_monitor import Outcome, TerminationConfig
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box
from tests.situations import (
    GRID,
    ORIGIN,
    StubAssembler,
    between,
    constant_classifier,
    layers_of,
    nothing_seen,
    odds_of,
    pose_at,
    scan_of,
    sector_of,
    situation,
)
from traversability.labels import CellState
from traversability.virtual_scan import certain_log_odds
from worlds.rays import RayScene
from worlds.scenes import Scene
from worlds.truth import TruthConfig, build_truth
from worlds.world import Start, Task, World

AHEAD = np.array([8.0, 0.0])
OCCUPANCY = OccupancyGridConfig()


def wall_ahead(distance=3.0, half_width=4.0):
    """Return the log odds of a scan with a wall across the way."""
    bearings = GRID.bearings
    reach = np.where(np.cos(bearings) > 0.05, distance / np.maximum(np.cos(bearings), 0.05), np.inf)
    hit = np.abs(reach * np.sin(bearings)) < half_width
    return odds_of(np.where(hit & (reach < 10), reach, np.inf))


def seen(planner, odds, times=12, position=ORIGIN, yaw=0.0):
    """Return a planner whose grid has taken in some scans from one place."""
    for _ in range(times):
        planner.occupancy.update(odds, position, yaw)
    return planner


def cell_of(planner, place):
    """Return the cell of a place [m] in the square of the plan."""
    corner, cell = planner.plan.corner, planner.config.occupancy.cell
    return tuple(np.floor((np.array(place) - corner) / cell).astype(int))


def test_a_free_way_leads_straight_to_the_goal():
    """Unknown and free ground need no sub-goal."""
    assert LocalPlanner(GRID).subgoal(ORIGIN, AHEAD) is None
    assert seen(LocalPlanner(GRID), odds_of(np.inf)).subgoal(ORIGIN, AHEAD) is None


def test_the_sub_goal_leads_around_a_wall():
    """It lies to the side, within the lookahead."""
    place = seen(LocalPlanner(GRID), wall_ahead()).subgoal(ORIGIN, AHEAD)
    assert abs(np.arctan2(place[1], place[0])) > np.deg2rad(35)
    assert np.hypot(*place) <= LocalPlannerConfig().max_lookahead


def test_a_dead_end_is_left_backwards():
    """In a trap that is open behind the sub-goal lies behind."""
    bearings = np.abs(GRID.bearings)
    trap = odds_of(np.where(bearings < np.deg2rad(130), 2.5, np.inf))
    place = seen(LocalPlanner(GRID), trap).subgoal(ORIGIN, AHEAD)
    assert abs(np.arctan2(place[1], place[0])) > np.deg2rad(110)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_what_was_seen_keeps_its_place(yaw):
    """Within the square obstacles are remembered, beyond it they are forgotten."""
    planner = seen(LocalPlanner(GRID), wall_ahead(), yaw=yaw)
    ahead = np.array([np.cos(yaw), np.sin(yaw)])
    before = planner.subgoal(ORIGIN, 8.0 * ahead)
    # Far away and back, as long as it stays within the square.
    for way in (-20.0, 0.0):
        seen(planner, nothing_seen(), 1, way * ahead)
    np.testing.assert_allclose(planner.subgoal(ORIGIN, 8.0 * ahead), before)
    for way in (-200.0, 0.0):
        seen(planner, nothing_seen(), 1, way * ahead)
    assert planner.subgoal(ORIGIN, 8.0 * ahead) is None


def test_near_cells_overrule_far_ones():
    """A wall that is not there from near by is none."""
    planner = seen(LocalPlanner(GRID), wall_ahead(3.0, 2.0))
    seen(planner, odds_of(np.inf), 40, np.array([2.0, 0.0]))
    assert planner.subgoal(ORIGIN, AHEAD) is None


def test_what_was_seen_free_from_near_is_no_wall_from_afar():
    """From the bottom of a hollow the rim that the robot came over looks steep."""
    planner = LocalPlanner(GRID)
    for x in (4.0, 4.5, 5.0, 5.5):
        seen(planner, odds_of(np.inf), 20, np.array([x, 0.0]))
    seen(planner, wall_ahead(4.5, 1.0), 60, ORIGIN)
    assert planner.subgoal(ORIGIN, AHEAD) is None
    unknown = seen(LocalPlanner(GRID), wall_ahead(4.5, 1.0), 60, ORIGIN)
    assert unknown.subgoal(ORIGIN, AHEAD) is not None


def test_where_the_robot_has_been_it_can_go():
    """The way back along its trail stays open, whatever scans show."""
    planner = LocalPlanner(GRID)
    for x in np.arange(0.0, 8.0, 0.2):
        planner.occupancy.update(wall_ahead(0.9, 3.0), np.array([x, 0.0]), 0.0)
    behind = planner.subgoal(np.array([7.8, 0.0]), np.array([0.0, 0.0]))
    assert behind is None or abs(behind[1]) < 0.3


def test_emptiness_that_nothing_hides_is_an_edge():
    """Empty cells with nothing in front of them block the way; behind an obstacle they do not."""
    brink = np.full((GRID.n_sectors, GRID.n_rings), CellState.TRAVERSABLE, dtype=np.uint8)
    front = np.abs(GRID.bearings) < np.deg2rad(60)
    brink[np.ix_(front, GRID.ring_edges[:-1] > 2.0)] = CellState.EMPTY
    goal = np.array([4.0, 0.0])
    place = seen(LocalPlanner(GRID), certain_log_odds(brink), 20).subgoal(ORIGIN, goal)
    assert place is not None
    hidden = brink.copy()
    hidden[front, 4] = CellState.NON_TRAVERSABLE
    behind = seen(LocalPlanner(GRID), certain_log_odds(hidden), 20)
    assert behind.subgoal(goal, np.array([3.2, 0.0])) is None


def test_a_goal_beyond_the_square_is_headed_for():
    """A goal half a kilometre away gives a sub-goal that does not lead back."""
    planner = seen(LocalPlanner(GRID), wall_ahead())
    place = planner.subgoal(ORIGIN, np.array([500.0, 0.0]))
    assert place[0] > -2.0


@pytest.mark.parametrize("nowhere", [np.nan, np.inf])
def test_a_goal_that_is_no_place_is_refused(nowhere):
    """Goal and position have to be finite, or they would be looked up beyond the square."""
    for position, goal in ((ORIGIN, [nowhere, 0.0]), ([0.0, nowhere], AHEAD)):
        with pytest.raises(ValueError, match="goal: expected finite places"):
            LocalPlanner(GRID).subgoal(np.array(position), np.array(goal))


def test_the_plan_stays_inside_the_geofence():
    """The geofence is given in the map; odom is turned and shifted against it."""
    turn = 0.5
    c, s = np.cos(turn), np.sin(turn)
    planner = LocalPlanner(GRID)
    odometry = pose_at(1.0, -2.0, -0.2)
    given = situation(
        heading_error=-turn,
        pose=pose_at(10.0, 20.0, turn - 0.2),
        odometry=odometry,
        geofence=(0.0, 18.0, 40.0, 40.0),
    )
    planner.guide(given, None)
    x, y = (np.mgrid[:256, :256] + 0.5) * 0.2 + planner.plan.corner[:, None, None]
    x, y = x - 1.0, y + 2.0
    there = 10.0 + c * x - s * y, 20.0 + s * x + c * y
    inside = (there[0] > 0) & (there[0] < 40) & (there[1] > 18) & (there[1] < 40)
    np.testing.assert_array_equal(planner.plan.clearance > 0, inside)
    planner.guide(replace(given, geofence=None, heading_error=2.0), None)
    assert (planner.plan.clearance > 0).all()


def test_without_poses_map_and_odom_are_the_same():
    """A geofence alone bounds the plan where it stands."""
    planner = LocalPlanner(GRID)
    planner.keep_inside((-3.0, -4.0, 5.0, 6.0))
    planner.subgoal(ORIGIN, np.array([1.0, 0.0]))
    inside = np.argwhere(planner.plan.clearance > 0) * 0.2 + planner.plan.corner + 0.1
    np.testing.assert_allclose(inside.min(axis=0), [-2.9, -3.9])
    np.testing.assert_allclose(inside.max(axis=0), [4.9, 5.9])
    planner.reset()
    planner.subgoal(ORIGIN, np.array([1.0, 0.0]))
    assert (planner.plan.clearance > 0).all()


def dead_end():
    """Return a flat world with a dead end between start and goal."""
    ground = Heightfield(np.zeros((61, 61), dtype=np.float32), 1.0)
    sides = [((2.0, y, 1.0), (10.0, 0.4, 2.0)) for y in (-3.0, 3.0)]
    walls = tuple(
        box(SemanticClass.WALL, centre, size)
        for centre, size in (*sides, ((7.0, 0.0, 1.0), (0.4, 6.4, 2.0)))
    )
    truth = build_truth(ground, walls, TruthConfig(border=0.0))
    surface = np.full((60, 60), SemanticClass.GROUND, dtype=np.uint8)
    task = Task(Start(0.0, 0.0, 0.0), ((14.0, 0.0),))
    return World("dead-end", 0, 0.5, ground, surface, walls, (task,), truth)


def test_a_robot_with_a_planner_leaves_a_dead_end_and_one_without_does_not():
    """Planning decides over the goal behind a trap that a reactive law cannot leave."""
    world = dead_end()
    scene = Scene(world, RayScene(world))
    sensing = SensingConfig(scanner="horizontal", proprioception=None)
    config = SimulatedRobotConfig(plant="kinematic", sensing=sensing, localizer="truth")
    outcomes = {}
    for has_planner in (False, True):
        planner = LocalPlanner(config.grid, config.local_planner) if has_planner else NoPlanner()
        steering = Steering(ReactiveController(config.robot, config.grid), planner)
        robot = SimulatedRobot(scene, config, None, steering)
        (attempt,) = run_trial(robot, world.tasks[0], TerminationConfig(), np.random.default_rng(1))
        outcomes[has_planner] = attempt.outcome
        robot.close()
    assert outcomes[True] is Outcome.GOAL
    assert outcomes[False] is not Outcome.GOAL


def test_emptiness_is_no_edge_where_the_robot_has_been():
    """Ground under the laser is never seen: the driven trail stays free all the same."""
    planner = seen(LocalPlanner(GRID), odds_of(np.inf))
    seen(planner, nothing_seen(), 12, np.array([1.0, 0.0]))
    planner.subgoal(np.array([1.0, 0.0]), AHEAD)
    assert planner.plan.costs[cell_of(planner, ORIGIN)] == 1.0


def test_what_is_hardly_blocked_costs_more_and_is_no_wall():
    """A cell that is as likely free moves the log odds to its share of certainty."""
    odds = wall_ahead(2.0)
    certain = seen(LocalPlanner(GRID), odds, 60)
    hardly = seen(LocalPlanner(GRID), np.where(odds > 0, 0.2 * OCCUPANCY.certain_blocked, odds), 60)
    i, j = (int(2.1 / 0.2), 0)
    weight = 1 / (1 + np.hypot(i, j) * 0.2 / OCCUPANCY.range_scale)
    first, second = certain.occupancy.log_odds[i, j], hardly.occupancy.log_odds[i, j]
    assert first == pytest.approx(OCCUPANCY.max_log_odds * weight, rel=1e-3)
    assert second == pytest.approx(0.2 * first, rel=1e-3)
    assert certain.subgoal(ORIGIN, AHEAD) is not None
    costs = []
    for planner in (certain, hardly):
        planner.subgoal(ORIGIN, AHEAD)
        place = cell_of(planner, (2.1, 0.1))
        costs.append((planner.plan.clearance[place], planner.plan.costs[place]))
    (wall, dear), (free, less) = costs
    assert (wall, free > 0) == (0, True)
    assert 1.0 < less < dear


def test_there_is_clearance_where_the_robot_came_through():
    """Walls that polar cells make too thick do not close the way back."""
    planner = LocalPlanner(GRID)
    for x in np.arange(0.0, 4.0, 0.1):
        planner.occupancy.update(odds_of(0.7), np.array([x, 0.0]), 0.0)
    planner.subgoal(np.array([3.9, 0.0]), ORIGIN)
    plan, robot = planner.plan, RobotModel()
    middle, beside = (cell_of(planner, (2.0, y)) for y in (0.0, 0.45))
    assert plan.traversed_clearance[middle] * 0.2 > robot.half_radius
    # The passage is the body's circle and two decimetres, less the cell's distance from the trail.
    assert plan.traversed_clearance[middle] * 0.2 < robot.half_radius + 0.2
    assert plan.traversed_clearance[middle] > plan.clearance[middle] > 0.0
    assert plan.traversed_clearance[beside] == plan.clearance[beside] == 0.0


def scans(planner, given, count, layers=None):
    """Return the situations that a planner gives for the same one, again and again."""
    return [planner.guide(given, layers) for _ in range(count)]


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


def ground(rng, noise=0.006):
    """Return points of level ground around the origin, float32, shape (n, 3)."""
    x, y = rng.uniform(-5.5, 5.5, (2, 60_000))
    return np.stack([x, y, rng.normal(0, noise, len(x))], axis=1).astype(np.float32)


def trunk(x, y, rng):
    """Return points of an upright trunk, float32, shape (n, 3)."""
    turn, z = rng.uniform(0, 2 * np.pi, 1500), rng.uniform(0, 1.5, 1500)
    return np.stack([x + 0.1 * np.cos(turn), y + 0.1 * np.sin(turn), z], 1).astype(np.float32)


def with_rock(points, place, width=0.15, height=0.07):
    """Return the points with those over a square block raised by its height."""
    on = (np.abs(points[:, :2] - place) < width / 2).all(axis=1)
    return points + np.outer(on, [0, 0, height]).astype(np.float32)


def polar_cell(x, y):
    """Return sector and ring of the polar cell at a place of the robot's frame [m]."""
    ring = int(np.searchsorted(GRID.ring_edges, np.hypot(x, y), side="right") - 1)
    return sector_of(np.arctan2(y, x)), ring


def with_blocked(cells=(), **changes):
    """Return a situation at the origin whose scan calls some polar cells blocked, others free."""
    odds = np.full((GRID.n_sectors, GRID.n_rings), -6.0, dtype=np.float32)
    for cell in cells:
        odds[cell] = 6.0
    return situation(scan_of(np.inf, odds), **changes)


def shown(points=None, classifier=None, **options):
    """Return layers whose assembler has seen a cloud, or nothing."""
    assembler = StubAssembler()
    if points is not None:
        assembler.show(points)
    return layers_of(assembler, classifier, **options)


def log_odds_at(planner, x, y):
    """Return the log odds of the cell at a place [m]."""
    i, j = np.floor(np.array([x, y]) / 0.2).astype(int)
    return float(planner.occupancy.log_odds[i, j])


def test_a_gap_between_trunks_is_open_whose_polar_cells_are_blocked():
    """Ground cells show a passage of 1.2 m where polar cells are wider than the gap."""
    rng = np.random.default_rng(0)
    places = [(3.1, 0.7), (3.1, -0.7)]
    cloud = np.concatenate([ground(rng), *(trunk(*p, rng) for p in places)])
    blocked = [polar_cell(x, y + side) for x, y in places for side in (-0.3, 0.0, 0.3)]
    fine, coarse = LocalPlanner(GRID), LocalPlanner(GRID)
    scans(fine, with_blocked(blocked), 30, shown(cloud, shipped_ground_classifier()))
    scans(coarse, with_blocked(blocked), 30, shown(cloud))
    for x, y in places:
        assert log_odds_at(fine, x, y) > OCCUPANCY.lethal_log_odds
    assert log_odds_at(fine, 3.1, 0.05) < 0
    assert log_odds_at(coarse, 3.1, 0.3) > OCCUPANCY.lethal_log_odds
    clearances = []
    for planner in (fine, coarse):
        planner.subgoal(ORIGIN, AHEAD)
        clearances.append(0.2 * float(planner.plan.clearance[cell_of(planner, (3.1, 0.0))]))
    assert clearances[0] >= 0.4 - 1e-6  # The body is 0.54 m wide, the gap 1.2 m.
    assert clearances[1] < 0.3


def test_where_no_cloud_has_points_the_scan_decides():
    """A hole in the cloud keeps the log odds of the polar cell."""
    rng = np.random.default_rng(1)
    points = ground(rng)
    hole = np.hypot(points[:, 0] - 3.1, points[:, 1]) > 0.8
    planner = LocalPlanner(GRID)
    layers = shown(points[hole], shipped_ground_classifier())
    scans(planner, with_blocked([polar_cell(3.1, 0.05)]), 30, layers)
    assert log_odds_at(planner, 3.1, 0.05) > OCCUPANCY.lethal_log_odds


@pytest.mark.parametrize(("ahead", "is_wall"), [(4.1, True), (8.1, False)])
def test_far_blocked_polar_cells_close_no_way_where_ground_cells_show_more(ahead, is_wall):
    """From 5 m on a polar cell is a metre long and wide: a trunk in it says little of the rest."""
    sector, ring = polar_cell(ahead, 0.05)
    blocked = with_blocked([(sector + side, ring) for side in (-1, 0, 1)])
    cloud = np.float32([[-9.5, 0.0, 0.0]])  # Behind the robot, far away.
    walled = []
    for classifier, seen_cloud in (
        (shipped_ground_classifier(), cloud),
        (shipped_ground_classifier(), None),
        (None, cloud),
    ):
        planner = LocalPlanner(GRID)
        scans(planner, blocked, 60, shown(seen_cloud, classifier))
        walled.append(log_odds_at(planner, ahead, 0.05) > 0)
    assert walled == [is_wall, True, True]


def test_where_the_robot_stands_there_is_no_wall():
    """A trunk that touches the body leaves the ground under it driven; a reset repeats it all."""
    rng = np.random.default_rng(5)
    planner = LocalPlanner(GRID)
    layers = shown(
        np.concatenate([ground(rng), trunk(0.75, 0.0, rng)]), shipped_ground_classifier()
    )
    scans(planner, with_blocked(), 10, layers)
    assert log_odds_at(planner, 0.1, 0.1) <= -OCCUPANCY.max_log_odds
    once = planner.occupancy.log_odds.copy()
    planner.reset()
    layers.reset()
    assert not planner.occupancy.log_odds.any()
    scans(planner, with_blocked(), 10, layers)
    assert np.array_equal(planner.occupancy.log_odds, once)


def test_the_plan_goes_around_a_low_obstacle_that_scans_call_free():
    """A rock of 7 cm in the clouds is an obstacle; even ground is not."""
    rng = np.random.default_rng(7)
    ahead = np.array([2.05, 0.05])
    even, rock = ([with_rock(ground(rng), ahead, height=h) for _ in range(3)] for h in (0.0, 0.07))
    clearances = []
    for clouds in (even, rock):
        planner, assembler = LocalPlanner(GRID), StubAssembler()
        layers = layers_of(assembler)
        for k in range(30):
            assembler.show(clouds[k % 3], stamp=k)
            planner.guide(situation(), layers)
        clearances.append(float(planner.plan.clearance[cell_of(planner, ahead)]))
        straight = planner.subgoal(ORIGIN, AHEAD) is None
        assert straight is (clouds is even)
    assert clearances[0] > 1
    assert clearances[1] == 0


@pytest.mark.parametrize(("log_odds", "is_wall"), [(-6.0, False), (-2.5, True)])
def test_low_obstacles_on_surely_free_ground_cells_are_none(log_odds, is_wall):
    """A miss counts four times, so that log odds of -2.5 are -1.1 to the planner, and -6 are -4."""
    rng, ahead = np.random.default_rng(10), np.array([2.05, 0.05])
    clouds = [with_rock(ground(rng), ahead) for _ in range(3)]
    planner, assembler = LocalPlanner(GRID), StubAssembler()
    layers = layers_of(assembler, constant_classifier(log_odds), GroundLayerConfig(memory=0.0))
    for k in range(15):
        assembler.show(clouds[k % 3], stamp=k)
        planner.guide(situation(), layers)
    assert (planner.plan.clearance[cell_of(planner, ahead)] == 0) == is_wall


def test_a_cloud_counts_once():
    """A rock of too few points is not found by one cloud, however often it is looked at."""
    rng, rock = np.random.default_rng(8), np.array([1.83, 0.41])
    n = round((8.0 / 0.07) ** 2)
    x, y = rng.uniform(-4.0, 4.0, (2, n))
    points = np.stack([x, y, rng.normal(0, 0.005, n)], axis=1).astype(np.float32)
    planner, layers = LocalPlanner(GRID), shown(with_rock(points, rock))
    scans(planner, situation(), 50, layers)
    assert planner.subgoal(ORIGIN, rock * 2) is None


def test_where_the_robot_has_driven_there_is_no_low_obstacle():
    """A trail over a rock stays free."""
    rng = np.random.default_rng(9)
    planner, assembler = LocalPlanner(GRID), StubAssembler()
    layers = layers_of(assembler)
    for x in np.linspace(0.0, 4.0, 41):
        assembler.show(with_rock(ground(rng), np.array([2.0, 0.0])), stamp=x)
        given = situation(goal_distance=8.0 - x, pose=pose_at(x))
        planner.guide(given, layers)
        planner.occupancy.update(scan_of().log_odds_of(GRID), np.array([x, 0.0]), 0.0)
    planner.subgoal(np.array([4.0, 0.0]), AHEAD)
    assert planner.plan.costs[cell_of(planner, (2.0, 0.0))] == 1.0
