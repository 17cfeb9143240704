"""Local planner: it remembers, goes around obstacles, leaves dead ends, and prefers near scans."""

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.evaluation.trial import run_trial
from andabata.machine.robot import RobotModel
from andabata.machine.simulator import SensingConfig
from andabata.navigation.controller import NoPlanner, Steering
from andabata.navigation.planning.local_planner import LocalPlanner, LocalPlannerConfig
from andabata.navigation.reactive import ReactiveController
from andabata.tasks.episode_monitor import Outcome, TerminationConfig
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box
from tests.support.local_plans import AHEAD, OCCUPANCY, cell_of, seen, wall_ahead
from tests.support.situations import GRID, ORIGIN, nothing_seen, odds_of, pose_at, situation
from traversability.labels import CellState
from traversability.virtual_scan import certain_log_odds
from worlds.rays.scene import RayScene
from worlds.scenes import Scene
from worlds.truth import TruthConfig, build_truth
from worlds.world import Start, Task, World


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
    planner.guide(given._replace(geofence=None, heading_error=2.0), None)
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
