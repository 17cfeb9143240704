"""The true map on surfaces with known slopes and steps."""

import itertools

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import frustum
from worlds.truth import Reason, TruthConfig, build_truth, slope_and_step


def truth_of(heights, objects=(), cell=0.2):
    """Return the true map of heights and objects, without a border."""
    config = TruthConfig(border=0.0)
    return build_truth(Heightfield(heights.astype(np.float32), cell), objects, config)


def slope(angle_deg, n=101, cell=0.2):
    """Return heights that rise along x [m]."""
    return np.repeat((np.arange(n) * cell * np.tan(np.deg2rad(angle_deg)))[:, None], n, axis=1)


@pytest.mark.parametrize(
    ("angle", "reason"), [(0, Reason.FREE), (18, Reason.FREE), (22, Reason.SLOPE)]
)
def test_slopes_up_to_twenty_degrees_are_free(angle, reason):
    """The limit is between 18 and 22 degrees."""
    assert truth_of(slope(angle)).reason_at(0.0, 0.0) == reason


@pytest.mark.parametrize(
    ("height", "forbidden"),
    [(0.03, False), (0.045, False), (0.06, True), (0.07, True), (0.08, True), (-0.07, True)],
)
def test_a_step_is_forbidden_whichever_way_it_goes(height, forbidden):
    """The limit is 5 cm, up or down: a kerb counts with its whole height."""
    heights = np.zeros((101, 101))
    heights[51:] = height
    assert bool(truth_of(heights, cell=0.05).forbidden_at(0.02, 0.0)) is forbidden


def test_a_flat_field_has_neither_slope_nor_step():
    """The slope and step of a level surface are 0, at its border too."""
    slopes, steps = slope_and_step(np.full((20, 30), 1.5), 0.1)
    np.testing.assert_allclose(slopes, 0.0, atol=1e-12)
    np.testing.assert_allclose(steps, 0.0, atol=1e-12)


@pytest.mark.parametrize(("rise_x", "rise_y"), [(0.3, 0.0), (0.0, 0.3), (0.2, -0.1)])
def test_a_plane_has_its_slope_and_no_step(rise_x, rise_y):
    """In any direction: the angle of the steepest ascent, whatever the cell."""
    x, y = np.meshgrid(np.arange(20) * 0.05, np.arange(30) * 0.05, indexing="ij")
    slopes, steps = slope_and_step(rise_x * x + rise_y * y, 0.05)
    inside = (slice(2, -2), slice(2, -2))
    np.testing.assert_allclose(slopes[inside], np.arctan(np.hypot(rise_x, rise_y)), rtol=1e-9)
    np.testing.assert_allclose(steps[inside], 0.0, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1])
def test_a_kerb_has_its_height_as_step(axis):
    """Through the window's middle 0.98 of its height, the factor 1.4 being 1 / 0.7; 1.12 beside."""
    heights = np.zeros((20, 20))
    heights[10:] = 0.07
    steps = slope_and_step(heights if axis == 0 else heights.T, 0.1)[1]
    across = steps if axis == 0 else steps.T
    expected = np.zeros(20)
    expected[8:12] = 1.12, 0.98, 0.98, 1.12
    np.testing.assert_allclose(across, 0.07 * expected[:, None] * np.ones(20), atol=1e-12)


def test_severity_is_counted_in_margins():
    """At the limit it is 0, a margin beyond it 1; the worse of slope and step counts."""
    for angle, expected in ((20.0, 0.0), (23.0, 1.0), (17.0, -1.0)):
        severity = truth_of(slope(angle)).severity
        assert severity[20, 20] == pytest.approx(expected, abs=1e-3)
    heights = np.zeros((101, 101))
    heights[51:] = 0.1
    assert truth_of(heights, cell=0.05).severity.max() == pytest.approx(
        3.1
    )  # (1.12 h - 5 cm) / 2 cm.


def test_the_border_is_forbidden_and_hides_no_other_reason():
    """A strip of 1 m along every side; a wall in it keeps its reason."""
    wall = frustum(SemanticClass.WALL, (-9.5, 0, 0), (0.3, 0.3), 2.0)
    ground = Heightfield(np.zeros((101, 101), dtype=np.float32), 0.2)
    truth = build_truth(ground, (wall,), TruthConfig())
    for x, y in ((-9.1, 5.0), (9.1, 5.0), (5.0, -9.1), (5.0, 9.1)):
        assert truth.reason_at(x, y) == Reason.BORDER
        assert truth.reason_at(x * 8.9 / 9.1, y * 8.9 / 9.1) == Reason.FREE
    assert truth.reason_at(-9.5, 0.0) == Reason.SOLID
    assert truth.clearance_at(0.0, 3.0) == pytest.approx(9.0 - 3.0, abs=0.11)


@pytest.mark.parametrize(
    ("semantic", "base", "height", "reason"),
    [
        (SemanticClass.ROCK, -0.1, 0.18, Reason.LOW),
        (SemanticClass.ROCK, -0.1, 0.2, Reason.SOLID),
        (SemanticClass.HIGH_GRASS, -0.1, 0.18, Reason.VEGETATION),
        (SemanticClass.FOLIAGE, 0.85, 1.0, Reason.VEGETATION),
        (SemanticClass.FOLIAGE, 0.95, 1.0, Reason.FREE),
        (SemanticClass.CABLE, 0.95, 1.0, Reason.FREE),
    ],
)
def test_objects_forbid_their_footprint_by_class_and_height(semantic, base, height, reason):
    """Below 9 cm a solid object is low; above 90 cm an object leaves the ground free."""
    truth = truth_of(np.zeros((51, 51)), (frustum(semantic, (1, 2, base), (0.4, 0.4), height),))
    assert truth.reason_at(1.0, 2.0) == reason
    assert truth.reason_at(1.0, 2.6) == Reason.FREE
    assert truth.reason_at(2.0, 1.0) == Reason.FREE


