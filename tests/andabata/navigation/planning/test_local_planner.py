"""The local map: it remembers, goes round, leads out of dead ends, and believes what is near."""

import numpy as np
import pytest

from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
from andabata.evaluation.trial import run_trial
from andabata.machine.pose import Pose
from andabata.machine.robot import RobotModel
from andabata.machine.simulator import SensingConfig
from andabata.navigation.controller import ControllerInput
from andabata.navigation.guided import GuidedController
from andabata.navigation.planning.local_planner import LocalPlanner, LocalPlannerConfig
from andabata.navigation.reactive import ReactiveController
from andabata.tasks.episode_monitor import Outcome, TerminationConfig
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box
from traversability.grid import PolarGrid
from traversability.labels import CellState
from traversability.virtual_scan import VirtualScan, certain_log_odds
from worlds.rays import RayScene
from worlds.scenes import Scene
from worlds.truth import TruthConfig, build_truth
from worlds.world import Start, Task, World

GRID = PolarGrid()
ORIGIN, AHEAD = np.zeros(2), np.array([8.0, 0.0])


def odds(ranges):
    """Return the odds of a scan whose sectors are free so far [m]."""
    full = np.broadcast_to(np.asarray(ranges, dtype=np.float32), GRID.n_sectors)
    return VirtualScan(full, GRID.outer_radius).log_odds_of(GRID)


def wall_ahead(distance=3.0, half_width=4.0):
    """Return the odds of a scan with a wall across the way."""
    bearings = GRID.bearings
    reach = np.where(np.cos(bearings) > 0.05, distance / np.maximum(np.cos(bearings), 0.05), np.inf)
    hit = np.abs(reach * np.sin(bearings)) < half_width
    return odds(np.where(hit & (reach < 10), reach, np.inf))


def seen(local_planner, scan, times=12, here=ORIGIN, yaw=0.0):
    for _ in range(times):
        local_planner.evidence.mark(scan, here, yaw)
    return local_planner


def test_a_free_way_leads_straight_to_the_goal():
    assert LocalPlanner(GRID).subgoal(ORIGIN, AHEAD) is None
    assert seen(LocalPlanner(GRID), odds(np.inf)).subgoal(ORIGIN, AHEAD) is None


def test_it_goes_round_a_wall():
    place = seen(LocalPlanner(GRID), wall_ahead()).subgoal(ORIGIN, AHEAD)
    assert abs(np.arctan2(place[1], place[0])) > np.deg2rad(35)
    assert np.hypot(*place) <= LocalPlannerConfig().reach + 0.5


def test_a_dead_end_is_left_backwards():
    bearings = np.abs(GRID.bearings)
    trap = odds(np.where(bearings < np.deg2rad(130), 2.5, np.inf))
    place = seen(LocalPlanner(GRID), trap).subgoal(ORIGIN, AHEAD)
    assert abs(np.arctan2(place[1], place[0])) > np.deg2rad(110)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_what_was_seen_keeps_its_place(yaw):
    local_planner = seen(LocalPlanner(GRID), wall_ahead(), yaw=yaw)
    ahead = np.array([np.cos(yaw), np.sin(yaw)])
    before = local_planner.subgoal(ORIGIN, 8.0 * ahead)
    # Far away and back, as long as it stays within the square.
    nothing = np.full((GRID.n_sectors, GRID.n_rings), np.nan, dtype=np.float32)
    for way in (-20.0, 0.0):
        seen(local_planner, nothing, 1, way * ahead)
    np.testing.assert_allclose(local_planner.subgoal(ORIGIN, 8.0 * ahead), before)
    for way in (-200.0, 0.0):
        seen(local_planner, nothing, 1, way * ahead)
    assert local_planner.subgoal(ORIGIN, 8.0 * ahead) is None


def test_near_cells_overrule_far_ones():
    local_planner = seen(LocalPlanner(GRID), wall_ahead(3.0, 2.0))
    seen(local_planner, odds(np.inf), 40, np.array([2.0, 0.0]))
    assert local_planner.subgoal(ORIGIN, AHEAD) is None  # Seen from near by, it was not there.


def test_what_was_seen_free_from_near_is_not_a_wall_from_afar():
    """From the bottom of a hollow the rim where the robot came from looks steep."""
    local_planner = LocalPlanner(GRID)
    for x in (4.0, 4.5, 5.0, 5.5):
        seen(local_planner, odds(np.inf), 20, np.array([x, 0.0]))
    seen(local_planner, wall_ahead(4.5, 1.0), 60, ORIGIN)
    assert local_planner.subgoal(ORIGIN, AHEAD) is None
    unknown = seen(LocalPlanner(GRID), wall_ahead(4.5, 1.0), 60, ORIGIN)
    assert unknown.subgoal(ORIGIN, AHEAD) is not None


