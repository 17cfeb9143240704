"""Each example runs, and shows what it is for."""

import json
import runpy
from importlib.util import find_spec

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.assembly.simulated_robot import SimulatedRobotConfig
from andabata.configuration.settings import resolve
from andabata.models import shipped_policy
from andabata.navigation.policy_controller import observation_of
from terrain.classes import SemanticClass
from tests.support.documents import ROOT
from tests.support.situations import scan_of, situation
from worlds.traversability_map import Reason
from worlds.world_files import load_world

EXAMPLES = ROOT / "examples"


def run(capsys, *argv):
    """Run a command, which has to succeed, and return the JSON that it prints."""
    main([*argv, "--workers", "1", "--json"])
    return json.loads(capsys.readouterr().out)


@pytest.fixture(autouse=True)
def here(monkeypatch):
    """Run in the checkout, as the examples say."""
    monkeypatch.chdir(ROOT)


def test_a_controller_of_ones_own_is_compared_with_others(capsys):
    """Alone, and with the planner around it, in pairs with ``straight``."""
    own = "examples/own_controller.py:OpenSector"
    data = run(
        *(capsys, "evaluate", "--world", "natural-test", "--trials", "1", "--seed", "7300"),
        *("--controllers", f"{own},{own}+planner,straight", "--reality", "ideal", "--set"),
        *("simulated_robot.plant=kinematic", "--set", "terminations.time_limit=6"),
    )
    assert {row["controller"] for row in data["rows"]} == {own, f"{own}+planner", "straight"}
    assert all(row["distance_m"] > 0.3 for row in data["rows"] if row["goal"] == 1)


def test_a_navigator_of_ones_own_is_compared_with_others(capsys):
    """On the same rooms as ``straight``; it drives into nobody."""
    own = "examples/own_navigator.py:StopAndGo"
    data = run(
        *(capsys, "evaluate", "--task", "barn", "--fields", "crowd-5", "--trials", "1"),
        *("--set", "count=3", "--set", "first_seed=7300", "--controllers", f"{own},straight"),
    )
    first, second = data["rows"]
    assert (first["controller"], second["controller"]) == (own, "straight")
    assert first["hit_mover"] == 0


def test_a_reward_of_ones_own_is_learnt_by(capsys, tmp_path):
    """Its terms, and no other, stand in the history of the run; they punish what they name."""
    run(
        *(capsys, "train", "--stages", "1", "--reward", "examples/own_reward.py:smooth"),
        *("--out", str(tmp_path / "run"), "--set", "learner.hidden=[8,8]"),
        *("--set", "stages.Maze2D.episodes=8", "--set", "stages.Maze2D.environment.seeds=[0]"),
        *("--set", "stages.Maze2D.environment.terminations.time_limit=3"),
        *("--set", "validation=0", "--set", "learner.episodes_per_iteration=8"),
    )
    (row,) = map(json.loads, (tmp_path / "run" / "history.jsonl").read_text().splitlines())
    assert set(row["terms"]) == {"progress", "nearness", "turning", "crash"}
    assert row["terms"]["turning"] < 0


def test_a_world_of_ones_own_is_written_and_driven_in(capsys, tmp_path, monkeypatch):
    """Its file is the world: the heights of the function, the wall and the trees, and the task."""
    monkeypatch.chdir(tmp_path)
    example = runpy.run_path(str(EXAMPLES / "own_world.py"))
    example["main"].__globals__["SECONDS"] = 3.0
    example["main"]()
    assert capsys.readouterr().out.startswith("timeout: ")
    world = load_world(tmp_path / "own_world.safetensors")
    assert world.ground.height_at(3.0, 4.0) == pytest.approx(example["height"](3.0, 4.0), abs=0.01)
    assert {each.semantic for each in world.objects} >= {SemanticClass.WALL, SemanticClass.TRUNK}
    assert world.truth.reason_at(0.0, 2.0) == Reason.SOLID
    assert world.tasks[0].goals == ((12.0, 2.0),)


def test_a_laser_of_ones_own_sees_what_the_truth_says(capsys, tmp_path, monkeypatch):
    """Nearly all of its cells are as in truth, and commands take the file that it writes."""
    monkeypatch.chdir(tmp_path)
    runpy.run_path(str(EXAMPLES / "own_laser.py"))["main"]()
    points, cells, ahead = capsys.readouterr().out.splitlines()
    assert 10_000 < int(points.split()[0]) <= 16 * 1800
    assert int(cells.split()[3].removesuffix("%")) >= 90
    assert len(ahead.split(":")[1].split()) == 8
    laser = resolve(SimulatedRobotConfig, tmp_path / "own_laser.toml").sensing.lidar
    assert (laser.beams, laser.elevations_deg[0], laser.max_range) == (16, -24.0, 60.0)


@pytest.mark.skipif(find_spec("onnxruntime") is None, reason="no onnxruntime: the extra `onnx`")
def test_the_policy_elsewhere_drives_as_ours(capsys):
    """Its observation is ours to the bit, its yaw rates to the last bits of a float32."""
    example = runpy.run_path(str(EXAMPLES / "policy_elsewhere.py"))
    example["main"]()
    assert float(capsys.readouterr().out.split()[-2]) < 1e-5
    ranges = np.linspace(0.5, 9.5, 32)
    ranges[[3, 7]] = np.inf, np.nan
    for error in (-3.1, 0.4, 3.1):
        given = situation(scan_of(ranges), heading_error=error, previous_steering=(0.2, -0.4))
        ours = observation_of(shipped_policy().observations, given)
        state = example["observation"](given.scan.ranges, (0.2, -0.4), error)
        np.testing.assert_array_equal(state[0], ours)


def test_a_drive_from_python(capsys):
    """It tells the outcome of each goal."""
    example = runpy.run_path(str(EXAMPLES / "drive.py"))
    example["main"].__globals__["SECONDS"] = 3.0
    example["main"]()
    assert capsys.readouterr().out.startswith("timeout: ")


def test_every_example_has_a_test():
    """By its name."""
    text = (ROOT / "tests" / "test_examples.py").read_text()
    names = [file.name for file in EXAMPLES.glob("*.py")]
    assert names
    assert all(name in text for name in names)
