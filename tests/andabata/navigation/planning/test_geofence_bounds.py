"""Geofence bounds: cells outside of them, wherever the map lies in odom."""

import numpy as np
import pytest

from andabata.navigation.planning.geofence_bounds import (
    EVERYWHERE,
    clear_outside,
    geofence_in_odom,
)
from andabata.navigation.planning.map_transform import MapTransform

CELLS, CELL = 64, 0.2
MIDDLE = CELLS // 2
CENTRE = np.zeros(2, dtype=np.int64)


@pytest.mark.parametrize("turn", [0.0, 0.5, -2.0])
def test_cells_beyond_the_geofence_are_obstacles(turn):
    """A cell is inside when its middle, turned and shifted into the map, lies in the bounds."""
    shift = (10.0, 20.0)
    transform = MapTransform(np.cos(turn), np.sin(turn), *shift)
    geofence = geofence_in_odom((8.0, 18.5, 30.0, 23.0), transform)
    clearance = np.ones((CELLS, CELLS), dtype=np.float32)
    clear_outside(clearance, CENTRE, CELL, geofence)
    x, y = (np.mgrid[:CELLS, :CELLS] - MIDDLE + 0.5) * CELL
    map_x = shift[0] + np.cos(turn) * x - np.sin(turn) * y
    map_y = shift[1] + np.sin(turn) * x + np.cos(turn) * y
    inside = (map_x > 8.0) & (map_x < 30.0) & (map_y > 18.5) & (map_y < 23.0)
    assert 0 < inside.sum() < inside.size
    np.testing.assert_array_equal(clearance > 0, inside)


def test_without_a_geofence_everywhere_is_inside():
    """No bounds leave the whole square as it is."""
    assert geofence_in_odom(None, MapTransform(0.6, 0.8, 1.0, 2.0)) == EVERYWHERE
    clearance = np.ones((CELLS, CELLS), dtype=np.float32)
    clear_outside(clearance, CENTRE, CELL, EVERYWHERE)
    assert (clearance == 1.0).all()


def test_a_row_that_begins_and_ends_inside_is_inside():
    """A geofence that only one corner of the square sticks out of clears that corner alone."""
    reach = np.sqrt(2.0) * MIDDLE * CELL - 1.0
    geofence = geofence_in_odom(
        (-50.0, -50.0, 50.0, reach), MapTransform(np.sqrt(0.5), np.sqrt(0.5))
    )
    clearance = np.ones((CELLS, CELLS), dtype=np.float32)
    clear_outside(clearance, CENTRE, CELL, geofence)
    assert clearance[-1, -1] == 0.0
    outside = np.argwhere(clearance == 0.0)
    assert 10 < len(outside) < 40
    assert outside.min() > CELLS - 10
