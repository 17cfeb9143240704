"""Occupancy grid: known log odds of scans, layers and driven ground; ranges that end at them."""

from types import SimpleNamespace

import numpy as np
import pytest

from andabata.machine.robot import RobotModel
from andabata.navigation.planning.low_obstacle_layer import LowObstacleLayerConfig
from andabata.navigation.planning.occupancy_config import OccupancyGridConfig
from andabata.navigation.planning.occupancy_grid import OccupancyGrid
from tests.support.situations import GRID, ORIGIN, between, nothing_seen, odds_of
from traversability.grid import PolarGrid

CONFIG = OccupancyGridConfig()
WIDTH = RobotModel().width


def make(**settings):
    """Return an empty grid."""
    return OccupancyGrid(GRID, OccupancyGridConfig(**settings), WIDTH)


def at(grid, x, y):
    """Return the log odds at a place of odom [m]."""
    i, j = np.floor(np.array([x, y]) / grid.config.cell).astype(int)
    return float(grid.log_odds[i % grid.config.cells, j % grid.config.cells])


def updated(grid, odds, times=1, position=ORIGIN, yaw=0.0, layers=None):
    """Return a grid after some scans from one place."""
    for _ in range(times):
        grid.update(odds, np.asarray(position, dtype=float), yaw, layers)
    return grid


def weight(i, j):
    """Return the weight of a scan at a cell's offset from the robot's."""
    return 1.0 / (1.0 + 0.2 * np.hypot(i, j) / 3.0)


def test_one_scan_moves_the_log_odds_by_a_known_share():
    """Blocked and free cells go their gain, times the weight, of the way to their certainty."""
    near = weight(10, 0)
    blocked = updated(make(), np.full_like(nothing_seen(), np.inf))
    assert at(blocked, 2.1, 0.1) == pytest.approx(0.4 * near * 3.0 * near, rel=1e-5)
    free = updated(make(), np.full_like(nothing_seen(), -np.inf))
    assert at(free, 2.1, 0.1) == pytest.approx(-0.05 * near * 3.0 * near, rel=1e-5)
    likely = updated(make(), np.full_like(nothing_seen(), 0.9))
    assert at(likely, 2.1, 0.1) == pytest.approx(0.4 * near * 3.0 * near * 0.25, rel=1e-5)
    probably = updated(make(), np.full_like(nothing_seen(), -0.5))
    assert at(probably, 2.1, 0.1) == pytest.approx(-0.05 * near * 3.0 * near * 0.25, rel=1e-5)
    empty = updated(make(), nothing_seen())
    assert at(empty, 2.1, 0.1) == pytest.approx(0.3, rel=1e-5)


def test_where_ground_falls_away_two_seconds_make_an_obstacle():
    """Four scans of empty cells that nothing hides, two a second, and not two: may be chance."""
    lethal = make().config.lethal_log_odds
    assert at(updated(make(), nothing_seen(), 4), 2.1, 0.1) > lethal
    assert at(updated(make(), nothing_seen(), 2), 2.1, 0.1) < lethal


def test_many_scans_reach_the_certainty_of_their_range():
    """The limit falls with the range: far cells are large."""
    for sign, odds in ((1.0, np.inf), (-1.0, -np.inf)):
        grid = updated(make(), np.full_like(nothing_seen(), odds), 400)
        for i in (5, 20, 40):
            expected = sign * 3.0 * weight(i, 0)
            assert at(grid, 0.2 * i + 0.1, 0.1) == pytest.approx(expected, rel=0.01)


def test_a_scan_never_takes_back_what_it_confirms():
    """A free scan from afar does not raise freer ground, nor a blocked one lower an obstacle."""
    free = updated(make(), np.full_like(nothing_seen(), -np.inf), 400)
    before = at(free, 2.1, 0.1)
    updated(free, np.full_like(nothing_seen(), -0.2), 20)
    assert at(free, 2.1, 0.1) == before
    blocked = updated(make(), np.full_like(nothing_seen(), np.inf), 400)
    before = at(blocked, 2.1, 0.1)
    updated(blocked, np.full_like(nothing_seen(), 0.1), 20)
    assert at(blocked, 2.1, 0.1) == before


