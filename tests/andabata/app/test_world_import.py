"""Import of Gazebo's worlds by the command line: files that loaders take, warnings, refusals."""

import gzip
import json
import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from andabata.app.cli import main
from andabata.machine.planar.lidar import PlanarLidarConfig
from andabata.tasks.rooms.batch import DiscRobotConfig, RoomBatch
from tests.support.collada_files import crate
from tests.support.mesh_files import angle_bar, block, ranges, save
from tests.support.sdf_worlds import (
    CUBE,
    PLANE,
    POST,
    collision,
    document,
    include,
    link,
    model,
    model_document,
    pose,
    solid,
    write,
)
from worlds.rooms.catalogue import make_room
from worlds.world import Start
from worlds.world_files import load_world

ROOT = os.environ.get("ANDABATA_REAL_DATA")
BARN = sorted(Path(ROOT).glob("barn/*.world*")) if ROOT else []

LIGHT = '<light name="sun" type="directional"/>'
PARTS = (
    LIGHT,
    solid("ground", PLANE),
    solid("box", CUBE, pose(3, 0, 0.5)),
    solid("turned", CUBE, pose(3, 3, 0.5, 0, 0, 0.5)),
    solid("post", POST, pose(0, 3, 0.5)),
    solid("lamp", POST, pose(0, 0, 5)),
)


def run(capsys, *words):
    """Run a command to its good end and return its JSON."""
    code = main([*map(str, words), "--json"])
    out, err = capsys.readouterr()
    assert code == 0, err
    return json.loads(out)


@pytest.fixture
def here(tmp_path, monkeypatch):
    """Return the working folder, with a world in it."""
    monkeypatch.chdir(tmp_path)
    write(tmp_path / "depot.world", document(*PARTS))
    return tmp_path


def test_a_flat_world_becomes_a_room(capsys, here):
    """The file is named after the world; the summary says all that is in it."""
    data = run(capsys, "world", "import", "depot.world")
    reach = np.cos(0.5 - np.pi / 4) * np.sqrt(0.5)
    assert data == {
        "out": "depot.toml",
        "form": "room",
        "name": "w",
        "version": "1.7",
        "shapes": {"plane": 1, "box": 2, "cylinder": 2},
        "boxes": 1,
        "circles": 1,
        "outlines": 1,
        "edges": 4,
        # From the post to the turned box, whose half diagonal is 0.7, and from box to box.
        "half_m": [pytest.approx((reach + 3.1 + 2) / 2), pytest.approx((reach + 3.5 + 2) / 2)],
        "origin_m": [pytest.approx((reach + 2.9) / 2), pytest.approx((reach + 2.5) / 2)],
        "ground_m": 0.0,
        "slab_m": [0.05, 0.5],
        "outside": 1,
        "warnings": ['depot.world:3: <light name="sun">: light left out'],
    }
    made = make_room("depot.toml")
    assert (len(made.boxes), len(made.circles), len(made.edges)) == (5, 1, 4)


