"""Clearance of a body among points: exact at cells, close between them."""

import numpy as np
import pytest

from andabata.machine.planar.footprint import box_footprint, outline_distance
from andabata.navigation.planar.clearance_field import (
    body_clearance,
    body_discs,
    clearance_at,
    clearance_field,
)

BOX = box_footprint(0.508, 0.430)


def test_distances_are_those_of_the_nearest_point():
    """Random places among random points, to 3 cm; far ones are cut."""
    rng = np.random.default_rng(0)
    points = rng.uniform(-1.5, 1.5, (30, 2))
    field = clearance_field(points, (0.2, -0.1), 1.2)
    for x, y in rng.uniform(-0.9, 0.9, (200, 2)):
        exact = min(np.hypot(*(points - (x, y)).T).min(), 0.6)
        assert clearance_at(x, y, field) == pytest.approx(exact, abs=0.03)


def test_beyond_the_square_nothing_is_near():
    """Places outside have the largest distance, and so has a field without points."""
    field = clearance_field(np.zeros((0, 2)), (0.0, 0.0), 1.0)
    assert clearance_at(0.3, 0.2, field) == pytest.approx(0.6)
    field = clearance_field(np.array([[3.0, 3.0]]), (0.0, 0.0), 1.0)
    assert clearance_at(3.0, 3.0, field) == 0.6


def test_the_body_is_filled_up_to_its_edges():
    """Along all sides the body's clearance is that of the box, within 3 cm; inside it is none."""
    discs, corners = body_discs(BOX), np.array(BOX)
    rng = np.random.default_rng(1)
    for _ in range(300):
        place = rng.uniform(-0.6, 0.6, 2)
        field = clearance_field(place[None], (0.0, 0.0), 1.0, cell=0.02)
        found = body_clearance(0.0, 0.0, 0.0, discs, field)
        exact = outline_distance(*place, corners)
        if exact == 0:
            assert found < 0.035
        else:
            assert exact - 0.012 <= found <= exact + 0.035 or found > 0.4


def test_the_body_turns_and_moves():
    """Clearance depends on the pose relative to the points alone."""
    discs, points = body_discs(BOX), np.array([[0.5, 0.1], [-0.2, 0.6]])
    here = body_clearance(0.0, 0.0, 0.0, discs, clearance_field(points, (0.0, 0.0), 1.0, 0.01))
    yaw, shift = 0.7, np.array([2.0, -1.0])
    c, s = np.cos(yaw), np.sin(yaw)
    moved = points @ np.array([[c, s], [-s, c]]) + shift
    there = clearance_field(moved, (2.0, -1.0), 1.0, 0.01)
    assert body_clearance(*shift, yaw, discs, there) == pytest.approx(here, abs=0.003)