@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.6])
@pytest.mark.parametrize("position", [(0.0, 0.0), (-7.3, 41.1)])
def test_obstacles_lie_where_the_scan_saw_them(position, yaw):
    """A wall to the front left stays there in odom, wherever the robot stands and faces."""
    grid = updated(make(), odds_of(between(20, 70, 2.0)), 20, position, yaw)
    places = (
        np.array(position)[:, None]
        + 2.15
        * np.array(
            [[np.cos(yaw + b), np.sin(yaw + b)] for b in (np.pi / 4, -np.pi / 4, 3 * np.pi / 4)]
        ).T
    )
    left, right, behind = (at(grid, *place) for place in places.T)
    assert left > CONFIG.lethal_log_odds
    assert right < 0
    assert behind < 0


def test_a_grid_cell_is_free_when_its_middle_is_and_no_corner_is_blocked():
    """A corner in a blocked polar cell keeps the log odds as they are, and nothing else does."""
    odds = odds_of(between(20, 70, 2.0))
    odds[~(odds > 0)] = -np.inf
    grid = updated(make(), odds, 20)
    i, j = np.mgrid[-60:61, -60:61]
    x = 0.2 * i + 0.1 * np.array([0, 1, 1, -1, -1])[:, None, None]
    y = 0.2 * j + 0.1 * np.array([0, 1, -1, 1, -1])[:, None, None]
    sectors = (np.arctan2(y, x) + np.pi) / (2 * np.pi) * GRID.n_sectors
    rings = np.searchsorted(GRID.ring_edges, np.hypot(x, y), side="right") - 1
    inside = (rings >= 0) & (rings < GRID.n_rings)
    seen = odds[sectors.astype(int) % GRID.n_sectors, np.clip(rings, 0, GRID.n_rings - 1)]
    blocked = inside & (seen > 0)
    # Corners on the edge of a sector belong to either, by rounding.
    certain = (np.abs(sectors - np.round(sectors)) > 1e-4).all(axis=0) & inside[0]
    touching = certain & blocked[1:].any(axis=0) & ~blocked[0]
    free = certain & ~blocked.any(axis=0) & (np.maximum(np.abs(i), np.abs(j)) > 2)
    assert touching.sum() > 10
    assert free.sum() > 1000
    found = grid.log_odds[i % 256, j % 256]
    assert (found[touching] == 0).all()
    assert (found[free] < 0).all()
    assert (found[certain & blocked[0]] > 0).all()


def test_emptiness_counts_near_the_robot_and_in_front_of_obstacles_alone():
    """Beyond the unknown range, or behind a blocked cell, an empty cell shows nothing."""
    odds = nothing_seen()
    odds[12:20, 3] = np.inf
    grid = updated(make(), odds, 5)
    assert at(grid, 1.0, 0.1) > 0
    assert at(grid, 3.5, 0.1) == 0.0  # Behind the obstacle.
    assert at(grid, -3.5, 0.1) > 0
    assert at(grid, -4.3, 0.1) == 0.0  # Too far.
    many = updated(make(), nothing_seen(), 100)
    assert at(many, -3.5, 0.1) == pytest.approx(3.0 * weight(-18, 0), rel=1e-5)


def test_what_was_seen_free_from_near_is_not_blocked_from_afar():
    """A far blocked cell counts only where nearer scans did not show free ground."""
    grid = updated(make(), odds_of(np.inf), 200)
    before = at(grid, 2.1, 0.1)
    assert before <= -3.0 * weight(30, 0)
    updated(grid, np.full_like(nothing_seen(), np.inf), 10, (-4.0, 0.0))
    assert at(grid, 2.1, 0.1) == before
    assert at(updated(make(), np.full_like(nothing_seen(), np.inf), 10, (-4.0, 0.0)), 2.1, 0.1) > 0


