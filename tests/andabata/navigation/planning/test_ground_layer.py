"""Squares in the local map: finer than the cells of scans, remembered, and never over a trail."""

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.models import shipped_ground_classifier
from andabata.navigation.controller import ControllerInput, SweepWindow
from andabata.navigation.planning.ground_layer import GroundLayer, GroundLayerConfig
from andabata.navigation.planning.local_planner import LocalPlanner, LocalPlannerConfig
from traversability.cartesian.elevation_grid import ElevationGrid
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid
from traversability.virtual_scan import VirtualScan

GRID = PolarGrid()
ORIGIN = np.zeros(2)
GOAL = np.array([8.0, 0.0])


def ground(rng, noise=0.006):
    """Return points of level ground around the origin, float32, shape (n, 3)."""
    x, y = rng.uniform(-5.5, 5.5, (2, 60_000))
    return np.stack([x, y, rng.normal(0, noise, len(x))], axis=1).astype(np.float32)


def trunk(x, y, rng):
    """Return points of an upright trunk, float32, shape (n, 3)."""
    turn, z = rng.uniform(0, 2 * np.pi, 1500), rng.uniform(0, 1.5, 1500)
    return np.stack([x + 0.1 * np.cos(turn), y + 0.1 * np.sin(turn), z], 1).astype(np.float32)


def view_of(points, red=()):
    """Return the view of a robot at the origin whose scan calls some (sector, ring) red."""
    cloud = None if points is None else PointCloud(points, "odom", np.zeros(len(points)))
    recent = None if cloud is None else SweepWindow((cloud,), 0.0)
    odds = np.full((GRID.n_sectors, GRID.n_rings), -6.0, dtype=np.float32)
    for cell in red:
        odds[cell] = 6.0
    ranges = np.full(GRID.n_sectors, np.inf, dtype=np.float32)
    pose = Pose.from_euler(np.zeros(3), 0.0, 0.0, 0.0)
    scan = VirtualScan(ranges, GRID.outer_radius, odds)
    return ControllerInput(0.0, scan, 0.0, 8.0, (0.0, 0.0), pose, pose, GOAL, None, recent=recent)


def evidence_at(local_planner, x, y):
    """Return the evidence of the cell at a place [m]."""
    i, j = np.floor(np.array([x, y]) / local_planner.config.cell).astype(int)
    return float(local_planner.evidence.values[i, j])


def cells_around(x, y):
    """Return sector and ring of the polar cell at a place of the robot's frame [m]."""
    sector = int((np.arctan2(y, x) + np.pi) / (2 * np.pi) * GRID.n_sectors)
    return sector, int(np.searchsorted(GRID.ring_edges, np.hypot(x, y), side="right") - 1)


def test_a_gap_between_trunks_is_open_whose_polar_cells_are_red():
    rng = np.random.default_rng(0)
    places = [(3.1, 0.7), (3.1, -0.7)]
    cloud = np.concatenate([ground(rng), *(trunk(*p, rng) for p in places)])
    red = [cells_around(x, y + side) for x, y in places for side in (-0.3, 0.0, 0.3)]
    fine, coarse = (
        LocalPlanner(GRID, ground_classifier=shipped_ground_classifier()),
        LocalPlanner(GRID),
    )
    for local_planner in (fine, coarse):
        for _ in range(30):
            local_planner.guide(view_of(cloud, red))
    for x, y in places:
        assert evidence_at(fine, x, y) > fine.config.wall
    assert evidence_at(fine, 3.1, 0.05) < 0
    assert evidence_at(coarse, 3.1, 0.3) > coarse.config.wall
    rooms = []
    for local_planner in (fine, coarse):
        local_planner.subgoal(ORIGIN, GOAL)
        i, j = np.floor((np.array([3.1, 0.0]) - local_planner.plan.corner) / 0.2).astype(int)
        rooms.append(0.2 * float(local_planner.plan.gaps[i, j]))
    assert rooms[0] >= 0.4 - 1e-6  # The body is 0.54 m wide, the gap 1.2 m.
    assert rooms[1] < 0.3


def test_where_no_cloud_has_points_the_scan_decides():
    rng = np.random.default_rng(1)
    points = ground(rng)
    hole = np.hypot(points[:, 0] - 3.1, points[:, 1]) > 0.8
    local_planner = LocalPlanner(GRID, ground_classifier=shipped_ground_classifier())
    for _ in range(30):
        local_planner.guide(view_of(points[hole], [cells_around(3.1, 0.05)]))
    assert evidence_at(local_planner, 3.1, 0.05) > local_planner.config.wall


def tiles_of(points):
    """Return the tiles of a cloud around the origin."""
    tiles = ElevationGrid()
    tiles.describe(points, ORIGIN)
    return tiles