def test_where_the_robot_has_been_it_can_go():
    local_planner = LocalPlanner(GRID)
    for x in np.arange(0.0, 8.0, 0.2):
        local_planner.evidence.mark(wall_ahead(0.9, 3.0), np.array([x, 0.0]), 0.0)
    behind = local_planner.subgoal(np.array([7.8, 0.0]), np.array([0.0, 0.0]))
    assert behind is None or abs(behind[1]) < 0.3


@pytest.mark.parametrize("aside", [0.01, 0.1, 0.19])
def test_a_wall_beside_the_body_stays_one(aside):
    """Wherever in its cell the robot is: only what lies under it is free."""
    local_planner = seen(LocalPlanner(GRID), wall_ahead(0.9, 0.9), 60)
    before = local_planner.evidence.values.copy()
    nothing = np.full((GRID.n_sectors, GRID.n_rings), np.nan, dtype=np.float32)
    here = np.array([0.8 + aside, 0.2 - aside])
    local_planner.evidence.mark(nothing, here, 0.0)
    cell, n = local_planner.config.cell, local_planner.config.cells
    i, j = np.meshgrid(np.arange(-3, 10), np.arange(-5, 6), indexing="ij")
    far = np.hypot((i + 0.5) * cell - here[0], (j + 0.5) * cell - here[1])
    driven = local_planner.evidence.values[i % n, j % n] <= -local_planner.config.certain
    under = RobotModel().width / 2 - 0.02
    standing = before[i % n, j % n] <= -local_planner.config.certain
    assert np.array_equal(driven[~standing], (far < under)[~standing])
    walls = (before[i % n, j % n] > local_planner.config.wall) & (far >= under)
    assert walls.sum() > 3
    assert (local_planner.evidence.values[i % n, j % n] > local_planner.config.wall)[walls].all()


def test_driven_ground_is_ground_like_any_other_in_the_end():
    """Dead reckoning drifts, and what it says that was driven comes to lie on what was not."""
    config = LocalPlannerConfig(trail=100)
    local_planner = seen(LocalPlanner(GRID, config), odds(np.inf), 3)
    nothing = np.full((GRID.n_sectors, GRID.n_rings), np.nan, dtype=np.float32)
    away, known = np.array([-3.0, 0.0]), []
    for _ in range(config.trail // config.mark_every + 1):
        known.append(local_planner.evidence.values[0, 0] <= -config.certain)
        local_planner.evidence.mark(nothing, away, 0.0)
    assert known[0]
    assert not known[-1]
    assert known == sorted(known, reverse=True)


def test_emptiness_that_nothing_hides_is_an_edge():
    brink = np.full((GRID.n_sectors, GRID.n_rings), CellState.TRAVERSABLE, dtype=np.uint8)
    front = np.abs(GRID.bearings) < np.deg2rad(60)
    brink[np.ix_(front, GRID.ring_edges[:-1] > 2.0)] = CellState.EMPTY
    place = seen(LocalPlanner(GRID), certain_log_odds(brink), 20).subgoal(
        ORIGIN, np.array([4.0, 0.0])
    )
    assert place is not None
    hidden = brink.copy()
    hidden[front, 4] = CellState.NON_TRAVERSABLE
    behind = seen(LocalPlanner(GRID), certain_log_odds(hidden), 20)
    assert behind.subgoal(np.array([4.0, 0.0]), np.array([3.2, 0.0])) is None


def test_a_goal_beyond_the_map_is_headed_for():
    local_planner = seen(LocalPlanner(GRID), wall_ahead())
    place = local_planner.subgoal(ORIGIN, np.array([500.0, 0.0]))
    assert place[0] > -2.0


@pytest.mark.parametrize("nowhere", [np.nan, np.inf])
def test_a_goal_that_is_no_place_is_refused(nowhere):
    with pytest.raises(ValueError, match="goal: expected finite places"):
        LocalPlanner(GRID).subgoal(ORIGIN, np.array([nowhere, 0.0]))


def test_a_fence_keeps_the_way_inside():
    """The geofence is given in the map, and odom is turned and shifted against it."""
    turn = 0.5
    c, s = np.cos(turn), np.sin(turn)
    local_planner = LocalPlanner(GRID)
    view = ControllerInput(
        stamp=0.0,
        scan=VirtualScan(np.full(GRID.n_sectors, np.inf, dtype=np.float32), GRID.outer_radius),
        heading_error=-turn,
        goal_distance=8.0,
        previous_steering=(0.0, 0.0),
        pose=Pose.from_euler(np.array([10.0, 20.0, 0.0]), 0.0, 0.0, turn),
        odometry=Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0),
        goal=np.array([18.0, 20.0]),
        truth=None,
        geofence=(0.0, 18.0, 40.0, 40.0),
    )
    local_planner.guide(view)
    x, y = (np.mgrid[:256, :256] + 0.5) * local_planner.config.cell + local_planner.plan.corner[
        :, None, None
    ]
    there = 10.0 + c * x - s * y, 20.0 + s * x + c * y
    inside = (there[0] > 0) & (there[0] < 40) & (there[1] > 18) & (there[1] < 40)
    np.testing.assert_array_equal(local_planner.plan.gaps > 0, inside)


