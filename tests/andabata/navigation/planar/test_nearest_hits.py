"""Nearest hits: exact distances from what the laser measured, wherever the square lies."""

import math

import numpy as np
import pytest

from andabata.navigation.planar.hit_layer import HitLayer, HitLayerConfig, LaserPose
from andabata.navigation.planar.nearest_hits import (
    NOWHERE,
    empty_hits,
    find_nearest,
)

CELLS, CELL, REACH = 64, 0.05, 0.6


def layer_with(places, robot=(0.0, 0.0)):
    """Return a hit layer around a robot that has seen some places."""
    layer = HitLayer(HitLayerConfig(cells=CELLS, cell=CELL))
    robot = np.array(robot, dtype=float)
    layer.follow(robot)
    offsets = np.asarray(places, dtype=float).reshape(-1, 2) - robot
    ranges = np.hypot(*offsets.T).astype(np.float32)
    layer.update(LaserPose(*robot, 0.0), np.arctan2(*offsets.T[::-1]), ranges, 10.0)
    return layer


def found_in(layer):
    """Return the nearest hits of a layer."""
    found = empty_hits(CELLS, CELL, REACH)
    find_nearest(layer, found)
    return found


def nearest_hit(nearest, x, y):
    """Return the hit nearest to the cell of a place [m]; beyond the square there is none."""
    i, j = np.floor((np.array([x, y]) - nearest.corner) * nearest.per_metre).astype(int)
    inside = min(i, j) >= 0 and max(i, j) < len(nearest.places)
    return tuple(nearest.places[i, j]) if inside else (NOWHERE, NOWHERE)


@pytest.mark.parametrize("robot", [(0.0, 0.0), (7.33, -4.21)])
def test_distances_are_those_from_the_nearest_hit(robot):
    """They are never too short, and too long by no more than the nearest changes in a cell."""
    rng = np.random.default_rng(3)
    layer = layer_with(np.array(robot) + rng.uniform(-1.4, 1.4, (25, 2)), robot)
    found, hits = found_in(layer), layer.obstacles
    assert len(hits) > 15
    errors = []
    for x, y in np.array(robot) + rng.uniform(-1.5, 1.5, (500, 2)):
        true = np.hypot(*(hits - (x, y)).T).min()
        if true < REACH - 2 * CELL:
            errors.append(math.dist(nearest_hit(found, x, y), (x, y)) - true)
    assert len(errors) > 200
    assert min(errors) > -1e-5
    assert max(errors) < 1.5 * CELL
    assert np.mean(errors) < 0.05 * CELL


def test_the_place_of_a_hit_is_kept_exactly():
    """It is not that of its cell."""
    found = found_in(layer_with([(0.512, 0.233)]))
    assert nearest_hit(found, 0.4, 0.1) == pytest.approx((0.512, 0.233), abs=1e-5)


def test_hits_out_of_reach_and_ground_beyond_the_square_have_none():
    """They are far enough not to count in any distance."""
    found = found_in(layer_with([(0.5, 0.0)]))
    assert nearest_hit(found, -0.3, 0.0) == (NOWHERE, NOWHERE)
    assert nearest_hit(found, 50.0, 0.0) == (NOWHERE, NOWHERE)
    assert (found_in(layer_with([])).places == NOWHERE).all()


def test_nothing_is_left_of_an_earlier_square():
    """A square that is used again is the same as a new one."""
    used = empty_hits(CELLS, CELL, REACH)
    find_nearest(layer_with([(1.0, 1.0), (-1.2, 0.3)]), used)
    layer = layer_with([(0.2, -0.7)], (0.5, 0.1))
    find_nearest(layer, used)
    fresh = found_in(layer)
    np.testing.assert_array_equal(used.places, fresh.places)
    np.testing.assert_array_equal(used.corner, fresh.corner)
