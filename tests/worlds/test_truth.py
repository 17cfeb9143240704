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
    assert truth.nontraversable(points, classes.astype(np.uint8)).tolist() == [True, True, True]
    flat = truth_of(np.zeros((51, 51)))
    assert flat.nontraversable(points, classes.astype(np.uint8)).tolist() == [False, True, False]


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
