"""Layers of the local map lie in one window, in the order of x and y."""

import numpy as np
import pytest

from andabata.navigation.planning.local_planner import LocalPlanner
from andabata.navigation.planning.map_layers import UNITS, map_layers, shifted, unwrapped
from tests.support.planned_drives import wall_ranges
from tests.support.situations import GRID, ORIGIN, StubAssembler, layers_of, odds_of
from traversability.cartesian.rolling_grid import RollingGrid

PLACES = (ORIGIN, np.array([-7.3, 40.1]), np.array([1000.0, -333.3]))


def index(found, place):
    """Return the cell of a place [m]."""
    return tuple(np.floor((np.asarray(place) - found.corner) / found.cell).astype(int))


@pytest.mark.parametrize("place", PLACES, ids=str)
def test_a_circular_grid_is_unrolled_around_the_robot(place):
    """Whatever the robot's place, a cell lies where its coordinates say."""
    grid = RollingGrid(0.5, 16, ("height",))
    grid.follow(place)
    mark = place + np.array([2.0, -3.0])
    grid["height"][tuple(grid.wrap(grid.cells_of(mark)))] = 7.0
    values = unwrapped(grid["height"], grid.centre)
    cell = np.floor((mark - grid.corner) / grid.cell).astype(int)
    assert values[tuple(cell)] == 7.0
    assert np.count_nonzero(values) == 1


def test_a_layer_of_another_window_keeps_its_places():
    """What overlaps is copied; the rest is unknown."""
    values = np.arange(16.0, dtype=np.float32).reshape(4, 4)
    found = shifted(values, np.array([10, 20]), np.array([11, 18]), 4)
    assert found[0, 2] == values[1, 0]
    assert found[2, 3] == values[3, 1]
    assert np.isnan(found[3]).all()
    assert np.isnan(found[:, :2]).all()
    assert np.isnan(shifted(values, np.array([10, 20]), np.array([50, 20]), 4)).all()


@pytest.mark.parametrize("place", PLACES, ids=str)
def test_the_map_shows_a_wall_where_it_stands(place):
    """The wall is an obstacle, ground before it is free, and beyond it nothing is known."""
    planner = LocalPlanner(GRID)
    for _ in range(12):
        planner.occupancy.update(odds_of(wall_ranges()), place, 0.0)
    planner.subgoal(place, place + np.array([8.0, 0.0]))
    found = map_layers(planner)
    assert set(found.layers) == set(UNITS)

    def around(name, ahead):
        """Return a layer's values within half a metre of a place ahead."""
        i, j = index(found, place + np.array([ahead, 0.1]))
        return found.layers[name][i - 2 : i + 3, j - 2 : j + 3]

    assert np.nanmax(around("occupancy", 3.3)) > found.lethal_occupancy
    assert np.nanmax(around("occupancy", 1.5)) < 0.5
    assert np.isnan(around("occupancy", 15.0)).all()
    assert around("cost", 3.3).max() > 10 * around("cost", 0.5).max()
    assert around("clearance", 3.3).min() == 0.0
    assert around("clearance", 1.0).min() > 0.8


def test_the_plan_keeps_its_places_when_the_grid_moves_on():
    """Costs and clearances of the last plan stay where they are; where it knew none is unknown."""
    planner = LocalPlanner(GRID)
    for _ in range(12):
        planner.occupancy.update(odds_of(wall_ranges()), ORIGIN, 0.0)
    planner.subgoal(ORIGIN, np.array([8.0, 0.0]))
    before = map_layers(planner)
    planner.occupancy.update(odds_of(np.inf), np.array([1.0, -0.6]), 0.0)
    after = map_layers(planner)
    assert not np.array_equal(before.corner, after.corner)
    for name in ("clearance", "cost"):
        old, new = before.layers[name], after.layers[name]
        for place in ((3.3, 0.1), (2.5, 1.1), (-4.0, 2.0)):
            assert new[index(after, place)] == old[index(before, place)]
        assert np.isnan(new[-1, -1])


def test_before_a_scan_nothing_is_known():
    """All layers are NaN without scans, plan and cloud."""
    assert all(np.isnan(values).all() for values in map_layers(LocalPlanner(GRID)).layers.values())


def test_the_elevation_is_the_ground_of_the_cloud():
    """Heights come from the points of their own cells; elsewhere the given one stands in."""
    planner = LocalPlanner(GRID)
    planner.occupancy.update(odds_of(np.inf), np.array([5.0, -5.0]), 0.0)
    points = np.array([[6.1, -5.1, 1.5], [6.15, -5.15, 1.6], [2.1, -1.1, -0.5]], dtype=np.float32)
    found = map_layers(planner, None, points)
    assert found.layers["elevation"][index(found, (6.1, -5.1))] == pytest.approx(1.55)
    assert np.count_nonzero(~np.isnan(found.layers["elevation"])) == 2
    places = np.array([[2.1, -1.1], [0.0, 0.0], [900.0, 0.0]])
    np.testing.assert_allclose(found.height_at(places, 9.0), [-0.5, 9.0, 9.0])


def test_a_low_obstacle_fills_the_cell_that_holds_it():
    """The highest of the four finer cells counts; beyond the layer's window nothing is known."""
    layers = layers_of(StubAssembler())
    layer, planner = layers.low_obstacles, LocalPlanner(GRID)
    planner.occupancy.update(odds_of(np.inf), np.array([0.3, 0.1]), 0.0)
    layer.heights[13, 255] = 0.06  # x from 1.3 m, y from -0.1 m, in cells of 0.1 m.
    low = map_layers(planner, layers).layers["low_obstacle_height"]
    found = map_layers(planner, layers)
    assert low[index(found, (1.35, -0.05))] == pytest.approx(0.06)
    assert np.count_nonzero(low == 0.06) <= 1
    assert np.count_nonzero(np.nan_to_num(low)) == 1
    assert np.isnan(low[index(found, (20.0, 0.0))])
    assert low[index(found, (5.0, 5.0))] == 0.0
