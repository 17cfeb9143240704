"""The command line: JSON results, errors on one line with their code, nothing half-written."""

import json
import subprocess
import sys

import numpy as np
import pytest
import typer

from andabata.app.cli import FLOW, app, main
from traversability.cloud import PointCloud
from traversability.files import cloud_to_bytes


def run(capsys, *words):
    code = main(words)
    captured = capsys.readouterr()
    return code, captured.out, captured.err


@pytest.fixture
def cloud_file(tmp_path):
    rng = np.random.default_rng(0)
    points = rng.uniform(-10, 10, (20_000, 3)).astype(np.float32)
    points[:, 2] = 0.02 * rng.normal(size=20_000) - 0.72
    points[(points[:, 0] > 4) & (points[:, 0] < 4.3), 2] += rng.uniform(0, 1)
    path = tmp_path / "flat.npz"
    path.write_bytes(cloud_to_bytes(PointCloud(points, "sensor")))
    return path


def test_help_is_a_tour_and_imports_nothing_heavy():
    """The help lists the verbs in their order, without importing a heavy library."""
    code = (
        "import sys; from andabata.app.cli import main; main(['--help']);"
        "heavy = {'torch', 'open3d', 'sklearn', 'pybullet', 'numba', 'scipy', 'matplotlib'};"
        "sys.exit(len(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    lines = [line.split() for line in done.stdout.splitlines()]
    listed = [words[1] for words in lines if len(words) > 2 and words[1] in FLOW]
    assert listed == list(FLOW)


def test_every_verb_has_its_place_in_the_flow():
    """The flow names all verbs, and no other."""
    group = typer.main.get_command(app)
    assert set(group.commands) == set(FLOW)
    assert group.list_commands(None) == list(FLOW)


def test_worlds_are_listed_and_shown(capsys):
    """``world`` lists all presets and gives a world's size."""
    code, out, _ = run(capsys, "world", "list", "--json")
    names = [row["name"] for row in json.loads(out)["worlds"]]
    known = "forest hill hollow lake maze meadow meadow-rough natural natural-far natural-rough "
    known += "natural-row natural-test natural-walkers park plain stony terraced"
    assert (code, names) == (0, known.split())
    code, out, _ = run(capsys, "world", "show", "maze", "--seed", "2", "--json")
    assert (code, json.loads(out)["width_m"]) == (0, 80.0)


def test_scan_gives_ranges_cells_and_a_picture(capsys, cloud_file, tmp_path):
    """``scan`` gives 32 ranges, 32 x 10 cells and a PNG file."""
    picture = tmp_path / "scan.png"
    code, out, _ = run(capsys, "scan", str(cloud_file), "--picture", str(picture), "--json")
    data = json.loads(out)
    assert code == 0
    assert len(data["ranges"]) == 32
    assert all(r is None or 0.5 < r <= 10.0 for r in data["ranges"])
    assert np.array(data["cell_states"]).shape == (32, 10)
    assert len(data["ring_edges_m"]) == 11
    assert sum(data["cells"].values()) == 320
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (["world", "show", "moon"], 2, "expected one of forest, hill, hollow, lake, maze"),
        (["evaluate", "--world", "moon"], 2, "--world: expected one of forest"),
        (["evaluate", "--controllers", "policy,psychic"], 2, "got 'psychic'"),
        (["evaluate", "--seed", "10000"], 2, "Invalid value for '--seed'"),
        (["evaluate", "--set", "seed=10000"], 2, "seed: input should be less than 10000"),
        (["evaluate", "--trials", "10001"], 2, "Invalid value for '--trials'"),
        (["drive", "--seed", "10000"], 2, "Invalid value for '--seed'"),
        (["demo", "--seed", "-1"], 2, "Invalid value for '--seed'"),
        (["ros", "robot", "--seed", "10000"], 2, "Invalid value for '--seed'"),
        (["bench", "--seed", "10000"], 2, "Invalid value for '--seed'"),
        (["bench", "chain", "--seed", "10000"], 2, "Invalid value for '--seed'"),
        (["bench", "localization", "--drives", "10001"], 2, "Invalid value for '--drives'"),
        (["drive", "--controller", ""], 2, "--controller: expected some of"),
        (["train", "--stages", "3-1"], 2, "--stages: expected 1, 2, 3 or a span"),
        (["train", "--task", "moon"], 2, "--task: expected offroad, spn or td3, got 'moon'"),
        (["train", "--task", "spn", "--robot", "husky"], 2, "--robot: expected options of --task"),
        (["train", "--task", "spn", "--algorithm", "x"], 1, "--algorithm: expected sac"),
        (["train", "--task", "td3", "--variant", "x"], 1, "--algorithm: expected td3, gdae"),
        (["train", "--task", "td3", "--k", "5"], 2, "--k: expected a plan whose actor reads"),
        (["train", "--k", "5"], 2, "--k: expected a plan whose actor reads points"),
        (["drive", "--set", "robot.mass=-4"], 2, "robot.mass: input should be greater than 0"),
        (["drive", "--set", "robot.mas=4"], 2, "robot.mas: expected a known field"),
        (["scan", "missing.npz"], 1, "missing.npz: No such file"),
        (["scan", "x.npz", "--mounting", "1,2"], 2, "--mounting: expected five numbers"),
        (["scan", "x.npz", "--sensor-height", "-1"], 2, "z: input should be greater than"),
        (["classifier", "train", "--clouds", "nowhere", "--out", "m"], 1, "nowhere/manifest.json"),
        (["world", "render", "maze", "--out", "no/w.png"], 1, "no: expected an existing folder"),
        (["evaluate", "--policy", "missing"], 1, "missing: No such file"),
        (["train", "--forest", "missing"], 1, "missing: No such file"),
        (["fly"], 2, "No such command 'fly'"),
        (["clouds", "generate"], 2, "Missing option '--out'"),
    ],
)
def test_errors_take_one_line_and_leave_nothing(
    capsys, tmp_path, monkeypatch, words, code, message
):
    """An error is one line on stderr with its exit code, and no file is left."""
    monkeypatch.chdir(tmp_path)
    found, out, err = run(capsys, *words)
    assert found == code
    assert message in err
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert "Traceback" not in err
    assert out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "content", [b"", b"PK\x03\x04 nonsense", b"\x00" * 100], ids=["empty", "truncated", "zeros"]
)
def test_a_damaged_cloud_is_named(capsys, tmp_path, monkeypatch, content):
    """A damaged cloud gives an error with its name."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.npz").write_bytes(content)
    code, _, err = run(capsys, "scan", "bad.npz")
    assert (code, err.count("\n")) == (1, 1)
    assert "bad.npz: expected" in err
    assert [entry.name for entry in tmp_path.iterdir()] == ["bad.npz"]


def test_a_cloud_of_nan_is_refused(capsys, tmp_path, monkeypatch):
    """A cloud without a finite point is refused."""
    monkeypatch.chdir(tmp_path)
    points = np.full((50, 3), np.nan, dtype=np.float32)
    (tmp_path / "nan.npz").write_bytes(cloud_to_bytes(PointCloud(points)))
    code, _, err = run(capsys, "scan", "nan.npz")
    assert (code, "expected finite points, got none among 50" in err) == (1, True)


def test_debug_shows_the_traceback(capsys):
    """``--debug`` shows the traceback of an error."""
    assert main(["world", "show", "moon", "--debug"]) == 2
    assert "Traceback" in capsys.readouterr().err


def test_ctrl_c_ends_with_130(capsys, monkeypatch):
    """An interrupt gives exit code 130 and one word."""

    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("worlds.catalogue.presets", interrupt)
    code, _, err = run(capsys, "world", "list")
    assert (code, err) == (130, "interrupted\n")


def test_doctor_finds_everything(capsys):
    """``doctor`` finds no broken package here."""
    code, out, _ = run(capsys, "doctor", "--json")
    assert (code, json.loads(out)["ok"]) == (0, True)
