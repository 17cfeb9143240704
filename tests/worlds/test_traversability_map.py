"""The true map as it is asked: at places and points, and for paths."""

import itertools

import numpy as np
from scipy.ndimage import map_coordinates

from terrain.classes import SemanticClass
from terrain.objects import frustum
from tests.support.true_maps import slope, truth_of


def test_points_are_labelled_by_class_and_ground_by_its_shape():
    """Ground has the severity of its slope in margins, other classes an infinite one."""
    truth = truth_of(slope(25))
    points = np.zeros((3, 3), dtype=np.float32)
    classes = np.array([SemanticClass.GROUND, SemanticClass.TRUNK, SemanticClass.PATH])
    severity = truth.severity_of(points, classes.astype(np.uint8))
    np.testing.assert_allclose(severity, [5 / 3, np.inf, 5 / 3], rtol=1e-3)  # Margin: 3 degrees.
    flat = truth_of(np.zeros((51, 51))).severity_of(points, classes.astype(np.uint8))
    assert (flat > 0).tolist() == [False, True, False]


def test_plants_are_labelled_by_the_height_of_what_grows_there():
    """Points of low plants are free, of high ones blocked, and so are low ones beside high ones."""
    low = frustum(SemanticClass.MEADOW, (-2.0, 0.0, -0.1), (0.8, 0.8), 0.2)
    high = frustum(SemanticClass.MEADOW, (0.0, 0.0, -0.1), (0.8, 0.8), 0.5)
    truth = truth_of(np.zeros((51, 51)), (low, high))
    points = np.array([[-2.0, 0, 0.05], [0.0, 0, 0.3], [-0.95, 0.0, 0.05]], dtype=np.float32)
    for kind in (SemanticClass.MEADOW, SemanticClass.HIGH_GRASS):
        severity = truth.severity_of(points, np.full(3, kind, dtype=np.uint8))
        assert severity.tolist() == [-np.inf, np.inf, np.inf]
    bush = truth.severity_of(points, np.full(3, SemanticClass.BUSH, dtype=np.uint8))
    assert np.isposinf(bush).all()


def test_severity_of_ground_is_interpolated_between_centres():
    """As scipy's bilinear interpolation, bit for bit; beyond the border, that of the border."""
    rng = np.random.default_rng(0)
    truth = truth_of(rng.normal(0, 0.1, (61, 51)), cell=0.1)
    points = rng.uniform(-3.5, 3.5, (500, 3)).astype(np.float32)
    classes = np.full(500, SemanticClass.PATH, dtype=np.uint8)
    places = (points[:, :2] - [truth.x_min, truth.y_min]) / truth.cell - 0.5
    expected = map_coordinates(truth.severity, places.T, order=1, mode="nearest")
    np.testing.assert_array_equal(truth.severity_of(points, classes), expected)


def test_the_shortest_path_keeps_its_clearance_and_goes_round():
    """A path around a wall is little longer than the shortest, and clear of it."""
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


def test_one_place_alone_is_as_many_places_together():
    """The scalar query equals the array queries, beyond the border too."""
    truth = truth_of(slope(22) * (np.arange(101)[:, None] > 50))
    places = np.random.default_rng(0).uniform(-13, 13, (200, 2))  # Beyond the border too.
    found = [truth.at(float(x), float(y)) for x, y in places]
    np.testing.assert_array_equal([bad for bad, _ in found], truth.forbidden_at(*places.T))
    np.testing.assert_array_equal(
        [clearance for _, clearance in found], truth.clearance_at(*places.T)
    )
    assert 0 < np.mean([bad for bad, _ in found]) < 1


def test_points_lie_at_forbidden_places_whatever_their_height():
    """As by ``forbidden_at``, beyond the border, too."""
    heights = np.zeros((41, 41))
    heights[20:] = 0.3
    truth = truth_of(heights)
    points = np.random.default_rng(3).uniform(-6, 6, (500, 3)).astype(np.float32)
    expected = truth.forbidden_at(*points[:, :2].T.astype(np.float64))
    np.testing.assert_array_equal(truth.forbidden_under(points), expected)
    assert 0 < expected.sum() < 500
