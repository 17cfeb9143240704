"""Shapes of collisions: each with its measures, and every way in which one can be none."""

from pathlib import Path

import pytest

from tests.support.sdf_worlds import CUBE, PLANE, read, solid, write
from worlds.sdf.elements import SdfError
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
    scaled,
)

CORNERS = "<point>0 0</point><point>2 0</point><point>0 1</point>"
TRIANGLE = ((0.0, 0.0), (2.0, 0.0), (0.0, 1.0))


@pytest.mark.parametrize(
    ("text", "shape"),
    [
        ("<box><size>1 2 3</size></box>", Box((1.0, 2.0, 3.0))),
        ("<cylinder><radius>2</radius><length>3</length></cylinder>", Cylinder(2.0, 3.0)),
        ("<capsule><radius>2</radius><length>3</length></capsule>", Capsule(2.0, 3.0)),
        ("<sphere><radius>.5</radius></sphere>", Sphere(0.5)),
        ("<ellipsoid><radii>1 2 3</radii></ellipsoid>", Ellipsoid((1.0, 2.0, 3.0))),
        (PLANE, Plane((0.0, 0.0, 1.0), (100.0, 100.0))),
        ("<plane><normal>1 0 0</normal></plane>", Plane((1.0, 0.0, 0.0), (1.0, 1.0))),
        (f"<polyline>{CORNERS}<height>1</height></polyline>", Polyline((TRIANGLE,), 1.0)),
        (
            f"<polyline>{CORNERS}<point>0 0</point><height>1</height></polyline>",
            Polyline((TRIANGLE,), 1.0),
        ),
        (
            f"<polyline>{CORNERS}<height>1</height></polyline>" * 2,
            Polyline((TRIANGLE, TRIANGLE), 1.0),
        ),
    ],
)
def test_shapes_have_their_measures(tmp_path, text, shape):
    """Each kind as the file says it; a polyline that comes back to its begin is closed once."""
    (found,) = read(tmp_path, solid("m", text)).solids
    assert found.shape == shape
    assert found.name == "m::l::c"
    assert found.where == f'{tmp_path / "test.world"}:3: <collision name="c">'


def test_meshes_and_heightmaps_name_their_files(tmp_path):
    """With scale, and with extent and position; what is not said is 1 and 0."""
    for name in ("a.stl", "h.png"):
        write(tmp_path / "f" / name, "")
    uri = "<uri>model://f/{}</uri>".format
    for text, shape in (
        (f"<mesh>{uri('a.stl')}</mesh>", Mesh(tmp_path / "f/a.stl", (1.0, 1.0, 1.0))),
        (
            f"<mesh>{uri('a.stl')}<scale>1 -2 3</scale></mesh>",
            Mesh(tmp_path / "f/a.stl", (1.0, -2.0, 3.0)),
        ),
        (
            f"<heightmap>{uri('h.png')}<size>9 8 7</size><pos>1 2 3</pos></heightmap>",
            Heightmap(tmp_path / "f/h.png", (9.0, 8.0, 7.0), (1.0, 2.0, 3.0)),
        ),
    ):
        assert read(tmp_path, solid("m", text)).solids[0].shape == shape


def test_a_part_of_a_mesh_is_the_whole_mesh_with_a_warning(tmp_path):
    """Files do not name their parts alike."""
    write(tmp_path / "a.stl", "")
    text = "<mesh><uri>a.stl</uri><submesh><name>x</name></submesh></mesh>"
    (warning,) = read(tmp_path, solid("m", text)).warnings
    assert "the whole mesh was taken" in warning


@pytest.mark.parametrize(
    "text", ["<image><uri>a.png</uri></image>", "<cone><radius>1</radius></cone>"]
)
def test_shapes_that_are_not_read_are_left_out_with_a_warning(tmp_path, text):
    """Shapes of SDF, but not of this reader."""
    world = read(tmp_path, solid("m", text), solid("n"))
    assert len(world.solids) == 1
    assert "are left out" in world.warnings[0]


def test_an_empty_shape_is_none(tmp_path):
    """Without a warning: it says itself that nothing is there."""
    world = read(tmp_path, solid("m", "<empty/>"))
    assert not world.solids
    assert not world.warnings


def test_of_two_shapes_the_first_one_counts(tmp_path):
    """With a warning about the other."""
    world = read(tmp_path, solid("m", CUBE + "\n<sphere><radius>1</radius></sphere>"))
    assert isinstance(world.solids[0].shape, Box)
    assert "test.world:4: <sphere>: a collision has one shape" in world.warnings[0]


