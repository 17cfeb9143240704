"""Import of elevation models by the command line: the world, its objects, refusals."""

import json
import sys

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.app.elevation_import import is_elevation_model
from tests.support.elevation_models import UTM, grid, needs_rasterio, save, save_plane
from worlds.catalogue import make_world
from worlds.elevation.square import read_square
from worlds.world_files import load_world

needs_rasterio()


def run(capsys, *words):
    """Run a command to its good end and return its JSON."""
    code = main([*map(str, words), "--json"])
    out, err = capsys.readouterr()
    assert code == 0, err
    return json.loads(out)


def refused(capsys, *words):
    """Run a command to its bad end and return the line that says why."""
    assert main([*map(str, words)]) != 0
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    return err


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Return the working folder, with an elevation model in it."""
    monkeypatch.chdir(tmp_path)
    save_plane(tmp_path / "dem.tif", (100, 100))
    return tmp_path


SMALL = ("world", "import", "dem.tif", "--size", "48")


def write_objects(folder, *places):
    """Write trees at places."""
    features = [
        {
            "type": "Feature",
            "geometry": {"type": "Point", "coordinates": place},
            "properties": {"kind": "tree", "radius": 0.4},
        }
        for place in places
    ]
    data = {"type": "FeatureCollection", "features": features}
    (folder / "trees.geojson").write_text(json.dumps(data))


def test_an_elevation_model_becomes_a_world(capsys, here):
    """Named after the file, with the place, the plants of natural-test, and what is assumed."""
    data = run(capsys, *SMALL, "--seed", 3, "--difficulty", 0.25)
    world = load_world(here / "dem.safetensors")
    square = read_square(here / "dem.tif", size=48.0)
    assert {name: data[name] for name in ("out", "form", "crs", "preset", "placed", "name")} == {
        "out": "dem.safetensors",
        "form": "world",
        "crs": UTM,
        "preset": "natural-test",
        "placed": 0,
        "name": "dem",
    }
    assert (data["seed"], data["difficulty"], data["width_m"]) == (3, 0.25, 48.0)
    assert data["datum"]["altitude_m"] == pytest.approx(500.0, abs=1e-3)
    assert data["datum"]["longitude_deg"] == pytest.approx(9.0, abs=1e-9)
    assert data["resolution_m"] == list(square.resolution)
    assert [each.split(":")[0] for each in data["warnings"]] == ["no unit of height in the file"]
    np.testing.assert_array_equal(world.ground.heights, square.ground.heights)
    assert world.datum == square.datum
    assert len(world.objects) == sum(data["objects"].values()) > 50
    assert len(make_world("dem.safetensors").tasks) == data["tasks"] == 2


def test_its_text_has_the_place_and_each_warning(capsys, here):
    """A line each."""
    assert main([*SMALL, "--preset", "none"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "EPSG:32632, cells of 1 x 1 m; preset none, seed 0; objects placed: 0"
    assert lines[1].startswith("world of 48.0 x 48.0 m, relief 7.2 m, 0 objects, 4 tasks")
    assert lines[2].endswith("longitude 9.000000, altitude 500.00 m")
    assert lines[3].startswith("warning: no unit of height")
    assert lines[4:] == ["world: dem.safetensors"]


def test_objects_stand_where_the_file_says(capsys, here):
    """Nothing else does, unless a preset is named; in degrees or in the world's metres."""
    middle = read_square(here / "dem.tif", size=48.0).frame
    (longitude,), (latitude,) = middle.to("OGC:CRS84", np.array([10.0]), np.array([-15.0]))
    write_objects(here, [longitude, latitude])
    data = run(capsys, *SMALL, "--objects", "trees.geojson")
    assert (data["preset"], data["placed"]) == ("none", 1)
    assert data["objects"] == {"trunk": 1, "foliage": 1}
    trunk = load_world(here / "dem.safetensors").objects[0].vertices
    assert (trunk.min(0) + trunk.max(0))[:2] / 2 == pytest.approx([10.0, -15.0], abs=1e-3)
    write_objects(here, [10.0, -15.0])
    words = ("--objects", "trees.geojson", "--objects-frame", "map", "--preset", "meadow")
    data = run(capsys, *SMALL, *words, "--out", "meadow.safetensors")
    assert (data["name"], data["preset"]) == ("meadow", "meadow")
    assert data["objects"]["trunk"] > 1
    last = load_world(here / "meadow.safetensors").objects[-2].vertices
    assert (last.min(0) + last.max(0))[:2] / 2 == pytest.approx([10.0, -15.0], abs=1e-3)


def test_an_object_outside_is_refused(capsys, here):
    """No world is written."""
    write_objects(here, [0.0, 0.0], [0.0, 24.5])
    words = ("--objects", "trees.geojson", "--objects-frame", "map")
    assert "got 1 of 2 outside, the first feature 1" in refused(capsys, *SMALL, *words)
    assert not (here / "dem.safetensors").exists()


def test_a_finer_grid_is_taken(capsys, here):
    """Of the distance that is asked for."""
    run(capsys, *SMALL, "--cell", 0.4, "--preset", "none")
    assert load_world(here / "dem.safetensors").ground.cell == 0.4


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("--size", "150"), "expected the square of 150 m"),
        (("--at", "46.5,7"), "100.0% of it outside"),
        (("--crs", "EPSG:32633"), "expected no other CRS"),
        (("--preset", "maze"), "preset: expected one of"),
        (("--out", "dem.toml"), "--out: expected a file that ends in .safetensors"),
        (("--models", "models"), "--models: expected none for an elevation model"),
        (("--size", "48", "--objects", "none.geojson"), "none.geojson"),
    ],
)
def test_what_cannot_be_done_is_said_on_one_line(capsys, here, words, text):
    """And nothing is written."""
    assert text in refused(capsys, "world", "import", "dem.tif", *words)
    assert [each.name for each in here.iterdir()] == ["dem.tif"]


def test_a_void_is_refused(capsys, here):
    """Never silently a hole."""
    x, y, numbers = grid((100, 100))
    heights = (0.01 * (x - x.mean()) + 0.0 * y).astype(np.float32)
    heights[50, 50] = np.nan
    save(here / "dem.tif", heights, numbers)
    assert "got none in 1 of them" in refused(capsys, *SMALL)


def test_a_write_that_fails_leaves_nothing(capsys, here, monkeypatch):
    """The file is whole or absent."""

    def fail(*_, **__):
        raise OSError("the disk is full")

    monkeypatch.setattr("os.replace", fail)
    monkeypatch.setattr("os.fsync", fail)
    refused(capsys, *SMALL, "--preset", "none")
    assert not (here / "dem.safetensors").exists()


def test_without_rasterio_the_line_to_type_is_named(capsys, here, monkeypatch):
    """The extra is `gis`."""
    monkeypatch.setitem(sys.modules, "rasterio", None)
    assert "install the extra `gis` (pip install -e '.[gis]')" in refused(capsys, *SMALL)


def test_options_of_elevation_models_are_not_for_gazebo(capsys, here):
    """They are not ignored."""
    assert "--at: expected none" in refused(capsys, "world", "import", "a.world", "--at", "1,2")


def test_elevation_models_are_told_by_their_names(here):
    """In any case."""
    names = ("a.tif", "a.TIFF", "a.world", "tif")
    assert [is_elevation_model(here / name) for name in names] == [True, True, False, False]
