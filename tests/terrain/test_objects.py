"""Objects: closed convex solids with outward faces, of known sizes."""

import numpy as np
import pytest

from terrain.classes import SemanticClass
from terrain.objects import bounds, box, ellipsoid, frustum, log, rock, rod

RNG = np.random.default_rng(0)
OBJECTS = {
    "frustum": frustum(SemanticClass.TRUNK, (1, 2, 0), (0.3, 0.2), 2.0),
    "box": box(SemanticClass.WALL, (0, 0, 1), (4, 0.4, 2), yaw=0.3),
    "ellipsoid": ellipsoid(SemanticClass.FOLIAGE, (1, 1, 4), (1, 1.5, 0.8)),
    "rock": rock((0, 0, 0), (0.3, 0.4, 0.2), RNG),
    "log": log((0, 0, 0.2), (3, 1, 0.3), 0.2),
    "rod": rod(SemanticClass.TRUNK, (0, 0, 0), (0.3, -0.2, 2), 0.05),
    "upright rod": rod(SemanticClass.TRUNK, (0, 0, 0), (0, 0, 2), 0.05),
    "falling rod": rod(SemanticClass.ROOT, (0, 0, 2), (1, 0.5, 0), 0.05),
}


@pytest.mark.parametrize("name", OBJECTS)
def test_faces_look_outwards_and_close_the_solid(name):
    """Normals point away from the centre and add up to nothing."""
    each = OBJECTS[name]
    corners = each.vertices[each.triangles].astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    centre = each.vertices.mean(axis=0)
    assert (np.einsum("ij,ij->i", normals, corners.mean(axis=1) - centre) > 0).all()
    np.testing.assert_allclose(normals.sum(axis=0), 0.0, atol=1e-5)  # A closed surface.


def test_a_box_has_its_volume():
    """The volume inside of the triangles is the product of the edges."""
    each = OBJECTS["box"]
    corners = each.vertices[each.triangles].astype(np.float64)
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(4 * 0.4 * 2, rel=1e-5)


def test_a_box_turns_counter_clockwise():
    """A quarter turn swaps the edges; an eighth moves the corner on +x towards +y."""
    quarter = box(SemanticClass.WALL, (1, 2, 3), (4, 2, 1), yaw=np.pi / 2).vertices
    np.testing.assert_allclose(quarter.min(axis=0), [0, 0, 2.5], atol=1e-6)
    np.testing.assert_allclose(quarter.max(axis=0), [2, 4, 3.5], atol=1e-6)
    beam = box(SemanticClass.WALL, (0, 0, 0), (4, 0.1, 1), yaw=np.pi / 6).vertices
    assert beam[beam[:, 0].argmax(), 1] == pytest.approx(2 * np.sin(np.pi / 6), abs=0.1)


def test_objects_have_their_sizes():
    """Extents are those asked for: radii, heights, axis and thickness."""
    cone = frustum(SemanticClass.TRUNK, (1, 2, 3), (0.3, 0.2), 2.0, sides=8).vertices
    np.testing.assert_allclose(np.hypot(cone[:8, 0] - 1, cone[:8, 1] - 2), 0.3, rtol=1e-5)
    np.testing.assert_allclose(np.hypot(cone[8:, 0] - 1, cone[8:, 1] - 2), 0.2, rtol=1e-5)
    assert (cone[:8, 2] == 3).all()
    assert (cone[8:, 2] == 5).all()
    egg = ellipsoid(SemanticClass.FOLIAGE, (1, 1, 4), (1, 1.5, 0.8)).vertices
    np.testing.assert_allclose(np.ptp(egg, axis=0), [2, 3, 1.6], rtol=1e-5)
    trunk = log((0, 0, 0.2), (3, 0, 0.2), 0.2).vertices
    np.testing.assert_allclose(trunk.min(axis=0), [0, -0.2, 0.0], atol=1e-6)
    np.testing.assert_allclose(trunk.max(axis=0), [3, 0.2, 0.4], atol=1e-6)


def test_bounds_are_those_of_each_object():
    """Least and greatest coordinates, object by object; none of no objects."""
    lows, highs = bounds(tuple(OBJECTS.values()))
    for k, each in enumerate(OBJECTS.values()):
        np.testing.assert_array_equal(lows[k], each.vertices.min(axis=0))
        np.testing.assert_array_equal(highs[k], each.vertices.max(axis=0))
    assert [end.shape for end in bounds(())] == [(0, 3), (0, 3)]


def test_objects_of_one_shape_share_triangles_that_nobody_changes():
    """Triangles of frusta with as many sides are one read-only array."""
    one, other = (frustum(SemanticClass.TRUNK, (x, 0, 0), (0.3, 0.2), 1.0, 6) for x in (0, 5))
    assert one.triangles is other.triangles
    assert not one.triangles.flags.writeable
    assert one.vertices[:, 0].max() < other.vertices[:, 0].min()


def test_a_rod_is_round_about_its_axis():
    """Corners are at the radius from it, at either end; a level one of 8 sides has one on top."""
    start, end = np.array([1.0, 2.0, 0.5]), np.array([2.0, 1.0, 2.5])
    each = rod(SemanticClass.TRUNK, start, end, 0.04)
    axis = (end - start) / np.linalg.norm(end - start)
    for corners, middle in ((each.vertices[:6], start), (each.vertices[6:], end)):
        away = corners - middle
        np.testing.assert_allclose(np.linalg.norm(away, axis=1), 0.04, rtol=1e-4)
        np.testing.assert_allclose(away @ axis, 0.0, atol=1e-6)
    level = rod(SemanticClass.ROOT, (0, 0, 1), (1, 1, 1), 0.04, sides=8)
    assert level.semantic is SemanticClass.ROOT
    assert level.vertices[:, 2].max() == pytest.approx(1.04)
