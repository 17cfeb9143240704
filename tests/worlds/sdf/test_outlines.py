"""Outlines: known areas, and slabs of solids that agree with a sample of places inside."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.mesh_files import angle_bar, block, occupied, together, torus
from worlds.rooms.edges import edge_clearances, outline_edges
from worlds.sdf.meshes import Surface
from worlds.sdf.outlines import (
    area,
    convex_in_slab,
    enclosed,
    hull,
    oriented,
    surface_in_slab,
    triangulated,
)

SQUARE = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]
HOLE = [(0.5, 0.5), (1.0, 0.5), (1.0, 1.5), (0.5, 1.5)]
BAR = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)]


def turned(surface, seed):
    """Return a surface turned at random about the origin; seed 0 leaves it."""
    if seed == 0:
        return surface
    matrix = Rotation.random(random_state=seed).as_matrix()
    return surface._replace(vertices=surface.vertices @ matrix.T)


def clearance(outlines, points):
    """Return the distance of points to outlines, negative inside [m]."""
    found = np.full(len(points), np.inf)
    edge_clearances(points, outline_edges(outlines), found)
    return found


def test_areas_are_signed():
    """Counter-clockwise is positive."""
    assert area(SQUARE) == 4.0
    assert area(SQUARE[::-1]) == -4.0


def test_a_hull_is_the_smallest_outline_around_all_points():
    """Points inside and on its sides are no corners; the order of points does not count."""
    points = np.array([*SQUARE, (1, 1), (1, 0), (2, 1.5), (0, 0)])
    for seed in range(5):
        found = hull(np.random.default_rng(seed).permutation(points))
        assert sorted(found) == sorted(SQUARE)
        assert area(found) == 4.0


def test_a_hull_of_points_on_a_line_has_two_corners():
    """A single place has one."""
    assert sorted(hull(np.array([(1, 1), (0, 0), (2, 2), (0.5, 0.5)]))) == [(0, 0), (2, 2)]
    assert hull(np.array([(1.0, 2.0), (1.0, 2.0)])) == [(1.0, 2.0)]


def test_holes_run_clockwise():
    """Whichever way they came, and what is in a hole is solid again."""
    island = [(0.6, 0.6), (0.9, 0.6), (0.9, 0.9)]
    for outlines in ([SQUARE, HOLE, island], [island, SQUARE[::-1], HOLE[::-1]]):
        found = {len(each): area(each) > 0 for each in oriented(outlines)}
        signs = [area(each) > 0 for each in oriented(outlines) if len(each) == 4]
        assert found[3]
        assert sorted(signs) == [False, True]
    points = np.array([(1.5, 1.0), (0.6, 1.2), (0.85, 0.7), (3.0, 1.0)])
    assert enclosed(points, [SQUARE, HOLE, island]).tolist() == [True, False, True, False]


@pytest.mark.parametrize(
    ("outlines", "wanted"),
    [
        ([SQUARE], 4.0),
        ([SQUARE, HOLE], 3.5),
        ([BAR], 4.0),
        ([BAR[::-1], [(5, 5), (6, 5), (6, 6)]], 4.5),
    ],
)
def test_triangles_fill_outlines_and_nothing_else(outlines, wanted):
    """Their areas add up to that of the outlines without holes, and their middles are inside."""
    found = triangulated(outlines)
    assert sum(abs(area(each)) for each in found.tolist()) == pytest.approx(wanted)
    assert enclosed(found.mean(axis=1), outlines).all()


def test_triangles_keep_to_edges_that_delaunay_would_not_have():
    """A comb of long thin teeth: the area is that of the comb."""
    comb = [(0.0, -1.0), (10.0, -1.0)]
    comb += [(x, y) for k in range(10, 0, -1) for x, y in ((k, 5.0), (k - 0.5, 0.0))]
    found = triangulated([comb])
    assert sum(abs(area(each)) for each in found.tolist()) == pytest.approx(abs(area(comb)))


@pytest.mark.parametrize(
    "outlines",
    [
        [[(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)]],
        [SQUARE, [(1.0, 1.0), (3.0, 1.0), (3.0, 3.0), (1.0, 3.0)]],
        [[(0.0, 0.0), (1.0, 1.0), (2.0, 2.0)]],
    ],
)
def test_outlines_that_cross_or_enclose_nothing_have_no_triangles(outlines):
    """A bow tie, two squares that overlap, a line."""
    assert triangulated(outlines) is None


def test_the_slab_of_an_upright_box_is_its_base():
    """Where it is between the heights; elsewhere it is nothing."""
    box = block(2.0, 1.0, 1.0).vertices
    for low, high in ((-0.1, 0.1), (-9, 9), (0.4, 9), (0.5, 0.6)):
        assert area(convex_in_slab(box, low, high)) == pytest.approx(2.0)
    assert convex_in_slab(box, 0.6, 0.9) == []


@pytest.mark.parametrize("angle", [0.1, 0.5, 1.0, 2.0])
def test_the_slab_of_a_turned_box_has_four_corners(angle):
    """Cuts through its sides leave no corners on them."""
    c, s = np.cos(angle), np.sin(angle)
    points = block(1.0, 0.7, 1.0).vertices @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
    found = convex_in_slab(points, -0.45, 0.1)
    assert len(found) == 4
    assert area(found) == pytest.approx(0.7, abs=1e-5)


def test_the_slab_of_a_leaning_box_is_cut_at_its_heights():
    """A square bar on its edge: as wide as it is between the heights, and no wider."""
    bar = block(1.0, np.sqrt(2), np.sqrt(2))
    c = np.sqrt(0.5)
    points = bar.vertices @ np.array([[1, 0, 0], [0, c, -c], [0, c, c]]).T
    for low, high, wide in ((-0.2, 0.1, 2.0), (0.25, 0.5, 1.5), (-0.75, -0.5, 1.0)):
        assert area(convex_in_slab(points, low, high)) == pytest.approx(wide)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("make", [torus, angle_bar, lambda: block(1.2, 0.5, 0.8)])
def test_the_slab_of_a_closed_surface_is_where_it_is_solid_at_some_height(make, seed):
    """Random places are inside of the outlines if they are inside of the solid at one of many
    heights; nearer than 2 cm to an outline either is right.
    """
    rng, surface = np.random.default_rng(seed), turned(make(), seed)
    low, high = np.sort(rng.uniform(-1.0, 1.0, 2))
    points = rng.uniform(-1.6, 1.6, (800, 2))
    found = clearance(surface_in_slab(surface, low, high), points)
    heights = np.repeat(np.linspace(low, high, 40), len(points))[:, None]
    inside = occupied(surface, np.hstack([np.tile(points, (40, 1)), heights]))
    solid = inside.reshape(40, -1).any(axis=0)
    assert ((found < 0) == solid)[abs(found) > 0.02].all()


def test_edges_inside_of_a_surface_are_gone():
    """An upright bar's slab is its section, without a corner more than it has."""
    (found,) = surface_in_slab(angle_bar(1.0, 0.2, 1.0), 0.1, 0.5)
    assert len(found) == 6
    assert area(found) == pytest.approx(0.36)
    (whole,) = surface_in_slab(angle_bar(1.0, 0.2, 1.0), -0.5, 2.0)
    assert sorted(whole) == sorted(found)