def test_driven_ground_is_free_the_more_the_nearer_the_robots_middle_was():
    """Minus the largest log odds at the body's side to twice that under its middle."""
    here = np.array([0.13, 0.04])
    grid = updated(make(), np.full_like(nothing_seen(), np.inf), 3, here)
    i, j = np.mgrid[-3:4, -3:4]
    far = np.hypot((i + 0.5) * 0.2 - here[0], (j + 0.5) * 0.2 - here[1])
    radius = WIDTH / 2 - 0.02
    assert grid.driven_radius == pytest.approx(radius)
    expected = -3.0 * (2.0 - far / radius)
    driven = far < radius
    assert driven.sum() > 3
    found = grid.log_odds[i % 256, j % 256]
    np.testing.assert_allclose(found[driven], expected[driven], rtol=1e-5)
    assert (found[~driven] > -3.0).all()
    # A little later the nearer of both passages counts, the first one less its decay.
    there = np.hypot((i + 0.5) * 0.2 - here[0] - 0.1, (j + 0.5) * 0.2 - here[1])
    updated(grid, np.full_like(nothing_seen(), np.inf), 1, here + np.array([0.1, 0.0]))
    first = np.where(driven, expected + 3.0 * 5 / 600, np.inf)
    second = np.where(there < radius, -3.0 * (2.0 - there / radius), np.inf)
    nearer, either = np.minimum(first, second), driven | (there < radius)
    np.testing.assert_allclose(grid.log_odds[i % 256, j % 256][either], nearer[either], rtol=1e-5)


@pytest.mark.parametrize("aside", [0.01, 0.1, 0.19])
def test_an_obstacle_beside_the_body_stays_one(aside):
    """Only what lies under the body is free, wherever in its cell the robot is."""
    bearings = GRID.bearings
    reach = np.where(np.cos(bearings) > 0.05, 0.9 / np.maximum(np.cos(bearings), 0.05), np.inf)
    hit = (np.abs(reach * np.sin(bearings)) < 0.9) & (reach < 10)
    grid = updated(make(), odds_of(np.where(hit, reach, np.inf)), 60)
    before = grid.log_odds.copy()
    here = np.array([0.8 + aside, 0.2 - aside])
    updated(grid, nothing_seen(), 1, here)
    i, j = np.meshgrid(np.arange(-3, 10), np.arange(-5, 6), indexing="ij")
    far = np.hypot((i + 0.5) * 0.2 - here[0], (j + 0.5) * 0.2 - here[1])
    driven = grid.log_odds[i % 256, j % 256] <= -CONFIG.max_log_odds
    under = WIDTH / 2 - 0.02
    standing = before[i % 256, j % 256] <= -CONFIG.max_log_odds
    assert np.array_equal(driven[~standing], (far < under)[~standing])
    walls = (before[i % 256, j % 256] > CONFIG.lethal_log_odds) & (far >= under)
    assert walls.sum() > 3
    assert (grid.log_odds[i % 256, j % 256] > CONFIG.lethal_log_odds)[walls].all()


