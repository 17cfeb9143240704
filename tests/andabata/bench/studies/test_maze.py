"""Policies in mazes: outcomes are counted."""

from collections import Counter
from pathlib import Path

import pytest

import andabata.models
from andabata.bench.studies import maze
from andabata.bench.studies.maze import evaluate_in_mazes, success_row
from andabata.evaluation.statistics import wilson_interval
from andabata.training.plans import load_plan
from rl.learners import make_learner


def test_the_success_rate_has_its_interval():
    """Every outcome has a column."""
    low, high = wilson_interval(3, 4)
    row = success_row(Counter(goal=3, timeout=1))
    assert row["episodes"] == 4
    assert row["success"] == f"0.750 [{low:.3f}, {high:.3f}]"
    assert row["timeout"] == 1


def test_a_policy_on_points_drives_with_other_sectors(monkeypatch, tmp_path):
    """One on points takes any number, one of a fixed vector that of its training alone."""
    monkeypatch.setattr(maze, "_MAZES", 1)
    plan = load_plan("sac-points")
    stage = plan.stages["Maze2D"].environment
    learner = make_learner(plan.learner, stage.observations, stage.actions, 0)
    path = tmp_path / "points.safetensors"
    path.write_bytes(learner.policy({"config": plan.model_dump(mode="json")}).to_bytes())
    for sectors in (32, 128):
        assert evaluate_in_mazes(path, 2, first_world=3000, sectors=sectors).total() == 2
    fixed = Path(andabata.models.__file__).parent / "policy.safetensors"
    with pytest.raises(ValueError, match="expected"):
        evaluate_in_mazes(fixed, 2, first_world=3000, sectors=64)


def test_the_shipped_policy_is_evaluated(monkeypatch, capsys):
    """The numbers of episodes add up, and the row that is printed is that of the outcomes."""
    monkeypatch.setattr(maze, "_MAZES", 1)
    policy = Path(andabata.models.__file__).parent / "policy.safetensors"
    outcomes = evaluate_in_mazes(policy, 2, first_world=3000)
    assert outcomes.total() == 2
    monkeypatch.setattr(maze, "evaluate_in_mazes", lambda *_: outcomes)
    maze.main([str(policy)])
    printed = capsys.readouterr().out
    assert f"| {success_row(outcomes)['success']} |" in printed