def test_a_surface_at_the_heights_themselves_is_in_the_slab_once():
    """A face level with the lower height is as good as one above it."""
    (found,) = surface_in_slab(angle_bar(1.0, 0.2, 1.0), 0.0, 0.5)
    assert area(found) == pytest.approx(0.36)


def test_an_open_surface_is_its_faces_and_upright_ones_are_walls():
    """A box without lid and floor is four walls, a sheet an outline."""
    box = block(2.0, 1.0, 1.0)
    level = abs(np.ptp(box.vertices[box.triangles][:, :, 2], axis=1)) < 1e-9
    tube = Surface(box.vertices, box.triangles[~level])
    walls = surface_in_slab(tube, -0.1, 0.1)
    spans = np.array([np.abs(np.subtract(*each)) for each in walls])
    np.testing.assert_allclose(sorted(spans.tolist()), [[0, 1], [0, 1], [2, 0], [2, 0]])
    found = clearance(walls, np.array([(0.0, 0.0), (0.0, 2.0)]))
    np.testing.assert_allclose(found, [0.5, 1.5])
    (sheet,) = surface_in_slab(Surface(box.vertices, box.triangles[level][:2]), -1.0, 1.0)
    assert area(sheet) == pytest.approx(2.0)


def test_a_slope_is_solid_where_it_is_between_the_heights():
    """An open ramp of one metre's rise over two: a metre of it is within half a metre."""
    vertices = np.array([(0, 0, 0), (2, 0, 1), (2, 1, 1), (0, 1, 0)], dtype=float)
    ramp = Surface(vertices, np.array([[0, 1, 2], [0, 2, 3]]))
    (found,) = surface_in_slab(ramp, 0.25, 0.75)
    assert area(found) == pytest.approx(1.0)
    assert min(found) == (0.5, 0.0)
    assert surface_in_slab(ramp, 1.5, 2.0) == []


def test_walls_on_one_line_are_put_together():
    """Those that overlap or touch; a gap stays, and so do other directions."""
    slant = np.array([3.0, 4.0, 0.0]) / 5
    spans = [(0, 2), (1, 3), (3, 4), (5, 6)]
    corners = [(a * slant + (0, 0, z), b * slant + (0, 0, z)) for a, b in spans for z in (0, 1)]
    vertices = np.array(corners).reshape(-1, 4, 3)
    sheets = [Surface(each, np.array([[0, 1, 3], [0, 3, 2]])) for each in vertices]
    crossing = Surface(vertices[0][:, [1, 0, 2]], np.array([[0, 1, 3], [0, 3, 2]]))
    found = surface_in_slab(together(*sheets, crossing), 0.4, 0.6)
    lengths = sorted(float(np.hypot(*np.subtract(*each))) for each in found)
    np.testing.assert_allclose(lengths, [1.0, 2.0, 4.0], atol=1e-5)
    np.testing.assert_allclose(max(map(max, found)), 6 * slant[:2], atol=1e-5)
