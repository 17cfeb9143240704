"""Footprints: what of a shape a slab of heights holds, seen from above."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.mesh_files import angle_bar, block, save
from worlds.sdf.elements import Element
from worlds.sdf.footprints import Footprint, facing, footprint, is_ground, is_level
from worlds.sdf.outlines import area
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
from worlds.sdf.values import pose_of
from worlds.sdf.world import Solid

LYING = np.pi / 2
SQUARE = ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))
HOLE = ((0.5, 0.5), (1.0, 0.5), (1.0, 1.5), (0.5, 1.5))


def solid(shape, *numbers):
    """Return a shape at a pose."""
    text = " ".join(map(str, [*numbers, *[0] * (6 - len(numbers))]))
    return Solid("m::l::c", shape, pose_of(Element("pose", {}, Path("a"), 1, text=text)), "here")


def up(x, y, z):
    """Return a plane that faces somewhere."""
    return Plane((x, y, z), (4.0, 4.0))


@pytest.mark.parametrize(
    ("shape", "numbers", "radius"),
    [
        (Cylinder(0.3, 1.0), (1, 2, 0), 0.3),
        (Cylinder(0.3, 1.0), (1, 2, 1.0), 0.3),
        (Cylinder(0.3, 1.0), (1, 2, 1.001), None),
        (Cylinder(0.3, 1.0), (1, 2, -0.451), None),
        (Cylinder(0.3, 1.0), (1, 2, 0, np.pi, 0, 1), 0.3),
        (Sphere(0.5), (1, 2, 0.3, 1, 2, 3), 0.5),
        (Sphere(0.5), (1, 2, 0.8), 0.4),
        (Sphere(0.5), (1, 2, -0.25), 0.4),
        (Sphere(0.5), (1, 2, 1.01), None),
        (Capsule(0.5, 1.0), (1, 2, 0), 0.5),
        (Capsule(0.5, 1.0), (1, 2, 1.3), 0.4),
        (Capsule(0.5, 1.0), (1, 2, 1.51), None),
        (Ellipsoid((9.0, 9.0, 0.1)), (1, 2, 0.7), None),
    ],
)
def test_upright_round_shapes_are_circles(shape, numbers, radius):
    """Of their widest section between 0.05 and 0.5 m, exactly."""
    found = footprint(solid(shape, *numbers), 0.05, 0.5)
    assert found.outlines == ()
    if radius is None:
        assert found == Footprint()
    else:
        np.testing.assert_allclose(found.circles, [(1, 2, radius)])


def test_a_turned_box_is_its_own_outline():
    """A square turned by an eighth of a turn, to the last digit that counts."""
    (found,) = footprint(
        solid(Box((1.0, 1.0, 1.0)), 1, 0, 0.5, 0, 0, np.pi / 4), 0.05, 0.5
    ).outlines
    half = np.sqrt(0.5)
    wanted = [(1 - half, 0), (1, -half), (1 + half, 0), (1, half)]
    np.testing.assert_allclose(sorted(found), sorted(wanted), atol=1e-6)


@pytest.mark.parametrize("z", [0.0, 0.54, -0.44])
def test_a_box_counts_as_far_as_it_is_in_the_slab(z):
    """It is there if any of it is."""
    assert footprint(solid(Box((1.0, 1.0, 1.0)), 0, 0, z), 0.05, 0.5).outlines
    assert not footprint(
        solid(Box((1.0, 1.0, 1.0)), 0, 0, z + np.sign(z - 0.1)), 0.05, 0.5
    ).outlines


def test_what_lies_is_as_wide_as_it_is_long():
    """A cylinder on its side: a rectangle of its length, as wide as the slab sees of it."""
    (found,) = footprint(solid(Cylinder(0.5, 3.0), 0, 0, 0.5, 0, LYING, 0), 0.5, 2.0).outlines
    x, y = np.array(found).T
    assert np.ptp(x) == pytest.approx(3.0, abs=1e-6)
    assert np.ptp(y) == pytest.approx(1.0, abs=2e-3)
    (low,) = footprint(solid(Cylinder(0.5, 3.0), 0, 0, 0.5, 0, LYING, 0), 0.05, 0.1).outlines
    # A millimetre along the face's normal, which slants here, on both sides.
    assert np.ptp(np.array(low)[:, 1]) == pytest.approx(0.6, abs=2e-3 / 0.6)


@pytest.mark.parametrize(("lean", "upright"), [(0.0005, True), (0.002, False)])
def test_what_leans_by_less_than_a_millimetre_is_upright(lean, upright):
    """As saved simulations leave things; what leans more over its length is an outline."""
    found = footprint(solid(Cylinder(0.1, 1.0), 0, 0, 0.5, lean, 0, 0), 0.05, 0.5)
    assert bool(found.circles) is upright
    assert not footprint(solid(Cylinder(0.1, 5.0), 0, 0, 0.5, lean, 0, 0), 0.05, 0.5).circles
    (box,) = footprint(solid(Box((1.0, 1.0, 1.0)), 0, 0, 0.5, lean, 0, 0), 0.05, 0.5).outlines
    assert (len(box) == 4 and area(box) == pytest.approx(1.0, abs=1e-9)) is upright


def test_a_polyline_keeps_its_holes():
    """Outlines counter-clockwise, holes clockwise, moved and turned; upside down, too."""
    shape = Polyline((SQUARE, HOLE), 1.0)
    found = footprint(solid(shape, 5, 0, 0, 0, 0, LYING), 0.05, 0.5)
    assert [area(each) for each in found.outlines] == pytest.approx([4.0, -0.5])
    np.testing.assert_allclose(found.bounds, (3, 0, 5, 2), atol=1e-9)
    turned = footprint(solid(shape, 0, 0, 0.7, np.pi, 0, 0), 0.05, 0.5)
    assert [area(each) for each in turned.outlines] == pytest.approx([4.0, -0.5])
    assert footprint(solid(shape, 0, 0, 1), 0.05, 0.5) == Footprint()
    assert footprint(solid(shape, 0, 0, 0, np.pi, 0, 0), 0.05, 0.5) == Footprint()


def test_a_polyline_on_its_side_is_what_is_seen_of_it():
    """A wall from an outline that lies."""
    found = footprint(solid(Polyline((SQUARE,), 0.2), 0, 0, 0, LYING, 0, 0), 0.05, 0.5)
    x0, y0, x1, y1 = found.bounds
    assert (x1 - x0, y1 - y0) == pytest.approx((2.0, 0.2), abs=1e-6)


def test_meshes_are_outlines(tmp_path):
    """A block like a box, an angle with its dent."""
    box = Mesh(save(tmp_path / "a.stl", block(1.0, 2.0, 1.0)), (1.0, 1.0, 1.0))
    (found,) = footprint(solid(box, 0, 0, 0.5), 0.05, 0.5).outlines
    assert (len(found), area(found)) == (4, pytest.approx(2.0))
    bar = Mesh(save(tmp_path / "b.ply", angle_bar()), (1.0, 1.0, 1.0))
    (found,) = footprint(solid(bar, 0, 0, 0), 0.05, 0.5).outlines
    assert (len(found), area(found)) == (6, pytest.approx(0.36))


def test_ground_has_no_footprint_and_upright_planes_have():
    """Planes and heightmaps are what things stand on; a wall is as long as it is drawn."""
    heights = Heightmap(Path("a.png"), (1.0, 1.0, 1.0), (0.0, 0.0, 0.0))
    for shape, ground, level in (
        (up(0, 0, 1), True, True),
        (up(0, 0, 2), True, True),
        (up(0.0005, 0, 1), True, True),
        (up(0.1, 0, 1), True, False),
        (up(0, 0, -1), True, False),
        (up(1, 0, 0), False, False),
        (up(1, 0, 0.05), False, False),
        (heights, True, False),
        (Box((1.0, 1.0, 1.0)), False, False),
    ):
        each = solid(shape, 0, 0, 0.2)
        assert (is_ground(each), is_level(each)) == (ground, level)
        assert (footprint(each, 0.05, 0.5) == Footprint()) is ground
    x0, y0, x1, y1 = footprint(solid(up(1, 0, 0)), 0.05, 0.5).bounds
    np.testing.assert_allclose((x0, y0, x1, y1), (-0.1, -2, 0, 2), atol=1e-6)


def test_a_plane_faces_where_its_pose_turns_it():
    """In the world, with length 1."""
    np.testing.assert_allclose(
        facing(solid(up(0, 0, 3), 0, 0, 0, LYING, 0, 0)), (0, -1, 0), atol=1e-9
    )


def test_bounds_hold_everything():
    """Circles and outlines; nothing has none."""
    found = Footprint(((1.0, 0.0, 0.5),), ([(0.0, 0.0), (-1.0, 3.0)],))
    assert found.bounds == (-1.0, -0.5, 1.5, 3.0)
    assert Footprint().bounds is None
