"""The true map on surfaces whose slopes and steps are known."""

import itertools

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import frustum
from worlds.truth import Reason, TruthConfig, build_truth


def truth_of(heights, objects=(), cell=0.2):
    config = TruthConfig(border=0.0)
    return build_truth(Heightfield(heights.astype(np.float32), cell), objects, config)


def slope(angle_deg, n=101, cell=0.2):
    return np.repeat((np.arange(n) * cell * np.tan(np.deg2rad(angle_deg)))[:, None], n, axis=1)


@pytest.mark.parametrize(
    ("angle", "reason"), [(0, Reason.FREE), (18, Reason.FREE), (22, Reason.SLOPE)]
)
def test_slopes_up_to_twenty_degrees_are_free(angle, reason):
    assert truth_of(slope(angle)).reason_at(0.0, 0.0) == reason


@pytest.mark.parametrize(("height", "forbidden"), [(0.03, False), (0.08, True), (-0.08, True)])
def test_a_step_is_forbidden_whichever_way_it_goes(height, forbidden):
    heights = np.zeros((101, 101))
    heights[51:] = height
    assert bool(truth_of(heights, cell=0.05).forbidden_at(0.02, 0.0)) is forbidden


def test_a_trunk_is_solid_and_its_crown_is_not_in_the_way():
    trunk = frustum(SemanticClass.TRUNK, (0, 0, 0), (0.2, 0.2), 3.0)
    crown = frustum(SemanticClass.FOLIAGE, (3, 0, 2.0), (1, 1), 2.0)
    truth = truth_of(np.zeros((101, 101)), (trunk, crown))
    assert truth.solid_at(0.0, 0.0)
    assert not truth.forbidden_at(3.0, 0.0)
    assert truth.clearance_at(2.0, 0.0) == pytest.approx(1.8, abs=0.11)


def test_points_are_labelled_by_class_and_ground_by_its_shape():
    truth = truth_of(slope(25))
    points = np.zeros((3, 3), dtype=np.float32)
    classes = np.array([SemanticClass.GROUND, SemanticClass.TRUNK, SemanticClass.PATH])
    severity = truth.severity_of(points, classes.astype(np.uint8))
    np.testing.assert_allclose(severity, [5 / 3, np.inf, 5 / 3], rtol=1e-3)  # Margin: 3 degrees.
    flat = truth_of(np.zeros((51, 51))).severity_of(points, classes.astype(np.uint8))
    assert (flat > 0).tolist() == [False, True, False]


def test_a_stone_under_the_wheel_is_no_obstacle():
    stone = frustum(SemanticClass.STONE, (0, 0, 0), (0.2, 0.2), 0.04)
    truth = truth_of(np.zeros((51, 51)), (stone,))
    assert not truth.forbidden_at(0.0, 0.0)
    label = truth.severity_of(np.zeros((1, 3)), np.array([SemanticClass.STONE], dtype=np.uint8))
    assert label[0] < 0


def test_the_shortest_path_keeps_its_room_and_goes_round():
    wall = [
        frustum(SemanticClass.WALL, (0, y, 0), (0.3, 0.3), 2.0) for y in np.arange(-4, 4.1, 0.4)
    ]
    truth = truth_of(np.zeros((101, 101)), tuple(wall))
    path = truth.shortest_path(np.array([-4.0, 0.0]), np.array([4.0, 0.0]), 0.5)
    length = np.hypot(*np.diff(path, axis=0).T).sum()
    assert 2 * np.hypot(4, 4.8) < length < 1.1 * 2 * np.hypot(4, 4.8)
    for a, b in itertools.pairwise(path):
        line = a + np.linspace(0, 1, 50)[:, None] * (b - a)
        assert truth.clearance_at(line[:, 0], line[:, 1]).min() > 0.3


def wall_with_gap(width):
    """Return a wall along y, 12 m long, with a gap [m] in the middle."""
    half = np.arange(width / 2 + 0.2, 6.0, 0.2)
    return tuple(
        frustum(SemanticClass.WALL, (0, y, 0), (0.2, 0.2), 2.0) for y in [*-half[::-1], *half]
    )


def test_the_cost_of_the_way_on_open_ground_is_its_length():
    truth = truth_of(np.zeros((101, 101)))
    at = truth.cost_to_go(np.array([5.0, 0.0]), 0.45, 1.0)
    assert at(np.array(-3.0), np.array(0.0)) == pytest.approx(8.0, abs=0.4)


def test_the_way_on_does_not_lead_through_a_gap_that_is_too_narrow():
    narrow = truth_of(np.zeros((101, 101)), wall_with_gap(0.7))
    wide = truth_of(np.zeros((101, 101)), wall_with_gap(2.0))
    here, goal = (np.array(-2.0), np.array(0.0)), np.array([2.0, 0.0])
    through = wide.cost_to_go(goal, 0.45, 0.0)(*here)
    round_the_end = narrow.cost_to_go(goal, 0.45, 0.0)(*here)
    assert through == pytest.approx(4.0, abs=0.5)
    shortest = 2 * np.hypot(2, 6.6)
    assert shortest < round_the_end < 1.2 * shortest  # Eight directions cost up to 8 % more.
    inside = narrow.cost_to_go(goal, 0.45, 0.0)(np.array(0.0), np.array(0.0))
    assert np.isfinite(inside)


def test_one_place_alone_is_as_many_places_together():
    truth = truth_of(slope(22) * (np.arange(101)[:, None] > 50))
    places = np.random.default_rng(0).uniform(-13, 13, (200, 2))  # Beyond the border too.
    found = [truth.at(float(x), float(y)) for x, y in places]
    np.testing.assert_array_equal([bad for bad, _ in found], truth.forbidden_at(*places.T))
    np.testing.assert_array_equal([room for _, room in found], truth.clearance_at(*places.T))
    assert 0 < np.mean([bad for bad, _ in found]) < 1
