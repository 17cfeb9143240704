"""Low obstacles: small rocks stand out of the points of clouds, and nothing else does."""

import numpy as np
import pytest

from andabata.machine.pose import Pose
from andabata.navigation.controller import ControllerInput, SweepWindow
from andabata.navigation.planning.ground_layer import GroundLayerConfig
from andabata.navigation.planning.local_planner import LocalPlanner, LocalPlannerConfig
from andabata.navigation.planning.low_obstacle_layer import LowObstacleLayer, LowObstacleLayerConfig
from traversability.cartesian.classifier import GroundClassifier, Stage
from traversability.cartesian.context import CONTEXT_FEATURES
from traversability.cartesian.elevation_grid import ElevationGrid
from traversability.cartesian.features import GROUND_FEATURES
from traversability.cloud import PointCloud
from traversability.grid import PolarGrid
from traversability.trees import COLUMNS, Trees
from traversability.virtual_scan import VirtualScan

GRID = PolarGrid()
CELL = 0.1
ROCK = np.array([1.83, 0.41])


def ground(rng, slope=0.0, noise=0.005, spacing=0.04, half=4.0):
    """Return points of even ground around the origin, float32, shape (n, 3)."""
    n = round((2 * half / spacing) ** 2)
    x, y = rng.uniform(-half, half, (2, n))
    return np.stack([x, y, np.tan(slope) * x + rng.normal(0, noise, n)], axis=1).astype(np.float32)


def with_rock(points, place=ROCK, width=0.15, height=0.07):
    """Return the points with those over a square block raised by its height."""
    on = (np.abs(points[:, :2] - place) < width / 2).all(axis=1)
    return points + np.outer(on, [0, 0, height]).astype(np.float32)


def take(bumps, points, here):
    """Give a cloud to the bumps."""
    tiles = ElevationGrid(CELL)
    tiles.describe(points, here)
    bumps.take(tiles, here)