def test_driven_ground_is_ground_like_any_other_in_the_end():
    """Dead reckoning drifts: after the driven memory the log odds are those of free ground."""
    grid = updated(make(driven_memory=100), odds_of(np.inf), 3)
    known = []
    for _ in range(100 // CONFIG.update_every + 1):
        known.append(at(grid, 0.1, 0.1))
        updated(grid, nothing_seen(), 1, (-3.0, 0.0))
    driven = [value <= -CONFIG.max_log_odds for value in known]
    assert driven[0]
    assert not driven[-1]
    assert driven == sorted(driven, reverse=True)
    np.testing.assert_allclose(np.diff(known[:5]), 3.0 * 5 / 100, rtol=1e-4)


def test_the_grid_follows_the_robot_and_forgets_what_it_leaves_behind():
    """What stays within the square is remembered, the rest is unknown again; so is all by reset."""
    grid = updated(make(), odds_of(between(20, 70, 2.0)), 20)
    before = at(grid, 1.6, 1.6)
    assert before > 1.0
    updated(grid, nothing_seen(), 1, (-20.0, 0.0))
    np.testing.assert_array_equal(grid.centre, [-100, 0])
    assert at(grid, 1.6, 1.6) == before
    updated(grid, nothing_seen(), 1, (-40.0, 0.0))
    updated(grid, nothing_seen(), 1, (0.0, 0.0))
    assert at(grid, 1.6, 1.6) == pytest.approx(0.3)  # The last scan alone.
    grid.reset()
    assert not grid.log_odds.any()
    np.testing.assert_array_equal(grid.centre, [0, 0])


def layers(ground=None, heights=None, max_log_odds=6.0, is_measured=True):
    """Return layers of given log odds and heights, in dictionaries by cell."""
    made = SimpleNamespace(is_measured=is_measured, ground=None, movers=None)
    if ground is not None:
        log_odds = np.zeros((256, 256), dtype=np.float32)
        for cell, value in ground.items():
            log_odds[cell] = value
        made.ground = SimpleNamespace(
            log_odds=log_odds, max_log_odds=max_log_odds, follow=lambda position: None
        )
    low = np.zeros((256, 256), dtype=np.float32)
    for cell, height in (heights or {}).items():
        low[cell] = height
    made.low_obstacles = SimpleNamespace(
        heights=low, centre=np.zeros(2, dtype=np.int64), config=LowObstacleLayerConfig()
    )
    return made


def test_the_ground_layer_overwrites_scans_but_not_driven_ground():
    """Its log odds are scaled to the grid's and free ones bounded; cells it never saw stay."""
    ground = {(10, 0): 3.0, (11, 0): -2.0, (12, 0): -6.0, (0, 0): 6.0, (14, 0): 9.0}
    grid = updated(make(), np.full_like(nothing_seen(), np.inf), 50, layers=layers(ground))
    assert grid.log_odds[10, 0] == pytest.approx(1.5)
    assert grid.log_odds[11, 0] == pytest.approx(-1.0)
    assert grid.log_odds[12, 0] == pytest.approx(-0.7 * 3.0)
    assert grid.log_odds[14, 0] == pytest.approx(3.0)
    assert grid.log_odds[0, 0] <= -3.0
    assert grid.log_odds[13, 0] > 1.5


@pytest.mark.parametrize(
    ("ahead", "has_ground", "is_measured", "counts"),
    [
        (4.9, True, True, True),
        (5.3, True, True, False),
        (5.3, True, False, True),
        (5.3, False, True, True),
    ],
)
def test_far_blocked_polar_cells_count_without_ground_cells_alone(
    ahead, has_ground, is_measured, counts
):
    """Beyond the blocked range a polar cell is too large, where ground cells show more."""
    given = layers({} if has_ground else None, is_measured=is_measured)
    grid = updated(make(), np.full_like(nothing_seen(), np.inf), 5, layers=given)
    assert (at(grid, ahead, 0.1) > 0) == counts


def test_what_movers_have_left_is_no_obstacle_but_low_obstacles_stay():
    """Whatever scans and ground cells still say of the place; beside it nothing changes."""
    given = layers({(10, 0): 3.0, (11, 0): 3.0, (12, 0): 3.0}, heights={(25, 0): 0.03})
    given.movers = SimpleNamespace(transient_places=np.array([(2.1, 0.1), (2.5, 0.1)]))
    grid = updated(make(), np.full_like(nothing_seen(), np.inf), 5, layers=given)
    assert grid.log_odds[10, 0] == 0.0
    assert grid.log_odds[11, 0] == pytest.approx(1.5)
    assert grid.log_odds[12, 0] > CONFIG.lethal_log_odds


def test_low_obstacles_are_raised_in_their_cell_and_beside():
    """Log odds in proportion to the height, lethal from the least height on, at most the largest.

    A half cell counts for the cell that it lies in and for those that it touches.
    """
    gain = CONFIG.lethal_log_odds / LowObstacleLayerConfig().min_height
    grid = updated(make(), odds_of(np.inf), 1, layers=layers(heights={(21, 0): 0.03}))
    assert grid.log_odds[10, 0] == pytest.approx(gain * 0.03, rel=1e-5)
    assert grid.log_odds[11, 0] == pytest.approx(gain * 0.03, rel=1e-5)
    assert grid.log_odds[10, -1] == pytest.approx(gain * 0.03, rel=1e-5)
    assert grid.log_odds[11, -1] == pytest.approx(gain * 0.03, rel=1e-5)
    for cell in ((9, 0), (12, 0), (10, 1), (10, -2)):
        assert grid.log_odds[cell] < 0
    high = updated(make(), odds_of(np.inf), 1, layers=layers(heights={(20, 0): 0.2}))
    assert high.log_odds[10, 0] == 3.0
    assert high.log_odds[9, 0] == 3.0
    assert high.log_odds[11, 0] < 0


def test_low_obstacles_on_driven_or_surely_free_ground_are_none():
    """Where the robot has been, and where ground cells are surely free, nothing is raised."""
    low = {(20, 0): 0.05, (0, 0): 0.05}
    for free, is_raised in ((-2.1, False), (-1.9, True)):
        given = layers({(10, 0): free, (10, -1): free}, low)
        grid = updated(make(), odds_of(np.inf), 1, layers=given)
        assert (grid.log_odds[10, 0] > 1.0) == is_raised
        assert grid.log_odds[9, 0] > 1.0
        assert grid.log_odds[0, 0] <= -3.0


def test_a_higher_log_odds_is_not_lowered_by_a_low_obstacle():
    """A wall stays a wall though a low obstacle stands before it."""
    given = layers({(10, 0): 5.0}, {(20, 0): 0.02})
    grid = updated(make(), odds_of(np.inf), 1, layers=given)
    assert grid.log_odds[10, 0] == pytest.approx(2.5)


@pytest.mark.parametrize("place", [(3.3, -5.2), (-120.0, 75.0)])
@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.9])
def test_ranges_end_at_remembered_obstacles_on_their_own_side(yaw, place):
    """An obstacle to the left ends the left sectors' ranges, and no other's."""
    grid, position = make(), np.array(place)
    grid.update(nothing_seen(), position, yaw)
    left = position + 2.0 * np.array([np.cos(yaw + 0.8), np.sin(yaw + 0.8)])
    i, j = np.floor(left / 0.2).astype(int)
    grid.log_odds[i % 256, j % 256] = 1.5
    ranges = np.full(GRID.n_sectors, np.inf, dtype=np.float32)
    found = grid.end_ranges(ranges, position, yaw, 5.0)
    ended = np.isfinite(found)
    np.testing.assert_allclose(found[ended], 2.0, atol=0.2)
    assert 1 <= ended.sum() <= 3
    assert (np.abs(GRID.bearings[ended] - 0.8) < 0.25).all()
    assert np.isinf(ranges).all()  # The given ranges stay as they are.


