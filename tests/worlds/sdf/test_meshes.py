"""Meshes: what files hold, what is closed and convex, and files that are none."""

import numpy as np
import pytest

from tests.support.collada_files import document, instance, node, of_surface, write
from tests.support.mesh_files import angle_bar, block, save, together, torus
from worlds.sdf import meshes
from worlds.sdf.elements import SdfError
from worlds.sdf.meshes import Surface, is_closed, load_mesh, normals, parts, volume


@pytest.mark.parametrize("kind", ["stl", "obj", "ply", "off", "gltf"])
def test_a_file_holds_the_mesh(tmp_path, kind):
    """Eight corners and twelve triangles, whatever the format repeats."""
    path = save(tmp_path / f"a.{kind}", block(1.0, 2.0, 3.0))
    found = load_mesh(path, "here")
    assert found.vertices.shape == (8, 3)
    assert found.triangles.shape == (12, 3)
    np.testing.assert_allclose(np.ptp(found.vertices, axis=0), [1, 2, 3])
    assert volume(found) == pytest.approx(6.0)


def test_a_collada_file_holds_the_mesh(tmp_path):
    """The same corners and triangles, wherever the parts of its scene share them."""
    box = block(1.0, 2.0, 3.0)
    halves = [box._replace(triangles=half) for half in np.split(box.triangles, 2)]
    geometries = "".join(of_surface(name, half) for name, half in zip("ab", halves, strict=True))
    nodes = node(instance("a")) + node(instance("b"))
    found = load_mesh(write(tmp_path / "a.DAE", geometries, nodes), "here")
    assert found.vertices.shape == (8, 3)
    assert is_closed(found.triangles)
    assert volume(found) == pytest.approx(6.0)


def test_triangles_without_area_are_left_out(tmp_path):
    """They have no direction."""
    box = block(1.0, 1.0, 1.0)
    flat = Surface(box.vertices, np.concatenate([box.triangles, [[0, 0, 1]]]))
    assert len(load_mesh(save(tmp_path / "a.ply", flat), "here").triangles) == 12


@pytest.mark.parametrize(
    ("name", "data", "wrong"),
    [
        ("a.blend", b"BLENDER", r"a mesh of a kind \.stl, .*got .*a\.blend; convert it"),
        ("a.dae", b"<COLLADA/>", r"a\.dae:1: <COLLADA>: expected <scene> inside, got none"),
        ("a.dae", document("", node()).encode(), "expected triangles in .*a.dae, got none"),
        ("a.stl", b"", "expected triangles in .*a.stl, got none"),
        ("a.stl", b"solid x\nendsolid x\n", "expected triangles"),
        ("a.stl", bytes(80) + (12).to_bytes(4, "little") + bytes(70), "expected triangles"),
        ("a.obj", b"hello", "expected triangles"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 9\n", "expected triangles"),
        ("a.gltf", b"{", "expected triangles"),
    ],
)
def test_what_is_no_mesh_is_refused(tmp_path, capfd, name, data, wrong):
    """The error says where it is asked for and which file; no result is spoilt."""
    (tmp_path / name).write_bytes(data)
    with pytest.raises(SdfError, match=f"^here: .*{wrong}"):
        load_mesh(tmp_path / name, "here")
    assert capfd.readouterr().out == ""


def test_a_mesh_that_is_too_large_is_refused(tmp_path, monkeypatch):
    """With the number of its triangles."""
    monkeypatch.setattr(meshes, "_MAX_TRIANGLES", 11)
    path = save(tmp_path / "a.ply", block(1.0, 1.0, 1.0))
    with pytest.raises(SdfError, match="at most 11 triangles, got 12"):
        load_mesh(path, "here")


def test_a_surface_is_closed_if_each_edge_has_two_sides():
    """Without a triangle, or with one turned, it is not."""
    box = block(1.0, 1.0, 1.0)
    assert is_closed(box.triangles)
    assert not is_closed(box.triangles[1:])
    turned = box.triangles.copy()
    turned[0] = turned[0][::-1]
    assert not is_closed(turned)
    assert not is_closed(np.concatenate([box.triangles, box.triangles]))


def test_volume_and_normals_have_signs():
    """Faces look outwards from a positive volume; a normal is as long as twice the area."""
    box = block(1.0, 2.0, 3.0)
    assert volume(box) == pytest.approx(6.0)
    assert volume(box._replace(triangles=box.triangles[:, ::-1])) == pytest.approx(-6.0)
    middles = box.vertices[box.triangles].mean(axis=1)
    assert (np.einsum("ij,ij->i", normals(box), middles) > 0).all()
    assert np.linalg.norm(normals(box), axis=1).sum() / 2 == pytest.approx(22.0)


def test_parts_are_what_hangs_together():
    """A block is convex; a ring and an angle are not; an open box is no solid."""
    shifted = block(1.0, 1.0, 1.0)
    shifted = shifted._replace(vertices=shifted.vertices + 5.0)
    opened = Surface(shifted.vertices + 5.0, shifted.triangles[1:])
    convex, others = parts(together(shifted, torus(), angle_bar(), opened))
    assert [len(each.triangles) for each in convex] == [12]
    np.testing.assert_allclose(convex[0].vertices.mean(axis=0), 5.0)
    assert sorted(len(each.triangles) for each in others) == [11, 20, 576]


def test_parts_look_outwards():
    """Whichever way their faces looked in the file."""
    for make in (lambda: block(1.0, 1.0, 1.0), torus):
        turned = make()._replace(triangles=make().triangles[:, ::-1])
        (found,) = [part for kind in parts(turned) for part in kind]
        assert volume(found) > 0


def test_a_dent_is_not_convex():
    """A vertex pressed in by a millimetre is enough; one at its place is not."""
    box = block(1.0, 1.0, 1.0)
    middle = np.array([[0.5, 0.0, 0.0]])
    corners = [k for k in range(8) if box.vertices[k, 0] > 0]
    rest = np.array([t for t in box.triangles if not set(t.tolist()) <= set(corners)])
    ring = sorted(corners, key=lambda k: np.arctan2(box.vertices[k, 2], box.vertices[k, 1]))
    fan = [[ring[k], ring[(k + 1) % 4], 8] for k in range(4)]
    triangles = np.concatenate([rest, fan])
    for depth, count in ((0.0, 1), (0.001, 0)):
        vertices = np.concatenate([box.vertices, middle - (depth, 0, 0)])
        assert len(parts(Surface(vertices, triangles))[0]) == count