def found(bumps):
    """Return the middles of the cells that stand out [m], shape (k, 2)."""
    n = len(bumps.rises)
    i, j = np.nonzero(bumps.rises)
    places = np.stack([i, j], axis=1)
    wrapped = (places - bumps.centre + n // 2) % n - n // 2
    return (wrapped + bumps.centre + 0.5) * CELL


@pytest.mark.parametrize("slope", [0.0, 8.0, 15.0])
def test_even_ground_has_none(slope):
    bumps, rng = LowObstacleLayer(CELL, LowObstacleLayerConfig()), np.random.default_rng(0)
    for _ in range(5):
        take(bumps, ground(rng, np.deg2rad(slope), noise=0.01), np.zeros(2))
        assert not bumps.rises.any()


@pytest.mark.parametrize("slope", [0.0, 12.0])
@pytest.mark.parametrize("shift", [(0.0, 0.0), (-300.0, 57.3)])
def test_a_rock_of_seven_centimetres_is_one_wherever_odom_begins(slope, shift):
    bumps, rng = LowObstacleLayer(CELL, LowObstacleLayerConfig()), np.random.default_rng(1)
    for _ in range(3):
        cloud = with_rock(ground(rng, np.deg2rad(slope))).astype(np.float64)
        cloud[:, :2] += shift
        take(bumps, cloud.astype(np.float32), np.array(shift))
    places = found(bumps) - shift
    assert len(places) >= 2
    assert (np.abs(places - ROCK) < 0.15).all()
    assert 0.02 < bumps.rises.max() < 0.075


def test_a_stone_of_fifteen_millimetres_is_none():
    bumps, rng = LowObstacleLayer(CELL, LowObstacleLayerConfig()), np.random.default_rng(2)
    for _ in range(3):
        take(bumps, with_rock(ground(rng), height=0.015), np.zeros(2))
    assert not bumps.rises.any()


def test_few_points_of_many_clouds_tell_what_those_of_one_do_not():
    bumps, rng = LowObstacleLayer(CELL, LowObstacleLayerConfig()), np.random.default_rng(3)
    after = []
    for _ in range(8):
        take(bumps, with_rock(ground(rng, spacing=0.07)), np.zeros(2))
        after.append(len(found(bumps)))
    assert after[0] == 0
    assert after[-1] >= 1


def test_a_bump_that_one_cloud_does_not_show_is_not_forgotten_at_once():
    """Dead reckoning drifts, and smears it over its neighbours; in the end it is forgotten."""
    bumps, rng, left = (
        LowObstacleLayer(CELL, LowObstacleLayerConfig(memory=20.0)),
        np.random.default_rng(8),
        [],
    )
    take(bumps, with_rock(ground(rng)), np.zeros(2))
    first = bumps.rises.max()
    assert first > bumps._config.rise
    for _ in range(8):
        take(bumps, ground(rng), np.zeros(2))
        left.append(bumps.rises.max())
    assert 0.6 * first < left[0] < first
    assert left == sorted(left, reverse=True)
    assert left[-1] == 0.0


def test_rough_ground_is_no_rock():
    """In grass of that height nobody can tell."""
    bumps, rng = LowObstacleLayer(CELL, LowObstacleLayerConfig()), np.random.default_rng(4)
    for _ in range(5):
        take(bumps, ground(rng, noise=0.08), np.zeros(2))
    assert len(found(bumps)) < 0.01 * 80**2


def test_a_crown_is_no_bump_and_the_ground_under_it_is_seen():
    bumps, rng = LowObstacleLayer(CELL, LowObstacleLayerConfig()), np.random.default_rng(5)
    for _ in range(3):
        cloud = with_rock(ground(rng))
        crown = ground(rng)[::4] + np.float32([0, 0, 1.5])
        take(bumps, np.concatenate([cloud, crown]), np.zeros(2))
    places = found(bumps)
    assert len(places) >= 2
    assert (np.abs(places - ROCK) < 0.15).all()


def test_it_forgets_what_lies_behind():
    bumps, rng = LowObstacleLayer(CELL, LowObstacleLayerConfig()), np.random.default_rng(6)
    for _ in range(3):
        take(bumps, with_rock(ground(rng)), np.zeros(2))
    assert len(found(bumps))
    take(bumps, ground(rng)[:0], np.array([20.0, 0.0]))
    assert not bumps.rises.any()


def view_of(points, at=0.0, stamp=0.0):
    """Return the view of a robot on the x axis whose scan sees nothing but free ground."""
    cloud = None if points is None else PointCloud(points, "odom", np.full(len(points), stamp))
    recent = None if cloud is None else SweepWindow((cloud,), stamp)
    pose = Pose.from_euler(np.array([at, 0.0, 0.0]), 0.0, 0.0, 0.0)
    free = VirtualScan(np.full(GRID.n_sectors, np.inf, dtype=np.float32), GRID.outer_radius)
    goal = np.array([8.0, 0.0])
    return ControllerInput(
        0.0, free, 0.0, 8.0 - at, (0.0, 0.0), pose, pose, goal, None, recent=recent
    )


def test_the_map_goes_round_a_bump_that_scans_call_free():
    rng = np.random.default_rng(7)
    ahead = np.array([2.05, 0.05])
    even, rock = ([with_rock(ground(rng), ahead, height=h) for _ in range(3)] for h in (0.0, 0.07))
    gaps = []
    for clouds in (even, rock):
        local_planner = LocalPlanner(GRID)
        for look in range(30):
            local_planner.guide(view_of(clouds[look % 3], stamp=look))
        i, j = np.floor((ahead - local_planner.plan.corner) / local_planner.config.cell).astype(int)
        gaps.append(float(local_planner.plan.gaps[i, j]))
        straight = local_planner.subgoal(np.zeros(2), np.array([8.0, 0.0])) is None
        assert straight is (clouds is even)
    assert gaps[0] > 1
    assert gaps[1] == 0


def always(odds):
    """Return a classifier that takes every square for the same."""
    zeros = {name: np.zeros(1, dtype) for name, dtype in COLUMNS.items()}
    leaf = {**zeros, "feature": np.full(1, -1, np.int16)}
    looks = (
        Stage(Trees(("spread",), "logistic", odds, **leaf), names)
        for names in (GROUND_FEATURES, CONTEXT_FEATURES)
    )
    return GroundClassifier(*looks, 0.1)


@pytest.mark.parametrize(("odds", "is_wall"), [(-6.0, False), (-2.5, True)])
def test_bumps_in_squares_that_are_surely_free_are_none(odds, is_wall):
    """A miss counts four times, so that log odds of -2.5 are -1.1 to the map, and -6 are -4."""
    rng, ahead = np.random.default_rng(10), np.array([2.05, 0.05])
    clouds = [with_rock(ground(rng), ahead) for _ in range(3)]
    config = LocalPlannerConfig(squares=GroundLayerConfig(memory=0.0))
    local_planner = LocalPlanner(GRID, config, ground_classifier=always(odds))
    for look in range(15):
        local_planner.guide(view_of(clouds[look % 3], stamp=look))
    i, j = np.floor((ahead - local_planner.plan.corner) / local_planner.config.cell).astype(int)
    assert (local_planner.plan.gaps[i, j] == 0) == is_wall


def test_a_cloud_counts_once():
    rng = np.random.default_rng(8)
    cloud = with_rock(ground(rng, spacing=0.07))
    local_planner = LocalPlanner(GRID)
    for _ in range(50):
        local_planner.guide(view_of(cloud))
    assert local_planner.subgoal(np.zeros(2), ROCK * 2) is None


def test_where_the_robot_has_driven_there_is_no_wall():
    rng = np.random.default_rng(9)
    local_planner = LocalPlanner(GRID)
    for x in np.linspace(0.0, 4.0, 41):
        local_planner.guide(view_of(with_rock(ground(rng), np.array([2.0, 0.0])), x, stamp=x))
        local_planner.evidence.mark(view_of(None).scan.log_odds_of(GRID), np.array([x, 0.0]), 0.0)
    local_planner.subgoal(np.array([4.0, 0.0]), np.array([8.0, 0.0]))
    i, j = np.floor((np.array([2.0, 0.0]) - local_planner.plan.corner) / 0.2).astype(int)
    assert local_planner.plan.costs[i, j] == 1.0


def test_its_cells_are_a_power_of_two():
    with pytest.raises(ValueError, match="expected a power of 2, got 100"):
        LowObstacleLayerConfig(cells=100)
