"""Geometries of Collada: triangles, polygons as fans, and files that contradict themselves."""

import numpy as np
import pytest

from tests.support.collada_files import INPUT, NAMESPACE, geometry, triangles
from worlds.sdf.collada_geometry import Ids, triangles_of
from worlds.sdf.elements import SdfError, read_xml

POINTS = np.array([(0, 0, 0), (2, 0, 0), (3, 1, 0), (2, 2, 0), (0, 2, 0)], dtype=float)
VERTEX = INPUT.format(name="g", offset=0)
FAN = [(0, 1, 2), (0, 2, 3), (0, 3, 4)]


def read(folder, text):
    """Return the triangles of the first geometry in a file."""
    path = folder / "a.dae"
    path.write_text(f'<COLLADA xmlns="{NAMESPACE}">\n{text}\n</COLLADA>', encoding="utf-8")
    root = read_xml(path, frozenset({"extra"}))
    return triangles_of(root.children[0], Ids(root))


def polylist(counts, indices):
    """Return polygons with their numbers of corners."""
    return f"<polylist>{VERTEX}<vcount>{counts}</vcount><p>{indices}</p></polylist>"


@pytest.mark.parametrize(
    "primitives",
    [
        triangles("g", FAN),
        triangles("g", FAN[:1]) + triangles("g", FAN[1:]),
        polylist("5", "0 1 2 3 4"),
        polylist("3 4", "0 1 2 0 2 3 4"),
        f"<polygons>{VERTEX}<p>0 1 2 3</p><p>0 3 4</p></polygons>",
        polylist("2 5 0", "0 1 0 1 2 3 4"),
    ],
)
def test_every_kind_of_faces_gives_the_same_triangles(tmp_path, primitives):
    """Polygons become fans about their first corner; what has two corners has no area."""
    lines = f"<lines>{VERTEX}<p>0 1</p></lines><extra>of a program</extra>"
    found = read(tmp_path, geometry("g", POINTS, lines, primitives))
    np.testing.assert_array_equal(found, POINTS[FAN])


@pytest.mark.parametrize(
    "empty", ["", "<triangles/>", f"<triangles>{VERTEX}<p/></triangles>", polylist("", "")]
)
def test_a_geometry_may_be_empty(tmp_path, empty):
    """It has no triangles."""
    assert read(tmp_path, geometry("g", POINTS, empty)).shape == (0, 3, 3)


def test_positions_may_stand_between_other_numbers(tmp_path):
    """The accessor says where the first one is and how far they are apart."""
    text = geometry("g", np.r_[7.0, 7.0, np.c_[POINTS, np.full((5, 1), 9.0)].ravel()])
    text = text.replace('count="7" stride="3"', 'count="5" stride="4" offset="2"')
    found = read(tmp_path, text.replace("</mesh>", triangles("g", FAN) + "</mesh>"))
    np.testing.assert_array_equal(found, POINTS[FAN])


@pytest.mark.parametrize(
    ("old", "new", "wrong"),
    [
        ("0 0 1 0 2 0", "0 0 1 0 5 0", "<triangles>: expected indices of 5 vertices, got 0 to 5"),
        ("0 0 1 0 2 0", "0 0 1 0 -1 0", "expected indices of 5 vertices, got -1 to 4"),
        (
            "0 0 1 0 2 0",
            "0 0 1 0 2",
            "expected as many indices as 6 corners of 2 each need, got 17",
        ),
        ("0 0 1 0 2 0", "0 0 1 0 2.5 0", "<p>: expected numbers, got others: .*2.5"),
        ("0 0 1 0 2 0", f"0 0 1 0 {10**30} 0", "<p>: expected numbers, got others"),
        (">0 0 0 2", ">0 nan 0 2", "<float_array>: expected finite numbers, got others"),
        (">0 0 0 2", ">0 O 0 2", "<float_array>: expected numbers, got others: .*'O'"),
        (">0 0 0 2", ">0 0 2", "<accessor>: expected 5 positions .*, got 14 numbers"),
        ('stride="3"', 'stride="2"', "<accessor>: expected 5 positions of 3 numbers or more"),
        ('stride="3"', 'stride="x"', "<accessor>: expected a whole number as stride, got 'x'"),
        ('count="5"', "", "<accessor>: expected a whole number as count, got ''"),
        ('offset="0"', 'offset="-1"', "<input>: expected a whole number as offset, got '-1'"),
        ('semantic="VERTEX"', "", "expected an <input> with the semantic VERTEX, got none"),
        ('semantic="POSITION"', "", "<vertices.*with the semantic POSITION, got none"),
        ('source="#g-vertices"', 'source="#g-array"', "source to name a <vertices> .*'#g-array'"),
        ('source="#g-array"', 'source="#lost"', "source to name a <float_array> of this file"),
        ("mesh>", "spline>", "<geometry>: expected <mesh> inside, got none"),
        ("technique_common>", "technique>", "expected <technique_common> inside, got none"),
        ("triangles", "tristrips", "<tristrips>: expected <triangles>, .*triangulate the mesh"),
    ],
)
def test_what_contradicts_itself_is_refused(tmp_path, old, new, wrong):
    """The error names file, line and element."""
    text = geometry("g", POINTS, triangles("g", FAN)).replace(old, new)
    with pytest.raises(SdfError, match=rf"a\.dae:\d+: .*{wrong}"):
        read(tmp_path, text)


@pytest.mark.parametrize(
    ("primitive", "wrong"),
    [
        (polylist("3 3", "0 1 2"), "expected as many indices as 6 corners of 1 each need, got 3"),
        (polylist("6 -3", "0 1 2"), "expected as many indices"),
        (polylist("", "0 1 2"), "expected as many indices as 0 corners of 1 each need, got 3"),
        (f"<polylist>{VERTEX}<p>0 1 2</p></polylist>", "expected <vcount> inside, got none"),
        (f"<polygons>{VERTEX}<ph><p>0 1 2</p></ph></polygons>", "<polygons> without holes"),
    ],
)
def test_polygons_that_contradict_themselves_are_refused(tmp_path, primitive, wrong):
    """Corners that are not as many as they say; holes."""
    with pytest.raises(SdfError, match=wrong):
        read(tmp_path, geometry("g", POINTS, primitive))
