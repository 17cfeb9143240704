"""Time to a goal over a true map: in the open, round a wall, through a gap, and nowhere."""

import math

import numpy as np
import pytest

from andabata.training.time_field import TimeFieldConfig, slowness, time_field
from worlds.traversability_map import Reason, TraversabilityMap

CONFIG = TimeFieldConfig()


def map_of(forbidden, cell=0.1):
    """Return a true map of forbidden cells with exact clearances, its corner at the origin."""
    reason = np.where(forbidden, Reason.SOLID, Reason.FREE).astype(np.uint8)
    clearance = np.full(forbidden.shape, 5.0, dtype=np.float32)
    cells = np.argwhere(forbidden)
    for i, j in np.ndindex(*forbidden.shape) if len(cells) else ():
        nearest = np.hypot(*(cells - [i, j]).T).min() * cell
        clearance[i, j] = min(clearance[i, j], nearest)
    severity = np.full(forbidden.shape, -5.0, dtype=np.float32)
    return TraversabilityMap(cell, 0.0, 0.0, reason, severity, clearance)


def node(field, x, y):
    """Return the node of a place [m]."""
    return tuple(((np.array([x, y]) - field.corner) / field.edge).astype(int))


@pytest.fixture(scope="module")
def walled():
    """A square of 12 m with a wall from one side that leaves a gap of 3 m at the other."""
    forbidden = np.zeros((120, 120), dtype=bool)
    forbidden[60, :90] = True
    return map_of(forbidden)


def test_in_the_open_time_is_length_over_speed():
    """Straight along the grid, and by no more than the grid's eight directions cost elsewhere."""
    field = time_field(map_of(np.zeros((150, 150), dtype=bool)), np.array([2.0, 2.0]), CONFIG)
    assert field.times[node(field, 2.0, 2.0)] == 0.0
    assert field.times[node(field, 11.0, 2.0)] == pytest.approx(9.0 / CONFIG.speed)
    away = math.hypot(9.0, 4.0)
    assert away <= field.times[node(field, 11.0, 6.0)] * CONFIG.speed <= 1.09 * away


def test_directions_lead_to_the_goal():
    """From all sides, within an eighth of a turn, and straight where it is near."""
    field = time_field(map_of(np.zeros((150, 150), dtype=bool)), np.array([7.0, 7.0]), CONFIG)
    for x, y in ((2.0, 2.0), (12.0, 7.0), (7.0, 1.0), (3.0, 9.0)):
        off = field.directions[node(field, x, y)] - math.atan2(7.0 - y, 7.0 - x)
        assert abs(math.remainder(off, 2 * math.pi)) < math.pi / 8


def test_a_wall_is_driven_round(walled):
    """The way beside it is longer, slower near its end, and begins along it."""
    field = time_field(walled, np.array([3.0, 2.0]), CONFIG)
    behind = field.times[node(field, 9.0, 2.0)]
    shortest = math.hypot(3.0, 7.2) + math.hypot(3.0, 7.2)
    assert shortest / CONFIG.speed < behind < 1.4 * shortest / CONFIG.speed
    assert 0.3 < field.directions[node(field, 9.0, 2.0)] < 2.8


def test_a_closed_place_has_no_time():
    """Behind a wall without a gap times are infinite, and so are those of the wall."""
    forbidden = np.zeros((90, 90), dtype=bool)
    forbidden[44:47, :] = True
    field = time_field(map_of(forbidden), np.array([2.0, 2.0]), CONFIG)
    assert np.isinf(field.times[node(field, 7.0, 2.0)])
    assert np.isinf(field.times[node(field, 4.55, 2.0)])
    assert np.isfinite(field.times[node(field, 2.0, 7.0)])


def test_narrow_ground_takes_longer():
    """Once in the open, twice at the slow clearance, twenty times where the body hardly fits."""
    places = np.array([2.0, 0.9, 0.45, 0.4, 0.0])
    factors = slowness(places, CONFIG) * CONFIG.speed
    np.testing.assert_allclose(factors[:4], [1.0, 1.0, 2.0, 20.0])
    assert np.isinf(factors[4])
    assert np.all(np.diff(slowness(np.linspace(0.01, 2, 50), CONFIG)) <= 0)


def test_the_border_of_the_truth_is_not_left():
    """A real world's field is finite at its own free places and infinite on its border."""
    truth = map_of(np.pad(np.zeros((80, 80), dtype=bool), 10, constant_values=True))
    field = time_field(truth, np.array([5.0, 5.0]), CONFIG)
    assert np.isinf(field.times[0, 0])
    assert np.isfinite(field.times[node(field, 8.0, 8.0)])