def test_a_thin_object_between_cell_centres_marks_its_cells():
    """A post of 2 cm in the corner of four cells marks them, and nothing further away."""
    post = frustum(SemanticClass.POST, (1.0, 2.0, -0.1), (0.01, 0.01), 2.0)
    truth = truth_of(np.zeros((51, 51)), (post,))
    near = [(1 + dx, 2 + dy) for dx in (-0.05, 0.05) for dy in (-0.05, 0.05)]
    assert any(truth.solid_at(*place) for place in near)
    cells = np.argwhere(truth.reason == Reason.SOLID) * 0.1 - 4.95
    assert np.hypot(*(cells - [1.0, 2.0]).T).max() < 0.25


def test_solid_objects_outrank_plants_and_water_outranks_slope():
    """A cell with several reasons keeps the gravest."""
    objects = (
        frustum(SemanticClass.ROCK, (0, 0, -0.1), (0.4, 0.4), 0.5),
        frustum(SemanticClass.BUSH, (0, 0, -0.1), (1.0, 1.0), 0.5),
    )
    truth = truth_of(np.zeros((51, 51)), objects)
    assert (truth.reason_at(0.0, 0.0), truth.reason_at(0.7, 0.0)) == (
        Reason.SOLID,
        Reason.VEGETATION,
    )
    surface = np.zeros((100, 100), dtype=np.uint8)
    surface[60:, :40] = SemanticClass.WATER
    ground = Heightfield(slope(25).astype(np.float32), 0.2)
    truth = build_truth(ground, (), TruthConfig(border=0.0), surface)
    assert truth.reason_at(3.0, -3.0) == Reason.WATER
    assert truth.reason_at(3.0, 3.0) == Reason.SLOPE
    assert truth.reason_at(-3.0, -3.0) == Reason.SLOPE


def test_a_trunk_is_solid_and_its_crown_is_not_in_the_way():
    """Foliage above the body leaves the ground free; clearance is measured to the trunk."""
    trunk = frustum(SemanticClass.TRUNK, (0, 0, 0), (0.2, 0.2), 3.0)
    crown = frustum(SemanticClass.FOLIAGE, (3, 0, 2.0), (1, 1), 2.0)
    truth = truth_of(np.zeros((101, 101)), (trunk, crown))
    assert truth.solid_at(0.0, 0.0)
    assert not truth.forbidden_at(3.0, 0.0)
    assert truth.clearance_at(2.0, 0.0) == pytest.approx(1.8, abs=0.11)


def test_points_are_labelled_by_class_and_ground_by_its_shape():
    """Ground has the severity of its slope in margins, other classes an infinite one."""
    truth = truth_of(slope(25))
    points = np.zeros((3, 3), dtype=np.float32)
    classes = np.array([SemanticClass.GROUND, SemanticClass.TRUNK, SemanticClass.PATH])
    severity = truth.severity_of(points, classes.astype(np.uint8))
    np.testing.assert_allclose(severity, [5 / 3, np.inf, 5 / 3], rtol=1e-3)  # Margin: 3 degrees.
    flat = truth_of(np.zeros((51, 51))).severity_of(points, classes.astype(np.uint8))
    assert (flat > 0).tolist() == [False, True, False]


def test_severity_of_ground_is_interpolated_between_centres():
    """As scipy's bilinear interpolation, bit for bit; beyond the border, that of the border."""
    rng = np.random.default_rng(0)
    truth = truth_of(rng.normal(0, 0.1, (61, 51)), cell=0.1)
    points = rng.uniform(-3.5, 3.5, (500, 3)).astype(np.float32)
    classes = np.full(500, SemanticClass.PATH, dtype=np.uint8)
    places = (points[:, :2] - [truth.x_min, truth.y_min]) / truth.cell - 0.5
    expected = map_coordinates(truth.severity, places.T, order=1, mode="nearest")
    np.testing.assert_array_equal(truth.severity_of(points, classes), expected)


def test_a_stone_under_the_wheel_is_no_obstacle():
    """A traversable class neither forbids cells nor labels points."""
    stone = frustum(SemanticClass.STONE, (0, 0, 0), (0.2, 0.2), 0.04)
    truth = truth_of(np.zeros((51, 51)), (stone,))
    assert not truth.forbidden_at(0.0, 0.0)
    label = truth.severity_of(np.zeros((1, 3)), np.array([SemanticClass.STONE], dtype=np.uint8))
    assert label[0] < 0


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


def wall_with_gap(width):
    """Return a wall along y, 12 m long, with a gap [m] in the middle."""
    half = np.arange(width / 2 + 0.2, 6.0, 0.2)
    return tuple(
        frustum(SemanticClass.WALL, (0, y, 0), (0.2, 0.2), 2.0) for y in [*-half[::-1], *half]
    )


def test_the_cost_to_go_on_open_ground_is_the_distance():
    """Without obstacles the cost-to-go is the distance."""
    truth = truth_of(np.zeros((101, 101)))
    at = truth.cost_to_go(np.array([5.0, 0.0]), 0.45, 1.0)
    assert at(np.array(-3.0), np.array(0.0)) == pytest.approx(8.0, abs=0.4)


def test_the_cost_to_go_avoids_a_gap_that_is_too_narrow():
    """The cheapest path leads around a wall with a narrow gap; inside the gap it is finite."""
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
