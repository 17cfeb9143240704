"""Solids: parts lie where poses put them, as large as their shapes."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from tests.support.mesh_files import angle_bar, block, save, torus
from worlds.sdf.elements import Element, SdfError
from worlds.sdf.meshes import Surface, normals, volume
from worlds.sdf.shapes import (
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    Heightmap,
    Mesh,
    Plane,
    Polyline,
    Sphere,
)
from worlds.sdf.solids import parts_of
from worlds.sdf.values import IDENTITY, pose_of
from worlds.sdf.world import Solid

SQUARE = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))
HOLE = ((0.5, 0.5), (1.0, 0.5), (1.0, 1.5), (0.5, 1.5))


def solid(shape, text=""):
    """Return a shape at a pose."""
    return Solid("m::l::c", shape, pose_of(Element("pose", {}, Path("a"), 1, text=text)), "here")


@pytest.mark.parametrize(
    ("shape", "size", "content"),
    [
        (Box((1.0, 2.0, 3.0)), (1, 2, 3), 6.0),
        (Cylinder(0.5, 3.0), (1, 1, 3), 0.75 * np.pi),
        (Sphere(0.5), (1, 1, 1), np.pi / 6),
        (Capsule(0.5, 2.0), (1, 1, 3), np.pi * (0.5 + 1 / 6)),
        (Ellipsoid((0.5, 1.0, 1.5)), (1, 2, 3), np.pi),
        (Polyline((SQUARE,), 3.0), (2, 2, 3), 12.0),
        (Plane((0.0, 0.0, 1.0), (2.0, 3.0)), (2, 3, 0.1), 0.6),
    ],
)
def test_a_part_is_as_large_as_its_shape(shape, size, content):
    """Extents along the axes are exact, contents too but for the few per cent that sides cut."""
    points = np.concatenate(parts_of(solid(shape), 1e-3).convex)
    np.testing.assert_allclose(np.ptp(points, axis=0), size, atol=1e-9)
    found = sum(ConvexHull(part).volume for part in parts_of(solid(shape), 1e-3).convex)
    assert found == pytest.approx(content, rel=0.02)
    assert found <= content + 1e-9


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_sides_cut_round_shapes_by_the_tolerance_at_most(tolerance):
    """The middles of sides are as far from the axis as the radius, less the tolerance."""
    (points,) = parts_of(solid(Cylinder(0.7, 1.0)), tolerance).convex
    ring = points[points[:, 2] > 0, :2]
    np.testing.assert_allclose(np.hypot(*ring.T), 0.7)
    middles = (ring + np.roll(ring, -1, axis=0)) / 2
    assert 0.7 - tolerance <= np.hypot(*middles.T).min() < 0.7 - tolerance / 2


@pytest.mark.parametrize("shape", [Sphere(0.7), Capsule(0.7, 1.0)])
def test_faces_cut_balls_by_the_tolerance_at_most(shape):
    """The faces of the hull are as near to the middle as the radius less the tolerance."""
    (points,) = parts_of(solid(shape), 0.01).convex
    near = -ConvexHull(points).equations[:, 3].max()
    assert 0.69 - 1e-9 <= near < 0.7


def test_parts_are_where_the_pose_puts_them():
    """A box on its side, a metre up."""
    (points,) = parts_of(solid(Box((1.0, 2.0, 3.0)), f"0 0 1 {np.pi / 2} 0 0"), 0.01).convex
    np.testing.assert_allclose(points.min(axis=0), [-0.5, -1.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(points.max(axis=0), [0.5, 1.5, 2.0], atol=1e-12)


def test_a_polyline_stands_on_its_origin():
    """From z = 0 to its height, holes left out."""
    convex = parts_of(solid(Polyline((SQUARE, HOLE), 2.0)), 0.01).convex
    points = np.concatenate(convex)
    assert (points[:, 2].min(), points[:, 2].max()) == (0.0, 2.0)
    assert sum(ConvexHull(part).volume for part in convex) == pytest.approx(7.0)


def test_a_polyline_that_crosses_itself_is_refused():
    """The error says where."""
    bow = Polyline((((0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0)),), 1.0)
    with pytest.raises(SdfError, match=r"^here: expected outlines that do not cross"):
        parts_of(solid(bow), 0.01)


@pytest.mark.parametrize("normal", [(1, 0, 0), (0, -2, 0), (0, 0, -1), (1, 1, 0), (1, 2, 3)])
def test_a_plane_is_a_plate_behind_its_front(normal):
    """Its front goes through the origin, and the plate is 10 cm thick."""
    (points,) = parts_of(solid(Plane(tuple(map(float, normal)), (2.0, 3.0))), 0.01).convex
    depths = points @ np.array(normal) / np.linalg.norm(normal)
    np.testing.assert_allclose(sorted(depths), [-0.1] * 4 + [0.0] * 4, atol=1e-12)
    assert ConvexHull(points).volume == pytest.approx(0.6)


@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (2.0, 1.0, 0.5), (-1.0, 1.0, 1.0)])
def test_meshes_are_scaled_and_stay_outside_out(tmp_path, scale):
    """A mirrored mesh looks outwards, too; what is not convex stays a surface."""
    path = save(tmp_path / "a.ply", angle_bar())
    found = parts_of(solid(Mesh(path, scale), "1 0 0 0 0 0"), 0.01)
    assert found.convex == []
    (surface,) = found.surfaces
    assert volume(surface) == pytest.approx(0.36 * abs(np.prod(scale)))
    sides = np.sort([1.0, 1.0 + scale[0]])
    np.testing.assert_allclose(surface.vertices[:, 0].min(), sides[0])
    np.testing.assert_allclose(surface.vertices[:, 0].max(), sides[1])


def test_a_mirrored_sheet_looks_the_mirrored_way(tmp_path):
    """An open surface has no inside that tells; a triangle that faced x faces away from it."""
    corners = np.array([(0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
    path = save(tmp_path / "a.ply", Surface(corners, np.array([[0, 1, 2]])))
    for x in (1.0, -1.0):
        (found,) = parts_of(solid(Mesh(path, (x, 1.0, 1.0))), 0.01).surfaces
        np.testing.assert_allclose(normals(found), [(x, 0.0, 0.0)])


def test_convex_meshes_are_solids(tmp_path):
    """A block in a file is as good as a box; a ring is none."""
    path = save(tmp_path / "a.stl", block(1.0, 2.0, 3.0))
    found = parts_of(solid(Mesh(path, (1.0, 1.0, 1.0)), f"0 0 0 0 0 {np.pi / 2}"), 0.01)
    assert found.surfaces == []
    np.testing.assert_allclose(np.ptp(found.convex[0], axis=0), [2, 1, 3])
    ring = save(tmp_path / "b.ply", torus())
    assert len(parts_of(solid(Mesh(ring, (1.0, 1.0, 1.0))), 0.01).surfaces) == 1


def test_a_heightmap_has_no_parts():
    """It is ground, not a solid."""
    shape = Heightmap(Path("a.png"), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    assert parts_of(solid(shape), 0.01) == ([], [])
    assert solid(shape).pose is IDENTITY
