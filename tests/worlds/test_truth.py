"""The true map on surfaces with known slopes and steps."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import frustum, hull
from tests.support.true_maps import slope, solid_at, truth_of
from worlds.traversability_map import Reason
from worlds.truth import TruthConfig, build_truth, slope_and_step, with_vegetation_limit
from worlds.world import World


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
        (SemanticClass.ROCK, -0.1, 0.145, Reason.FREE),
        (SemanticClass.ROCK, -0.1, 0.155, Reason.LOW),
        (SemanticClass.ROCK, -0.1, 0.18, Reason.LOW),
        (SemanticClass.ROCK, -0.1, 0.2, Reason.SOLID),
        (SemanticClass.HIGH_GRASS, -0.1, 0.24, Reason.FREE),
        (SemanticClass.HIGH_GRASS, -0.1, 0.26, Reason.VEGETATION),
        (SemanticClass.MEADOW, -0.1, 0.24, Reason.FREE),
        (SemanticClass.MEADOW, -0.1, 0.26, Reason.VEGETATION),
        (SemanticClass.BUSH, -0.1, 0.18, Reason.VEGETATION),
        (SemanticClass.FOLIAGE, 0.85, 1.0, Reason.VEGETATION),
        (SemanticClass.FOLIAGE, 0.95, 1.0, Reason.FREE),
        (SemanticClass.CABLE, 0.95, 1.0, Reason.FREE),
    ],
)
def test_objects_forbid_their_footprint_by_class_and_height(semantic, base, height, reason):
    """Solid objects to 5 cm are free, to 9 cm low; plants to 15 cm, what begins at 90 cm free."""
    truth = truth_of(np.zeros((51, 51)), (frustum(semantic, (1, 2, base), (0.4, 0.4), height),))
    assert truth.reason_at(1.0, 2.0) == reason
    assert truth.reason_at(1.0, 2.6) == Reason.FREE
    assert truth.reason_at(2.0, 1.0) == Reason.FREE


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
    assert solid_at(truth, 0.0, 0.0)
    assert not truth.forbidden_at(3.0, 0.0)
    assert truth.clearance_at(2.0, 0.0) == pytest.approx(1.8, abs=0.11)


def test_a_stone_under_the_wheel_is_no_obstacle():
    """A traversable class neither forbids cells nor labels points."""
    stone = frustum(SemanticClass.STONE, (0, 0, 0), (0.2, 0.2), 0.04)
    truth = truth_of(np.zeros((51, 51)), (stone,))
    assert not truth.forbidden_at(0.0, 0.0)
    label = truth.severity_of(np.zeros((1, 3)), np.array([SemanticClass.STONE], dtype=np.uint8))
    assert label[0] < 0


def test_a_robot_with_another_limit_of_plants_has_another_true_map(make_ground):
    """Grass of 25 cm is free from a limit of 0.25 m on; without plants the world stays the same."""
    grass = frustum(SemanticClass.MEADOW, (1, 2, -0.1), (0.4, 0.4), 0.35)
    world = make_ground(objects=(grass,))
    assert world.truth.reason_at(1.0, 2.0) == Reason.VEGETATION
    assert with_vegetation_limit(world, 0.15) is world
    assert with_vegetation_limit(world, 0.2).truth.reason_at(1.0, 2.0) == Reason.VEGETATION
    assert with_vegetation_limit(world, 0.3).truth.reason_at(1.0, 2.0) == Reason.FREE
    bare = make_ground()
    assert with_vegetation_limit(bare, 0.3) is bare


def test_roughness_is_no_step_and_objects_stand_on_it():
    """Slope and step are those of the base; how high an object rises is measured on the ground."""
    base = Heightfield(np.zeros((41, 41), dtype=np.float32), 0.25)
    bumps = np.zeros((121, 121), dtype=np.float32)
    bumps[::4, ::4] = 0.08
    ground = Heightfield(bumps + np.float32(0.5), base.cell / 3)
    overhead = frustum(SemanticClass.FOLIAGE, (0.0, 0.0, 1.0), (0.5, 0.5), 1.0)
    config = TruthConfig(body_height=0.7)
    rough = build_truth(ground, (overhead,), config)
    assert (rough.reason == Reason.STEP).mean() > 0.5
    even = build_truth(ground, (overhead,), config, None, base)
    assert not (even.reason == Reason.STEP).any()
    assert even.reason_at(0.0, 0.0) == Reason.VEGETATION
    assert build_truth(base, (overhead,), config).reason_at(0.0, 0.0) == Reason.FREE


def test_cover_above_the_robots_limit_is_forbidden():
    """A robot that crosses 15 cm drives over 12 cm of grass, one that crosses 8 cm does not."""
    ground = Heightfield(np.zeros((41, 41), dtype=np.float32), 0.25)
    cover = np.zeros((40, 40), dtype=np.uint8)
    cover[20:] = 12
    surface = np.zeros((40, 40), dtype=np.uint8)
    truth = build_truth(ground, (), TruthConfig(), surface, None, cover)
    assert truth.reason_at(2.0, 0.0) == Reason.FREE
    world = World("made", 0, 0.0, ground, surface, (), (), truth, cover=cover)
    lower = with_vegetation_limit(world, 0.08).truth
    assert lower.reason_at(2.0, 0.0) == Reason.VEGETATION
    assert lower.reason_at(-2.0, 0.0) == Reason.FREE


def test_a_kerb_is_as_high_as_it_stands_above_its_lower_side():
    """Flush with a strip that rises with a slope, it is low by its outer face, not free."""
    lines = np.linspace(-5.0, 5.0, 101)
    rise = 0.3 * lines + np.where(lines > 0.0, 0.07, 0.0)
    ground = Heightfield(np.tile(rise[:, None], (1, 101)).astype(np.float32), 0.1)
    edges = [(x, y, 0.3 * x + z) for x in (-0.11, 0.1) for y in (0.0, 0.5) for z in (-0.05, 0.07)]
    kerb = hull(SemanticClass.KERB, np.array(edges))
    truth = build_truth(ground, (kerb,), TruthConfig(max_step=0.05))
    assert truth.reason_at(0.0, 0.25) == Reason.LOW
    rock = hull(SemanticClass.ROCK, np.array(edges))
    assert build_truth(ground, (rock,), TruthConfig()).reason_at(0.0, 0.25) != Reason.LOW