def test_ranges_end_only_between_body_and_reach():
    """Obstacles under the body and beyond the reach do not count; nearer ranges stay."""
    grid = make()
    grid.log_odds[1, :], grid.log_odds[20:, :] = 3.0, 3.0
    ranges = np.full(GRID.n_sectors, np.inf, dtype=np.float32)
    ahead = 16
    assert np.isinf(grid.end_ranges(ranges, ORIGIN, 0.0, 3.9)[ahead])
    found = grid.end_ranges(ranges, ORIGIN, 0.0, 5.0)[ahead]
    assert found == pytest.approx(4.0, abs=0.11)
    ranges[ahead], ranges[ahead - 1] = 2.0, np.nan
    found = grid.end_ranges(ranges, ORIGIN, 0.0, 5.0)
    assert found[ahead] == 2.0
    assert found[ahead - 1] == pytest.approx(4.0, abs=0.2)
    grid.log_odds[20:, :] = CONFIG.lethal_log_odds
    assert np.isnan(grid.end_ranges(ranges, ORIGIN, 0.0, 5.0)[ahead - 1])


def test_each_ray_of_a_sector_counts():
    """A thin obstacle at a sector's edge ends its range as one in its middle does."""
    ranges = np.full(GRID.n_sectors, np.inf, dtype=np.float32)
    for share in (-0.33, 0.0, 0.33):
        grid = make()
        bearing = GRID.bearings[20] + share * 2 * np.pi / GRID.n_sectors
        place = 4.0 * np.array([np.cos(bearing), np.sin(bearing)])
        grid.log_odds[tuple(np.floor(place / 0.2).astype(int))] = 3.0
        assert grid.end_ranges(ranges, ORIGIN, 0.0, 6.0)[20] == pytest.approx(4.0, abs=0.2)


def test_ranges_beyond_the_square_are_left_as_they_are():
    """A ray ends at the edge of the square, though memory wraps around."""
    grid = OccupancyGrid(PolarGrid(outer_radius=5.0), OccupancyGridConfig(cells=64), WIDTH)
    grid.log_odds[:] = 0.0
    grid.log_odds[-31:-20, :] = 3.0  # Behind the robot, 4 to 6 m.
    ranges = np.full(32, np.inf, dtype=np.float32)
    found = grid.end_ranges(ranges, ORIGIN, 0.0, 12.0)
    assert np.isinf(found[16])
    assert found[0] == pytest.approx(4.0, abs=0.2)


def test_its_cells_are_a_power_of_two():
    """Indices are wrapped around by their lowest bits."""
    with pytest.raises(ValueError, match="expected a power of 2, got 100"):
        OccupancyGridConfig(cells=100)
