"""Help of every command: a few examples that fit 80 columns, parse, and run."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
import typer

import andabata.models
from andabata.app.cli import app, main
from andabata.app.command import EXAMPLES, examples
from andabata.records import topics
from andabata.records.bag_writers import open_writer
from andabata.records.messages import MessageBuilder
from tests.support.documents import verbs
from tests.support.elevation_models import needs_rasterio, save_plane
from tests.support.planned_drives import record_drive
from tests.support.sdf_worlds import PLANE, POST, document, solid
from traversability.cloud import PointCloud
from traversability.files import cloud_to_bytes
from worlds.splits import DEVELOPMENT_SEED

COMMANDS = {name: command for name, command in verbs() if not hasattr(command, "commands")}
NAMES = sorted(COMMANDS)
LINES = [line for name in NAMES for line in examples(COMMANDS[name].help)]

FAST = (
    "world list",
    "world show hill",
    "world show maze",
    "world render hill",
    "world import",
    "policy show",
    "policy export",
    "classifier export",
    "clouds convert",
    "scan",
    "bag info",
    "bag salvage",
    "bag export",
    "bag layout",
)
"""First words of the examples that take about a second."""
INPUTS = {"f/forest.npz": "forest.npz", "my_policy.safetensors": "policy.safetensors"}
"""Files of examples that are copies of shipped models."""


def parse(line):
    """Parse a command line without running it; a wrong word or value raises typer's error."""
    words = shlex.split(line)
    assert words[0] == "andabata"
    command, words = typer.main.get_command(app), words[1:]
    name = "andabata"
    while hasattr(command, "commands"):
        name, command, words = words[0], command.commands[words[0]], words[1:]
    return command.make_context(name, words)


@pytest.mark.parametrize("name", NAMES)
def test_help_ends_with_two_to_five_examples_of_the_command(name):
    """Each example begins with its own command and fits a terminal of 80 columns."""
    text = COMMANDS[name].help
    assert text.count(EXAMPLES) == 1
    found = examples(text)
    assert 2 <= len(found) <= 5
    assert len(set(found)) == len(found)
    for line in found:
        assert line.split()[: 1 + len(name.split())] == ["andabata", *name.split()]
        assert len(line) <= 74


@pytest.mark.parametrize("line", LINES)
def test_examples_parse(line):
    """Every example has known options with values within their bounds."""
    parse(line)


@pytest.mark.parametrize(
    "line",
    ["andabata world show", "andabata drive --seed -1", "andabata drive --colour red"],
)
def test_wrong_examples_would_be_found(line):
    """The parser of the tests refuses a missing argument, a bad value and an unknown option."""
    with pytest.raises(typer.BadParameter.__mro__[2]):
        parse(line)


@pytest.mark.parametrize("name", NAMES)
def test_help_shows_examples_line_by_line(name, capsys, monkeypatch):
    """In 80 columns the help shows each example whole, on an indented line of its own."""
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("typer.rich_utils.MAX_WIDTH", 80)
    assert main([*name.split(), "--help"]) == 0
    shown = [line.rstrip() for line in capsys.readouterr().out.splitlines()]
    for line in examples(COMMANDS[name].help):
        assert f"     {line}" in shown


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return a folder with the files that examples read."""
    folder = tmp_path_factory.mktemp("examples")
    rng = np.random.default_rng(0)
    points = rng.uniform(-9, 9, (9000, 3)).astype(np.float32)
    points[:, 2] = 0.02 * rng.normal(size=9000) - 0.72
    cloud = PointCloud(points, "sensor")
    for kind in ("npz", "ply"):
        (folder / f"cloud.{kind}").write_bytes(cloud_to_bytes(cloud, kind))
    (folder / "000000.bin").write_bytes(cloud_to_bytes(cloud, "bin"))
    np.full(len(cloud), 3, "<u4").tofile(folder / "000000.label")  # Grass.
    for name in ("drive.bag", "broken.bag"):
        writer, compose = open_writer(folder / name), MessageBuilder(1)
        for second in (1.0, 2.0):
            message = compose.cloud(second, cloud)
            writer.write(topics.CLOUD, compose.stamp_ns(second), message)
        writer.close()
    models = Path(andabata.models.__file__).parent
    for name in ("depot.world", "depot.sdf", "course.sdf"):
        (folder / name).write_text(document(solid("post", POST), solid("ground", PLANE)))
    for path, shipped in INPUTS.items():
        (folder / path).parent.mkdir(exist_ok=True)
        (folder / path).write_bytes((models / shipped).read_bytes())
    record_drive(folder / "drive.mcap", 0.3)
    drive = folder / "data/runs/drive"
    drive.mkdir(parents=True)
    (drive / "drive.json").write_text(json.dumps({"path": [[0, 0, 0], [3, 4, 0]], "goals": []}))
    config = {"sensing": {"geo_reference": {"latitude_deg": 36.715}}}
    (drive / "run.json").write_text(json.dumps({"config": config}))
    run = folder / "data/runs/train"
    run.mkdir(parents=True)
    (run / "policy.safetensors").write_bytes((models / "policy.safetensors").read_bytes())
    return folder


@pytest.mark.parametrize(
    "line", [line for line in LINES if line.removeprefix("andabata ").startswith(FAST)]
)
def test_fast_examples_run(line, folder, capsys, monkeypatch):
    """Examples that take about a second run to a good end beside the files that they name."""
    monkeypatch.chdir(folder)
    if " dem.tif" in line:
        needs_rasterio()
        save_plane(folder / "dem.tif")
        tree = {"type": "Point", "coordinates": [9.0, 46.0536]}
        feature = {"type": "Feature", "geometry": tree, "properties": {"kind": "tree"}}
        (folder / "trees.geojson").write_text(json.dumps(feature))
    code = main(shlex.split(line)[1:])
    assert code == 0, capsys.readouterr().err


@pytest.mark.parametrize(
    "name",
    [
        "drive",
        "demo",
        "ros robot",
        "bench",
        "bench chain",
        "bench localization",
        "bench perception",
    ],
)
def test_what_shows_or_times_something_looks_at_development_worlds(name):
    """Without a seed they take one of development; ``evaluate`` has those of seed 0."""
    defaults = {
        name: option.default
        for name, command in verbs()
        for option in command.params
        if option.name == "seed"
    }
    assert defaults[name] == DEVELOPMENT_SEED
    assert defaults["evaluate"] == 0
