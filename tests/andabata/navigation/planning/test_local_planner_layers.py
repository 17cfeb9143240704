"""Ground cells and low obstacles in the local planner, and when scans decide instead."""

import numpy as np
import pytest

from andabata.models import shipped_ground_classifier
from andabata.navigation.planning.ground_layer import GroundLayerConfig
from andabata.navigation.planning.local_planner import LocalPlanner
from tests.support.local_plans import AHEAD, OCCUPANCY, cell_of, scans
from tests.support.situations import (
    GRID,
    ORIGIN,
    StubAssembler,
    constant_classifier,
    layers_of,
    pose_at,
    scan_of,
    sector_of,
    situation,
)


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
