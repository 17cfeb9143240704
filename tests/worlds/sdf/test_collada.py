"""Collada files: nodes, units and axes as Gazebo takes them, and files that are none."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.support.collada_files import document, instance, node, of_surface, words, write
from tests.support.mesh_files import block
from worlds.sdf import collada
from worlds.sdf.collada import read_collada
from worlds.sdf.elements import SdfError

BOX = block(1.0, 2.0, 3.0)
CORNERS = BOX.vertices[BOX.triangles]
G = of_surface("g", BOX)
PLACED = node(instance("g"))


def read(folder, *texts, most=1000, **options):
    """Return the triangles of a file whose scene has some nodes."""
    return read_collada(write(folder / "a.dae", *texts, **options), most)


def outward_volume(corners):
    """Return the volume inside triangles, negative if they show their backs."""
    a, b, c = corners.transpose(1, 0, 2)
    return np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6


@pytest.mark.parametrize("up", ["", "<up_axis>Y_UP</up_axis>", "<up_axis>Z_UP</up_axis>"])
@pytest.mark.parametrize(
    ("unit", "metres"),
    [("", 1.0), ("<unit/>", 1.0), ('<unit name="centimeter" meter="0.01"/>', 0.01)],
)
def test_the_unit_counts_and_the_axis_does_not(tmp_path, unit, metres, up):
    """As in Gazebo: z is up whatever the file says."""
    found = read(tmp_path, G, PLACED, asset=unit + up)
    np.testing.assert_allclose(found, metres * CORNERS, atol=1e-12)


@pytest.mark.parametrize(
    ("steps", "matrix"),
    [
        ("<translate>1 2 3</translate>", [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3]]),
        ("<scale>2 3 4</scale>", [[2, 0, 0, 0], [0, 3, 0, 0], [0, 0, 4, 0]]),
        ("<rotate>0 0 5 90</rotate>", [[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0]]),
        (
            "<matrix>0 0 1 5 1 0 0 6 0 1 0 7 0 0 0 1</matrix>",
            [[0, 0, 1, 5], [1, 0, 0, 6], [0, 1, 0, 7]],
        ),
        (
            "<translate>1 0 0</translate><rotate>0 0 1 90</rotate><scale>2 1 1</scale>",
            [[0, -1, 0, 1], [2, 0, 0, 0], [0, 0, 1, 0]],
        ),
        (
            "<scale>2 1 1</scale><rotate>0 0 1 90</rotate><translate>1 0 0</translate>",
            [[0, -2, 0, 0], [1, 0, 0, 1], [0, 0, 1, 0]],
        ),
    ],
)
def test_a_node_moves_its_geometry(tmp_path, steps, matrix):
    """All steps in their order, the last one first; the unit comes on top."""
    turn, shift = np.array(matrix)[:, :3], np.array(matrix)[:, 3]
    found = read(tmp_path, G, node(steps, instance("g")), asset='<unit meter="0.5"/>')
    np.testing.assert_allclose(found, 0.5 * (CORNERS @ turn.T + shift), atol=1e-12)


def test_a_turn_about_any_axis_is_that_of_scipy(tmp_path):
    """The axis has any length."""
    found = read(tmp_path, G, node("<rotate>1 -2 0.5 37</rotate>", instance("g")))
    axis = np.array([1, -2, 0.5])
    turn = Rotation.from_rotvec(np.radians(37) * axis / np.linalg.norm(axis))
    np.testing.assert_allclose(found, CORNERS @ turn.as_matrix().T, atol=1e-12)


def test_nodes_stand_in_each_other(tmp_path):
    """Two geometries, nested nodes, one of the library taken twice."""
    small = block(0.5, 0.5, 0.5)
    inner = node("<translate>0 0 1</translate>", instance("s"))
    nodes = [
        node("<translate>10 0 0</translate>", instance("g"), inner),
        node("<rotate>0 0 1 90</rotate>", node(instance("shared", "node"))),
        node("<translate>0 0 5</translate>", instance("shared", "node")),
    ]
    shared = node("<translate>2 0 0</translate>", instance("s"), name="shared")
    found = read(
        tmp_path,
        G + of_surface("s", small),
        "".join(nodes),
        others=f"<library_nodes>{shared}</library_nodes>",
    )
    assert found.shape == (48, 3, 3)
    middles = [(each.min(axis=(0, 1)) + each.max(axis=(0, 1))) / 2 for each in np.split(found, 4)]
    wanted = [(10, 0, 0), (10, 0, 1), (0, 2, 0), (2, 0, 5)]
    np.testing.assert_allclose(middles, wanted, atol=1e-12)


def test_a_mirror_image_keeps_its_inside(tmp_path):
    """Its faces are turned over."""
    found = read(tmp_path, G, node("<scale>-1 1 1</scale>", instance("g")))
    assert outward_volume(found) == pytest.approx(6.0)


def test_a_scene_without_geometries_is_empty(tmp_path):
    """Lights and cameras are no triangles."""
    assert len(read(tmp_path, G, node("<instance_light url='#l'/>"))) == 0


@pytest.mark.parametrize(
    ("nodes", "asset", "wrong"),
    [
        (
            node(instance("lost")),
            "",
            r"<instance_geometry>: expected url to name a <geometry>.*#lost",
        ),
        (node(instance("g-array")), "", "expected url to name a <geometry> of this file"),
        (node(instance("n", "node"), name="n"), "", "at most 10000 nodes, 100 deep"),
        (node(instance("g", "controller")), "", "expected a mesh without bones"),
        (node("<lookat>1 2 3</lookat>"), "", "<lookat>: expected <matrix>, <translate>"),
        (
            node("<translate>1 2</translate>"),
            "",
            "<translate>: expected 3 finite numbers, got '1 2'",
        ),
        (node("<scale>1 2 nan</scale>"), "", "<scale>: expected 3 finite numbers"),
        (node("<rotate>0 0 0 90</rotate>"), "", "<rotate>: expected an axis"),
        (node(f"<matrix>{words(np.eye(4) + np.eye(4, k=-3))}</matrix>"), "", "0 0 0 1 as the last"),
        (PLACED, '<unit meter="0"/>', "<unit>: expected a number of metres above 0, got '0'"),
        (PLACED, '<unit meter="inch"/>', "<unit>: expected a number of metres above 0, got 'inch'"),
    ],
)
def test_what_is_badly_formed_is_refused(tmp_path, nodes, asset, wrong):
    """The error names file, line and element."""
    with pytest.raises(SdfError, match=rf"a\.dae:\d+: .*{wrong}"):
        read(tmp_path, G, nodes, asset=asset)


@pytest.mark.parametrize(
    ("text", "wrong"),
    [
        ("<sdf/>", "<sdf>: expected <COLLADA> as the outermost element"),
        ("<COLLADA/>", "<COLLADA>: expected <scene> inside, got none"),
        ("<COLLADA>", "expected well-formed XML"),
        ('<!DOCTYPE a [<!ENTITY a "b">]><COLLADA>&a;</COLLADA>', "expected no entities, got 'a'"),
        (document(G, PLACED).replace('id="scene"', ""), "expected url to name a <visual_scene>"),
    ],
)
def test_what_is_no_collada_is_refused(tmp_path, text, wrong):
    """Entities are never expanded."""
    (tmp_path / "a.dae").write_text(text, encoding="utf-8")
    with pytest.raises(SdfError, match=rf"a\.dae:\d+: .*{wrong}"):
        read_collada(tmp_path / "a.dae", 1000)


def test_too_many_triangles_or_nodes_are_refused(tmp_path, monkeypatch):
    """Forty nodes that place the next one twice would be a million million of them."""
    with pytest.raises(SdfError, match="at most 23 triangles, got more"):
        read(tmp_path, G, PLACED + PLACED, most=23)
    assert len(read(tmp_path, G, PLACED + PLACED, most=24)) == 24
    twice = [node(2 * instance(str(k + 1), "node"), name=str(k)) for k in range(40)]
    monkeypatch.setattr(collada, "_MAX_NODES", 200)
    with pytest.raises(SdfError, match="at most 200 nodes"):
        read(tmp_path, G, "".join(twice) + node(name="40"))