def test_its_cells_are_a_power_of_two():
    with pytest.raises(ValueError, match="expected a power of 2, got 100"):
        LocalPlannerConfig(cells=100)


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


def test_a_robot_with_a_map_leaves_a_dead_end_and_one_without_does_not():
    world = dead_end()
    scene = Scene(world, RayScene(world))
    sensing = SensingConfig(scanner="horizontal", proprioception=None)
    config = SimulatedRobotConfig(plant="kinematic", sensing=sensing, localizer="truth")
    outcomes = {}
    for guided in (False, True):
        driver = ReactiveController(config.robot, config.grid)
        if guided:
            driver = GuidedController(driver, LocalPlanner(config.grid, config.local_planner))
        simulated_robot = SimulatedRobot(scene, config, None, driver)
        (attempt,) = run_trial(
            simulated_robot, world.tasks[0], TerminationConfig(), np.random.default_rng(1)
        )
        outcomes[guided] = attempt.outcome
        simulated_robot.close()
    assert outcomes[True] is Outcome.GOAL
    assert outcomes[False] is not Outcome.GOAL


def test_emptiness_is_no_edge_where_the_robot_has_been():
    """Ground under the laser is never seen, and would turn the driven trail into a doubtful one."""
    local_planner = seen(LocalPlanner(GRID), odds(np.inf))
    nothing = np.full((GRID.n_sectors, GRID.n_rings), np.nan, dtype=np.float32)
    seen(local_planner, nothing, 12, np.array([1.0, 0.0]))
    local_planner.subgoal(np.array([1.0, 0.0]), AHEAD)
    plan = local_planner.plan
    i, j = ((ORIGIN - plan.corner) / local_planner.config.cell).astype(int)
    assert plan.costs[i, j] == 1.0


def test_what_is_hardly_red_is_dear_and_no_wall():
    """A red cell that is as likely green moves the evidence to its share of certainty."""
    config = LocalPlannerConfig()
    red = wall_ahead(2.0)
    sure = seen(LocalPlanner(GRID), red, 60)
    hardly = seen(LocalPlanner(GRID), np.where(red > 0, 0.2 * config.surely_red, red), 60)
    i, j = (int(2.1 / config.cell), 0)
    weight = 1 / (1 + np.hypot(i, j) * config.cell / config.fade)
    assert sure.evidence.values[i, j] == pytest.approx(config.certain * weight, rel=1e-3)
    assert hardly.evidence.values[i, j] == pytest.approx(0.2 * sure.evidence.values[i, j], rel=1e-3)
    assert sure.subgoal(ORIGIN, AHEAD) is not None
    costs = []
    for local_planner in (sure, hardly):
        local_planner.subgoal(ORIGIN, AHEAD)
        place = ((np.array([2.1, 0.1]) - local_planner.plan.corner) / config.cell).astype(int)
        costs.append(
            (local_planner.plan.gaps[tuple(place)], local_planner.plan.costs[tuple(place)])
        )
    (wall, dear), (free, less) = costs
    assert (wall, free > 0) == (0, True)
    assert 1.0 < less < dear


def test_there_is_room_where_the_robot_came_through():
    """Walls that cells of the scan make too thick do not close the way back."""
    local_planner = LocalPlanner(GRID)
    for x in np.arange(0.0, 4.0, 0.1):
        local_planner.evidence.mark(odds(0.7), np.array([x, 0.0]), 0.0)
    local_planner.subgoal(np.array([3.9, 0.0]), ORIGIN)
    plan, robot = local_planner.plan, RobotModel()
    middle, beside = (
        tuple(((np.array([2.0, y]) - plan.corner) / local_planner.config.cell).astype(int))
        for y in (0.0, 0.45)
    )
    assert plan.rooms[middle] * local_planner.config.cell > robot.half_radius
    assert plan.rooms[middle] > plan.gaps[middle] > 0.0
    assert plan.rooms[beside] == plan.gaps[beside] == 0.0
