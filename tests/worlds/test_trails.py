"""Trails: gentle, level and as wide as stated; roots across them."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from worlds.trails import (
    Trail,
    dense,
    distance_to_trails,
    draw_roots,
    draw_trails,
    gentlest,
    levelled,
    steepness,
    trodden,
)

FLAT = Heightfield(np.zeros((161, 161), dtype=np.float32), 0.25)
EAST = Trail(np.array([[-25.0, 0.0], [25.0, 0.0]]), 1.5)


def rng(seed=0):
    return np.random.default_rng(seed)


def test_a_trail_is_one_to_two_metres_wide_and_crosses_the_square():
    """Each has a stream of its own: a third one does not move the first two."""
    trails = draw_trails(FLAT, 3, rng())
    assert all(1.0 <= trail.width <= 2.0 for trail in trails)
    for trail in trails:
        inside = (np.abs(trail.line) < 20.0).all(axis=1)
        assert inside.sum() * 1.5 > 12.0
    for one, other in zip(trails, draw_trails(FLAT, 2, rng()), strict=False):
        np.testing.assert_array_equal(one.line, other.line)


def test_of_some_lines_the_gentlest_is_taken():
    """A hillside of 30 degrees to the north of level ground is avoided."""
    rise = np.maximum(FLAT.y, 0.0) * np.tan(np.deg2rad(30.0))
    hill = Heightfield(np.tile(rise, (161, 1)).astype(np.float32), 0.25)
    slope = steepness(hill)
    assert slope[80, 140] == pytest.approx(np.tan(np.deg2rad(30.0)), rel=1e-3)
    lines = [np.array([[-15.0, y], [15.0, y]]) for y in (12.0, -12.0, 0.0)]
    assert gentlest(hill, slope, lines) is lines[1]


def test_ground_is_level_on_a_trail_and_as_it_was_a_metre_beside_it():
    """A bump of 30 cm is nearly gone in the middle."""
    bumps = 0.3 * np.sin(2 * np.pi * FLAT.x / 2.0)
    bumpy = Heightfield(np.tile(bumps[:, None], (1, 161)).astype(np.float32), 0.25)
    even = levelled(bumpy, [EAST]).heights
    assert np.abs(even[20:-20, 80]).max() < 0.02
    away = np.abs(FLAT.y) > 0.75 + 1.0
    np.testing.assert_array_equal(even[:, away], bumpy.heights[:, away])
    assert levelled(bumpy, []) is bumpy


def test_a_trail_is_trodden_to_its_edge_and_fades_beside_it():
    """Half a verge beside the edge half of it is left."""
    share = trodden(FLAT, [EAST], 0.5)
    np.testing.assert_array_equal(share[80, np.abs(FLAT.y) <= 0.75], 1.0)
    assert share[80, 80 + 4] == pytest.approx(0.5)
    np.testing.assert_array_equal(share[80, np.abs(FLAT.y) >= 1.25], 0.0)


def test_distance_is_from_the_edge_and_infinite_out_of_reach():
    """In the trail it is 0."""
    points = np.array([[0.0, 0.3], [3.0, 1.75], [3.0, -1.75], [0.0, 5.0]])
    found = distance_to_trails([EAST], points, 2.0)
    np.testing.assert_allclose(found, [0.0, 1.0, 1.0, np.inf], atol=1e-3)
    assert np.isinf(distance_to_trails([], points, 2.0)).all()


def test_points_along_a_line_are_evenly_apart():
    """Around a corner, too."""
    points, along = dense(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 1.0]]), step=0.5)
    assert along == pytest.approx(np.arange(9) * 0.5)
    np.testing.assert_allclose(points[[2, 6, 8]], [[1, 0], [3, 0], [3, 1]])


def test_roots_cross_the_trail_and_none_is_at_the_limit_of_a_wheel():
    """They are 3 to 8 cm high, low ones of a class of their own, as many as stated."""
    trails = [EAST] * 12
    parts = draw_roots(FLAT, trails, 0.4, rng(1))
    tops = np.array([part.vertices[:, 2].max() for part in parts])
    low = np.array([part.semantic is SemanticClass.ROOT for part in parts])
    assert 0.03 <= tops.min() < 0.035
    assert 0.075 < tops.max() <= 0.0801
    assert tops[low].max() <= 0.0451
    assert tops[~low].min() >= 0.0549
    assert {part.semantic for part in parts} == {SemanticClass.ROOT, SemanticClass.TRUNK}
    # Pieces of one root share its height: the course of each crosses both edges.
    places = np.concatenate([part.vertices for part in parts])
    assert np.abs(places[:, 1]).max() < 0.75 + 0.45
    # Roots whose ends are within 2 m of the border are left out: 36 of 50 m.
    assert len(np.unique(tops)) == pytest.approx(12 * 36 * 0.4 * 0.8, rel=0.25)
