"""A researcher's first hour: Gymnasium, a controller in the tables, BARN, the policy as ONNX."""

import runpy
from importlib.util import find_spec

import gymnasium as gym
import numpy as np
import pytest

import andabata
from tests.support.documents import ROOT
from tests.support.walks import Walk

EVALUATE, BARN = "docs/guides/evaluate.md", "docs/guides/run-barn.md"
SHORT = (
    "--workers 1 --set simulated_robot.plant=kinematic --reality ideal "
    "--set terminations.time_limit=6"
)


@pytest.fixture
def walk(tmp_path, capsys):
    """Return a walk in an empty folder."""
    return Walk(tmp_path, capsys)


def test_an_environment_is_made_by_name_and_its_reward_is_told_by_terms():
    """The page of Python: spaces with numbers of the paper's, terms that sum up to the reward."""
    gym.register_envs(andabata)
    env = gym.make("andabata/Maze2D-v0")
    state, info = env.reset(seed=1)
    assert env.observation_space.contains(state)
    assert info["world_seed"] in range(100)
    _, reward, terminated, truncated, info = env.step(np.zeros(1, dtype=np.float32))
    assert reward == pytest.approx(sum(info["reward_terms"].values()))
    assert not terminated
    assert not truncated
    env.close()


def test_ones_own_controller_stands_in_the_table_and_on_the_page(walk):
    """The guide of evaluation: beside a law and the planner, in pairs, and as a page."""
    line = walk.read(
        EVALUATE, "evaluate --world natural-test --trials 3 --seed 7300 --controllers ex"
    )
    own = "examples/own_controller.py:OpenSector"
    data = walk.ask(line, f"--trials 1 {SHORT} --out data/runs/own")
    rows = {row["controller"]: row for row in data["rows"] if row["goal"] == 1}
    assert list(rows) == [own, "straight", "planner"]
    assert all(0.0 <= row["wilson_low"] <= row["wilson_high"] <= 1.0 for row in rows.values())
    assert rows[own]["distance_m"] > 0.3
    assert {row["controller"] for row in data["differences"]}
    assert "reached" in walk.type(line, f"--trials 1 {SHORT} --out data/runs/own")
    walk.type(".venv/bin/andabata report data/runs/own", "--workers 1")
    assert "OpenSector" in (walk.folder / "data/runs/own/report.html").read_text()


def test_a_misspelt_controller_is_answered_with_what_there_is(walk):
    """Names of the package, and of the file."""
    line = walk.read(
        EVALUATE, "evaluate --world natural-test --trials 3 --seed 7300 --controllers ex"
    )
    said = walk.type(line.replace("OpenSector", "OpenSektor"), SHORT, code=1)
    assert "which has OpenSector" in said
    said = walk.type(line.replace(",planner", ",planer"), SHORT, code=2)
    assert "planner" in said
    assert "FILE.py:NAME" in said


def test_barn_is_driven_with_ones_own_navigator_beside(walk):
    """The guides of BARN and of evaluation: scores in their bounds, who hit whom."""
    data = walk.ask(
        walk.read(BARN, "evaluate --task barn --controllers arcs,gap"), "--set count=1 --workers 1"
    )
    assert {row["controller"] for row in data["rows"]} == {"arcs", "gap"}
    assert all(0.0 <= row["score"] <= 0.5 for row in data["rows"])
    line = walk.read(EVALUATE, "evaluate --task barn --fields crowd-5")
    data = walk.ask(line, "--set count=1 --workers 1")
    own, *others = data["rows"]
    assert own["controller"].endswith("own_navigator.py:StopAndGo")
    assert [row["controller"] for row in others] == ["straight", "mpc-movers"]


@pytest.mark.skipif(find_spec("onnxruntime") is None, reason="no onnxruntime: the extra `onnx`")
def test_the_policy_leaves_for_another_stack(walk, capsys):
    """The guide of exports: what it reads, the file, and the example that runs it."""
    page = "docs/guides/export-a-policy.md"
    assert "ranges (32,)" in walk.type(walk.read(page, "policy show"))
    walk.type(walk.read(page, "policy export"))
    assert (walk.folder / "policy.onnx").stat().st_size > 100_000
    runpy.run_path(str(ROOT / "examples/policy_elsewhere.py"))["main"]()
    assert "largest difference" in capsys.readouterr().out