def test_squares_are_remembered_up_to_a_limit_and_what_is_sure_overrides_them():
    rng, config = np.random.default_rng(2), GroundLayerConfig()
    plain, blocked = ground(rng), np.concatenate([ground(rng), trunk(2.1, 0.1, rng)])
    squares = GroundLayer(256, shipped_ground_classifier(), config)
    for _ in range(6):
        squares.take(tiles_of(plain), ORIGIN)
    assert np.abs(squares.odds).max() <= config.most
    assert squares.odds[10, 0] == -config.most
    squares.take(tiles_of(blocked), ORIGIN)
    assert squares.odds[10, 0] > 2.0
    squares.take(tiles_of(np.empty((0, 3), dtype=np.float32)), ORIGIN)
    assert squares.odds[10, 0] > 2.0  # Nothing seen, nothing forgotten.


def test_what_a_miss_costs_moves_the_odds_by_its_logarithm_as_far_as_the_robot_meets_things():
    rng = np.random.default_rng(3)
    tiles = tiles_of(ground(rng, noise=0.02))
    odds = []
    for miss in (1.0, 5.0):
        config = GroundLayerConfig(miss=miss, near=3.0, most=50.0)
        squares = GroundLayer(256, shipped_ground_classifier(), config)
        squares.take(tiles, ORIGIN)
        odds.append(squares.odds.copy())
    middles = 0.2 * ((np.arange(256) + 128) % 256 - 128) + 0.1
    ranges = np.hypot(middles[:, None], middles[None, :])
    seen, change = odds[0] != 0, odds[1] - odds[0]
    assert change[seen & (ranges < 2.99)] == pytest.approx(np.log(5.0), abs=1e-5)
    assert change[seen & (ranges > 3.01)] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize(("ahead", "is_wall"), [(4.1, True), (8.1, False)])
def test_red_cells_of_the_scan_close_no_way_where_squares_tell_more(ahead, is_wall):
    """From 5 m on a polar cell is a metre long and wide: a trunk in it says nothing of the rest."""
    sector, ring = cells_around(ahead, 0.05)
    red = [(sector + side, ring) for side in (-1, 0, 1)]
    cloud = np.float32([[-9.5, 0.0, 0.0]])  # Behind the robot, far away.
    walled = []
    for squares, seen in (
        (shipped_ground_classifier(), cloud),
        (shipped_ground_classifier(), None),
        (None, cloud),
    ):
        local_planner = LocalPlanner(GRID, ground_classifier=squares)
        for _ in range(60):
            local_planner.guide(view_of(seen, red))
        walled.append(evidence_at(local_planner, ahead, 0.05) > 0)
    assert walled == [is_wall, True, True]


def test_it_forgets_what_lies_behind():
    squares = GroundLayer(256, shipped_ground_classifier(), GroundLayerConfig())
    squares.take(tiles_of(ground(np.random.default_rng(4))), ORIGIN)
    assert squares.odds.any()
    squares.follow(np.array([20.0, 0.0]))
    assert squares.odds.any()
    squares.follow(np.array([60.0, 0.0]))
    assert not squares.odds.any()


def test_where_the_robot_stands_there_is_no_wall_and_reset_forgets():
    rng = np.random.default_rng(5)
    local_planner = LocalPlanner(GRID, ground_classifier=shipped_ground_classifier())
    cloud = np.concatenate([ground(rng), trunk(0.75, 0.0, rng)])
    first = view_of(cloud)
    for _ in range(10):
        local_planner.guide(first)
    assert evidence_at(local_planner, 0.1, 0.1) <= -local_planner.config.certain
    once = local_planner.evidence.values.copy()
    local_planner.reset()
    assert not local_planner.evidence.values.any()
    for _ in range(10):
        local_planner.guide(first)
    assert np.array_equal(local_planner.evidence.values, once)


def test_squares_of_another_size_are_refused():
    with pytest.raises(ValueError, match=r"local_planner.cell: expected 0.2 m.* got 0.25 m"):
        LocalPlanner(
            GRID, LocalPlannerConfig(cell=0.25), ground_classifier=shipped_ground_classifier()
        )


def test_only_what_was_measured_when_asked_for_is_judged_and_as_in_the_whole_cloud():
    """Half of the ground was measured a second before the other half."""
    rng = np.random.default_rng(6)
    points = np.concatenate([ground(rng), trunk(2.1, 0.1, rng), trunk(-2.1, 0.1, rng)])
    ages = np.where(points[:, 0] < 0.4, np.float32(1.5), np.float32(0.5))
    tiles = ElevationGrid()
    tiles.describe(points, ORIGIN, ages)
    whole, parts = (
        GroundLayer(256, shipped_ground_classifier(), GroundLayerConfig()) for _ in range(2)
    )
    whole.take(tiles, ORIGIN)
    parts.take(tiles, ORIGIN, (1.0, 2.0))
    middles = 0.2 * ((np.arange(256) + 128) % 256 - 128) + 0.1
    assert not parts.odds[middles > 0.4].any()
    assert parts.odds[middles < 0.4].any()
    parts.take(tiles, ORIGIN, (0.0, 1.0))
    assert np.array_equal(parts.odds, whole.odds)
