"""Files that worlds name: where they are looked for, which is taken, and what is refused."""

from pathlib import Path

import numpy as np
import pytest

from tests.support.sdf_worlds import (
    collision,
    document,
    include,
    link,
    model,
    model_document,
    places,
    pose,
    read,
    solid,
    write,
)
from worlds.sdf import files
from worlds.sdf.elements import Element, SdfError
from worlds.sdf.files import version_of
from worlds.sdf.world import read_sdf

CONFIG = "<model><name>thing</name><version>1.0</version>{}</model>"


def thing(size: float, version: str = "1.6") -> str:
    """Return a file with a cube of a size."""
    return model_document(solid("thing", f"<box><size>{size} 1 1</size></box>"), version)


def sizes(world):
    """Return the first edges of all boxes [m]."""
    return [each.shape.size[0] for each in world.solids]


def test_the_given_folders_come_before_the_worlds_own(tmp_path):
    """The first folder that holds the model counts."""
    write(tmp_path / "a/thing/model.sdf", thing(2))
    write(tmp_path / "b/thing/model.sdf", thing(3))
    write(tmp_path / "thing/model.sdf", thing(4))
    asked = include("model://thing")
    assert sizes(read(tmp_path, asked)) == [4]
    assert sizes(read(tmp_path, asked, folders=[tmp_path / "b", tmp_path / "a"])) == [3]
    assert sizes(read(tmp_path, asked, folders=[tmp_path / "none", tmp_path / "a"])) == [2]


def test_an_include_says_name_and_pose_in_the_models_place(tmp_path):
    """What it does not say is the model's own."""
    write(tmp_path / "thing/model.sdf", model_document(solid("thing", at=pose(1, 2, 3))))
    asked = include("model://thing", "<name>other</name>", pose(5, 0, 0))
    found = places(read(tmp_path, include("model://thing"), asked))
    np.testing.assert_allclose(found["thing"], [1, 2, 3])
    np.testing.assert_allclose(found["other"], [5, 0, 0])


def test_includes_include(tmp_path):
    """A model in a model in a world, each with its pose."""
    write(tmp_path / "inner/model.sdf", model_document(solid("inner", at=pose(0, 0, 1))))
    outer = model("outer", include("model://inner", "<name>x</name>"), pose(0, 1, 0))
    write(tmp_path / "outer/model.sdf", model_document(outer))
    found = places(read(tmp_path, include("model://outer", pose(1, 0, 0))))
    np.testing.assert_allclose(found["outer::x"], [1, 0, 1])


@pytest.mark.parametrize(
    ("entries", "size"),
    [
        ('<sdf version="1.4">4.sdf</sdf><sdf version="1.6">6.sdf</sdf>', 6),
        ('<sdf version="1.6">6.sdf</sdf><sdf version="1.4">4.sdf</sdf>', 6),
        ('<sdf version="1.6">6.sdf</sdf><sdf version="1.10">10.sdf</sdf>', 6),
        ('<sdf version="1.12">12.sdf</sdf><sdf version="1.10">10.sdf</sdf>', 10),
        ("<sdf>4.sdf</sdf>", 4),
        ('<sdf>4.sdf</sdf><sdf version="1.6">6.sdf</sdf>', 6),
    ],
)
def test_of_several_versions_the_newest_that_is_read_counts(tmp_path, entries, size):
    """Versions are numbers, not texts; 1.10 comes after 1.9 and counts if there is no other."""
    for number in (4, 6, 10, 12):
        write(tmp_path / f"thing/{number}.sdf", thing(number, f"1.{number}"))
    write(tmp_path / "thing/model.config", CONFIG.format(entries))
    assert sizes(read(tmp_path, include("model://thing"))) == [size]


def test_newer_versions_are_read_with_a_warning_and_older_ones_refused(tmp_path):
    """1.4 to 1.9 are what is known."""
    for minor in range(4, 10):
        assert not read(tmp_path, solid("m"), version=f"1.{minor}").warnings
    (warning,) = read(tmp_path, solid("m"), version="1.11").warnings
    assert "test.world:1: <sdf>: versions after 1.9" in warning
    with pytest.raises(
        SdfError, match=r"test\.world:1: <sdf>: expected version 1.4 to 1.9, got 1.2"
    ):
        read(tmp_path, solid("m"), version="1.2")


@pytest.mark.parametrize("text", ["", "1", "one.six", "1.6.1"])
def test_what_is_no_version_is_refused(text):
    """Two numbers with a point between them."""
    with pytest.raises(
        SdfError, match=rf"a:1: <sdf>: expected a version such as 1.6, got '{text}'"
    ):
        version_of(Element("sdf", {"version": text} if text else {}, Path("a"), 1))


@pytest.mark.parametrize(
    "uri",
    [
        "model://thing",
        "thing",
        "file://thing",
        "model://thing/model.sdf",
        "thing/model.sdf",
        "package://thing",
        "https://example.org/1.0/owner/models/Thing",
    ],
)
def test_a_model_is_found_under_all_kinds_of_names(tmp_path, uri):
    """By folder or file, by scheme or none; of servers' names the last part counts."""
    write(tmp_path / "thing/model.sdf", thing(2))
    assert sizes(read(tmp_path, include(uri))) == [2]