@pytest.mark.parametrize(
    ("text", "element", "wrong"),
    [
        ("", "geometry", "expected a shape inside, got none"),
        ("<torus/>", "geometry", "expected a box, cylinder, .* got <torus> on line 3"),
        ("<box/>", "box", "expected <size> inside, got none"),
        ("<box><size>1 2</size></box>", "size", "expected 3 finite numbers, got '1 2'"),
        ("<box><size>1 nan 1</size></box>", "size", "expected 3 finite numbers, got '1 nan 1'"),
        ("<box><size>1 0 1</size></box>", "size", "expected more than 0, got '1 0 1'"),
        ("<cylinder><length>1</length></cylinder>", "cylinder", "expected <radius> inside"),
        ("<cylinder><radius>1</radius></cylinder>", "cylinder", "expected <length> inside"),
        ("<sphere><radius>-1</radius></sphere>", "radius", "expected more than 0, got '-1'"),
        ("<sphere><radius>x</radius></sphere>", "radius", "expected 1 finite number, got 'x'"),
        ("<capsule/>", "capsule", "expected <radius> inside"),
        ("<ellipsoid/>", "ellipsoid", "expected <radii> inside"),
        ("<plane><normal>0 0 0</normal></plane>", "normal", "expected a direction"),
        ("<mesh/>", "mesh", "expected <uri> inside"),
        ("<mesh><uri/></mesh>", "uri", "expected the name of a model or a file"),
        ("<heightmap/>", "heightmap", "expected <uri> inside"),
        ("<polyline><height>1</height></polyline>", "polyline", "expected 3 points or more, got 0"),
        (
            "<polyline><point>0 0</point><point>1 1</point><point>0 0</point></polyline>",
            "polyline",
            "expected 3 points or more, got 2",
        ),
        (f"<polyline>{CORNERS}</polyline>", "polyline", "expected <height> inside"),
        (
            f"<polyline>{CORNERS}<point>1</point><height>1</height></polyline>",
            "point",
            "expected 2 finite numbers, got '1'",
        ),
    ],
)
def test_what_is_no_shape_is_refused(tmp_path, text, element, wrong):
    """The error names file, line and element, and what was expected."""
    with pytest.raises(SdfError, match=rf"test\.world:3: <{element}>: {wrong}"):
        read(tmp_path, solid("m", text))


@pytest.mark.parametrize("name", ["mesh", "heightmap"])
def test_bad_factors_of_files_are_refused(tmp_path, name):
    """A scale of 0, an extent of 0."""
    write(tmp_path / "a.stl", "")
    inside = "<scale>1 0 1</scale>" if name == "mesh" else "<size>1 0 1</size>"
    with pytest.raises(SdfError, match=r":3: <(scale|size)>: expected"):
        read(tmp_path, solid("m", f"<{name}><uri>a.stl</uri>{inside}</{name}>"))


def test_a_collision_without_geometry_is_refused(tmp_path):
    """The error names the collision."""
    text = '<model name="m"><link name="l"><collision name="c"/></link></model>'
    with pytest.raises(SdfError, match=r':3: <collision name="c">: expected <geometry> inside'):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("shape", "wanted"),
    [
        (Box((1.0, 1.0, 1.0)), Box((2.0, 3.0, 4.0))),
        (Cylinder(1.0, 1.0), Cylinder(3.0, 4.0)),
        (Capsule(1.0, 1.0), Capsule(3.0, 4.0)),
        (Sphere(1.0), Sphere(4.0)),
        (Ellipsoid((1.0, 1.0, 1.0)), Ellipsoid((2.0, 3.0, 4.0))),
        (Polyline((TRIANGLE,), 1.0), Polyline((((0.0, 0.0), (4.0, 0.0), (0.0, 3.0)),), 4.0)),
        (Mesh(Path("a"), (1.0, 2.0, 1.0)), Mesh(Path("a"), (2.0, 6.0, 4.0))),
        (Plane((0.0, 0.0, 1.0), (1.0, 1.0)), Plane((0.0, 0.0, 1.0), (1.0, 1.0))),
    ],
)
def test_scales_come_on_top_of_measures(shape, wanted):
    """Along x, y and z; what is round stays round, by the larger factor."""
    assert scaled(shape, (2.0, 3.0, 4.0)) == wanted