def test_for_people_there_is_a_line_for_everything(capsys, here):
    """Shapes, room, place, warnings, file."""
    assert main(["world", "import", "depot.world"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "w, SDF 1.7; shapes that collide: 1 plane, 2 box, 2 cylinder"
    assert "0.05 to 0.5 m above the ground: 1 boxes, 1 circles, 4 slanted edges" in lines[1]
    assert "shapes outside of it: 1" in lines[2]
    assert lines[3].startswith("warning: depot.world:3:")
    assert lines[4] == "room: depot.toml"


def test_the_room_is_one_of_the_evaluations(capsys, here):
    """``--rooms`` takes the file; a policy drives in it; the journal knows the file's content."""
    run(capsys, "world", "import", "depot.world", "--out", "mine.toml", "--bounds", "-4,-4,8,8")
    text = "evaluate --task spn --policy proportional --rooms mine.toml --lidars ten-beams"
    words = f"{text} --memory reactive --pairs 2 --workers 1 --out run".split()
    rows = run(capsys, *words)["rows"]
    assert [(row["room"], row["trials"]) for row in rows] == [("mine.toml", 2)]
    assert len(run(capsys, *words)["rows"]) == 1
    run(capsys, "world", "import", "depot.world", "--out", "mine.toml")
    assert main(words) == 1
    assert "one that differs in rooms" in capsys.readouterr().err


def test_slab_and_bounds_are_taken(capsys, here):
    """Heights and a rectangle of the world."""
    words = "world import depot.world --slab 4.6,5 --bounds -1,-1,4,1"
    data = run(capsys, *words.split())
    assert (data["circles"], data["boxes"], data["edges"]) == (1, 0, 0)
    assert (data["half_m"], data["origin_m"]) == ([2.5, 1.0], [1.5, 0.0])


def test_models_come_from_the_given_folders(capsys, here):
    """``--models``, several times; what is missing may be left out."""
    write(here / "a/one/model.sdf", model_document(solid("one", CUBE, pose(0, 0, 0.5))))
    write(here / "b/two/model.sdf", model_document(solid("two", POST, pose(2, 0, 0.5))))
    parts = [include(f"model://{name}") for name in ("one", "two", "three")]
    write(here / "depot.world", document(*parts[:2]))
    data = run(capsys, "world", "import", "depot.world", "--models", "a", "--models", "b")
    assert (data["boxes"], data["circles"]) == (1, 1)
    write(here / "depot.world", document(*parts))
    words = ["world", "import", "depot.world", "--models", "a", "--models", "b"]
    assert main(words) == 1
    assert "depot.world:5: <uri>: expected model://three in a, b" in capsys.readouterr().err
    data = run(capsys, *words, "--allow-missing")
    assert "model://three is missing" in data["warnings"][0]


def test_a_mesh_is_cast_and_collided_with(capsys, here):
    """Beams of the room's simulator end on the mesh, and a robot that drives on touches it."""
    bar = angle_bar(2.0, 0.3, 1.0)
    save(here / "bar.ply", bar)
    turn = np.array([[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]])
    shape = "<mesh><uri>bar.ply</uri></mesh>"
    write(here / "bar.world", document(solid("bar", shape, pose(1, 0, 0, 0, 0, 0.5))))
    run(capsys, "world", "import", "bar.world", "--bounds", "-4,-4,4,4")
    lidar = PlanarLidarConfig(fov_deg=360, resolution_deg=0.5, max_range=3.0)
    batch = RoomBatch(1, [make_room("bar.toml")], DiscRobotConfig(), lidar)
    batch.place(0, 0, Start(0.0, 0.6, 0.2))
    batch.observe(np.ones(1, dtype=bool))
    angles = lidar.bearings + 0.2
    rays = np.zeros((len(angles), 6))
    rays[:, 1], rays[:, 2] = 0.6, 0.3
    rays[:, 3], rays[:, 4] = np.cos(angles), np.sin(angles)
    moved = bar._replace(vertices=bar.vertices @ turn.T + np.array([1, 0, 0]))
    wanted = np.minimum(ranges(moved, rays), 3.0)
    wrong = abs(1 / batch.reciprocals[0] - wanted) > 1e-4
    assert (wanted < 2.9).sum() > 100
    assert wrong.mean() < 0.003
    for yaw, hits in ((0.2, True), (3.0, False)):
        batch.place(0, 0, Start(0.0, 0.6, yaw))
        for _ in range(15):
            state = batch.step(np.array([[0.5, 0.0]]), np.ones(1, dtype=bool))
        assert bool(state.contacts[0]) is hits


def test_a_collada_mesh_is_that_of_the_same_stl(capsys, here):
    """The same room, ranges and contacts, with SDF's scale on top of the file's own unit."""
    save(here / "stl.stl", block(1.0, 0.5, 1.0))
    crate(here / "dae.dae", (1.0, 0.5, 1.0))
    lidar = PlanarLidarConfig(fov_deg=360, resolution_deg=0.5, max_range=3.0)
    seen, met = [], []
    for kind in ("stl", "dae"):
        shape = f"<mesh><uri>{kind}.{kind}</uri><scale>1 2 1</scale></mesh>"
        write(here / f"{kind}.world", document(solid("m", shape, pose(1.2, 0, 0.5, 0, 0, 0.5))))
        run(capsys, "world", "import", f"{kind}.world", "--bounds", "-4,-4,4,4")
        batch = RoomBatch(1, [make_room(f"{kind}.toml")], DiscRobotConfig(), lidar)
        batch.place(0, 0, Start(0.0, 0.1, 0.2))
        batch.observe(np.ones(1, dtype=bool))
        seen.append(1 / batch.reciprocals[0])
        steps = [batch.step(np.array([[0.5, 0.0]]), np.ones(1, dtype=bool)) for _ in range(15)]
        met.append([bool(each.contacts[0]) for each in steps])
    assert (seen[0] < 2.9).sum() > 100
    np.testing.assert_allclose(seen[1], seen[0], atol=1e-6)
    assert met[0] == met[1]
    assert met[0][-1]


def test_an_uneven_world_becomes_a_world_of_hills(capsys, here):
    """A heightmap: a file that ``world show``, ``render`` and drives take."""
    edge = np.linspace(-1, 1, 65)
    heights = 255 * np.exp(-3 * (edge[:, None] ** 2 + edge**2))
    Image.fromarray(heights.astype(np.uint8)).save(here / "h.png")
    hill = "<heightmap><uri>h.png</uri><size>32 32 3</size></heightmap>"
    write(here / "hill.sdf", document(solid("hill", hill), solid("post", POST, pose(8, 0, 0.9))))
    data = run(capsys, "world", "import", "hill.sdf")
    assert (data["out"], data["form"]) == ("hill.safetensors", "world")
    assert (data["width_m"], data["objects"], data["origin_m"]) == (32.0, {"post": 1}, [0, 0])
    assert data["relief_m"] == pytest.approx(3.0, abs=0.01)
    shown = run(capsys, "world", "show", "hill.safetensors")
    assert (shown["relief_m"], shown["tasks"]) == (data["relief_m"], data["tasks"])
    run(capsys, "world", "render", "hill.safetensors", "--out", "hill.png")
    assert (here / "hill.png").stat().st_size > 10_000
    drive = "drive --world hill.safetensors --controller straight --time-limit 4 --out run"
    assert run(capsys, *drive.split())["attempts"]
    trial = "evaluate --world hill.safetensors --controllers straight --trials 1 --goals 1"
    trial += " --workers 1 --set terminations.time_limit=4"
    assert run(capsys, *trial.split())["rows"]


def test_a_flat_world_may_become_a_world_too(capsys, here):
    """``--form world``; without room for a task it has none, and says so."""
    words = "world import depot.world --form world --cell 0.25 --bounds -1,-1,4,4"
    data = run(capsys, *words.split())
    assert data["objects"] == {"wall": 2, "post": 2}
    assert data["tasks"] == 0
    assert "no tasks" in data["warnings"][-1]
    assert load_world(Path("depot.safetensors")).ground.cell == 0.25
    assert run(capsys, "world", "show", "depot.safetensors")["goals_per_task"] == 0


def test_ramps_may_be_ground(capsys, here):
    """A model that is named is no obstacle, and makes a world of a flat one."""
    ramp = solid("ramp", "<box><size>4 4 0.2</size></box>", pose(0, 0, 0.3, 0, -0.1, 0))
    write(here / "ramp.world", document(solid("ground", PLANE), ramp))
    assert run(capsys, "world", "import", "ramp.world")["form"] == "room"
    data = run(capsys, "world", "import", "ramp.world", "--ground", "ramp")
    assert (data["form"], data["objects"]) == ("world", {})
    assert data["relief_m"] > 0.3


def test_ends_of_packed_worlds_are_not_in_the_name(capsys, here):
    """``a.world.gz`` becomes ``a.toml``."""
    (here / "a.world.gz").write_bytes(gzip.compress(document(*PARTS).encode()))
    assert run(capsys, "world", "import", "a.world.gz")["out"] == "a.toml"


def test_many_edges_are_a_warning(capsys, here, monkeypatch):
    """Every beam takes its time from each."""
    monkeypatch.setattr("andabata.app.world_import._MANY_EDGES", 3)
    data = run(capsys, "world", "import", "depot.world")
    assert "4 slanted edges" in data["warnings"][-1]


def test_a_world_of_the_file_may_be_named(capsys, here):
    """``--name``."""
    worlds = "".join(f'<world name="{n}">{solid(n, POST, pose(0, 0, 0.5))}</world>' for n in "ab")
    write(here / "two.sdf", f'<sdf version="1.7">{worlds}</sdf>')
    assert run(capsys, "world", "import", "two.sdf", "--name", "b")["name"] == "b"


@pytest.mark.parametrize(
    ("words", "code", "wrong"),
    [
        ("lost.world", 1, "lost.world: No such file or directory"),
        ("depot.world --form hill", 2, "--form: expected some of auto, room, world, got 'hill'"),
        ("depot.world --slab 0.5", 2, "--slab: expected 2 numbers"),
        ("depot.world --slab 0.5,0.1", 2, "--slab: expected the least height first"),
        ("depot.world --bounds 0,0,1", 2, "--bounds: expected 4 numbers"),
        ("depot.world --bounds 1,0,0,1", 2, "--bounds: expected least x, y"),
        ("depot.world --form world --slab 0,1", 2, "--slab: expected none for a world of hills"),
        ("depot.world --cell 0.5", 2, "--cell, --ground: expected none for a room"),
        ("depot.world --out depot.json", 2, "--out: expected a file that ends in .toml for a room"),
        ("depot.world --out lost/depot.toml", 1, "lost"),
        ("depot.world --name x", 1, "depot.world:1: <sdf>: expected one of the worlds w, got 'x'"),
        ("bad.world", 1, "bad.world:3: <pose>: expected 6 finite numbers, got '0 0 nan 0 0 0'"),
        ("bomb.world", 1, "bomb.world:2: <document>: expected no entities, got 'a'"),
        ("depot.world --ground ghost", 1, "ground: expected names of models, got ghost"),
    ],
)
def test_refusals_are_one_line(capsys, here, words, code, wrong):
    """Usage or failure, with file, line and element or with the option; nothing is written."""
    write(here / "bad.world", document(solid("m", CUBE, pose(0, 0, float("nan")))))
    write(here / "bomb.world", '<!DOCTYPE sdf [\n<!ENTITY a "b">]>\n<sdf version="1.6">&a;</sdf>')
    assert main(["world", "import", *words.split()]) == code
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1
    assert wrong in err
    assert sorted(path.name for path in here.iterdir()) == [
        "bad.world",
        "bomb.world",
        "depot.world",
    ]


def test_a_dynamic_model_with_a_plugin_is_imported_where_it_stands(capsys, here):
    """As in worlds whose obstacles a plugin moves."""
    plugin = '<plugin name="push" filename="libpush.so"><speed>1</speed></plugin>'
    mover = f'<model name="mover">{pose(1, 2, 0.5)}{link(collision(POST))}{plugin}</model>'
    write(here / "moving.world", document(mover, model("wall", link(collision(CUBE)))))
    data = run(capsys, "world", "import", "moving.world")
    assert data["circles"] == 1
    assert ["plugin left out" in data["warnings"][0], "stands still" in data["warnings"][1]] == [
        True,
        True,
    ]


@pytest.mark.skipif(not BARN, reason="ANDABATA_REAL_DATA names no folder with worlds")
@pytest.mark.parametrize("path", BARN[:2], ids=lambda path: path.name)
def test_a_real_world_is_driven_in(capsys, here, path):
    """All of its cylinders are in the room, and a planned drive begins and ends in it."""
    words = ["world", "import", path, "--out", "barn.toml", "--bounds", "-4.5,0,0,14"]
    data = run(capsys, *words)
    assert data["circles"] == data["shapes"]["cylinder"]
    words = "evaluate --task spn --policy proportional --rooms barn.toml --lidars ten-beams"
    (row,) = run(capsys, *words.split(), "--memory", "map", "--pairs", "1", "--workers", "1")[
        "rows"
    ]
    assert row["trials"] == 1