@pytest.mark.parametrize(
    "uri", ["model://ground_plane", "https://example.org/1/x/models/Ground Plane"]
)
def test_what_all_worlds_include_is_there(tmp_path, uri):
    """Level ground is a plane, and the sun a light, which is left out."""
    world = read(tmp_path, include(uri), include("model://sun"))
    assert [type(each.shape).__name__ for each in world.solids] == ["Plane"]
    assert ["light left out" in line for line in world.warnings] == [True]


def test_a_missing_model_is_refused_or_left_out(tmp_path):
    """The error names file, line, folders and the next step; with leave it becomes a warning."""
    asked = include("model://lost")
    with pytest.raises(SdfError) as error:
        read(tmp_path, "", asked, folders=[tmp_path / "models"])
    assert str(error.value) == (
        f"{tmp_path / 'test.world'}:4: <uri>: expected model://lost in {tmp_path / 'models'}, "
        f"{tmp_path}, got nothing; give the folder that holds it, or allow what is missing to be "
        f"left out"
    )
    world = read(tmp_path, asked, solid("m"), allow_missing=True)
    assert len(world.solids) == 1
    assert "model://lost is missing and was left out" in world.warnings[0]


def test_a_missing_mesh_is_refused_or_left_out(tmp_path):
    """As a model."""
    body = solid("m", "<mesh><uri>model://thing/a.stl</uri></mesh>")
    with pytest.raises(SdfError, match=r":3: <uri>: expected model://thing/a.stl in"):
        read(tmp_path, body)
    world = read(tmp_path, body, allow_missing=True)
    assert not world.solids
    assert "a.stl is missing" in world.warnings[0]


@pytest.mark.parametrize(
    "uri",
    [
        "model://../../etc/passwd",
        "file:///etc/passwd",
        "../outside/model.sdf",
        "/etc/passwd",
        "model://thing/../../../x",
    ],
)
def test_paths_that_lead_out_of_the_folders_are_refused(tmp_path, uri):
    """Neither absolute paths nor steps upwards reach what is not in a folder of models."""
    write(tmp_path / "outside/model.sdf", thing(2))
    with pytest.raises(SdfError, match=r":3: <uri>: expected a path inside of the folders"):
        read(tmp_path / "inside", include(uri))


def test_steps_upwards_that_stay_inside_are_taken(tmp_path):
    """A mesh beside the model, named from the model's own folder."""
    write(
        tmp_path / "models/a/model.sdf",
        model_document(solid("a", "<mesh><uri>../shared/x.stl</uri></mesh>")),
    )
    write(tmp_path / "models/shared/x.stl", "solid")
    (solid_,) = read(tmp_path, include("model://a"), folders=[tmp_path / "models"]).solids
    assert solid_.shape.path == tmp_path / "models/shared/x.stl"


def test_a_model_that_includes_itself_is_refused(tmp_path):
    """Directly or around a corner."""
    write(tmp_path / "a/model.sdf", model_document(model("a", include("model://b"))))
    write(tmp_path / "b/model.sdf", model_document(model("b", include("model://a"))))
    with pytest.raises(SdfError, match=r"b/model\.sdf:2: <include>: .* do not include themselves"):
        read(tmp_path, include("model://a"))


@pytest.mark.parametrize(
    ("files", "wrong"),
    [
        ({"model.config": CONFIG.format("")}, r"model\.config:1: <model>: expected <sdf> with the"),
        (
            {"model.config": CONFIG.format('<sdf version="1.6">x.sdf</sdf>')},
            "expected the file .*x.sdf",
        ),
        (
            {"model.config": CONFIG.format('<sdf version="1.6">../../x</sdf>')},
            "in the folder of the",
        ),
        ({"model.config": "<model>"}, r"model\.config:1: <model>: expected well-formed XML"),
        ({"model.sdf": "<robot/>"}, r"model\.sdf:1: <robot>: expected <sdf> as the outermost"),
        ({"model.sdf": "<sdf/>"}, r"model\.sdf:1: <sdf>: expected a version"),
        ({"model.sdf": "nothing"}, r"model\.sdf:1: <document>: expected well-formed XML"),
    ],
)
def test_a_broken_model_is_named(tmp_path, files, wrong):
    """The error is about the file in which it is, not about the world."""
    for name, text in files.items():
        write(tmp_path / "thing" / name, text)
    with pytest.raises(SdfError, match=wrong):
        read(tmp_path, include("model://thing"))


def test_each_file_is_read_once(tmp_path, monkeypatch):
    """Three hundred includes of one model are two files."""
    opened = []
    monkeypatch.setattr(
        files, "read_xml", lambda path, *more: opened.append(path) or _read(path, *more)
    )
    write(tmp_path / "thing/model.sdf", thing(2))
    parts = [include("model://thing", f"<name>t{k}</name>") for k in range(300)]
    world = read_sdf(write(tmp_path / "a.world", document(*parts)))
    assert len(world.solids) == 300
    assert opened == [tmp_path / "a.world", tmp_path / "thing/model.sdf"]


_read = files.read_xml


def test_a_plugin_in_an_include_is_named(tmp_path):
    """As elsewhere."""
    write(tmp_path / "thing/model.sdf", model_document(model("thing", link(collision()))))
    world = read(tmp_path, include("model://thing", '<plugin name="p" filename="f"/>'))
    assert "plugin left out" in world.warnings[0]
