"""Each example runs, and shows what it is for."""

import json
import runpy

import pytest

from andabata.app.cli import main
from tests.support.documents import ROOT

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
