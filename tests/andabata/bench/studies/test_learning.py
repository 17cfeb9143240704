"""Ablation of the training plan: its settings exist, and results are kept."""

import json

import pytest

from andabata.bench.studies import learning
from andabata.bench.studies.learning import EPISODES, VARIANTS, train_and_evaluate, variant_row
from andabata.configuration.settings import resolve
from andabata.training.plans import TrainingPlan, load_plan


@pytest.mark.parametrize("variant", VARIANTS)
def test_each_variant_changes_the_shipped_plan(variant):
    """Every setting is a field of the plan and differs from it."""
    plan = load_plan()
    changed = resolve(TrainingPlan, None, VARIANTS[variant], plan)
    assert (changed == plan) == (variant == "as shipped")


def test_a_finished_run_is_not_repeated(tmp_path, monkeypatch):
    """The kept result is returned without any training."""
    row = {"goal": 1, "collision": 0, "timeout": 0, "steps": 9, "wall_s": 1.0}
    (tmp_path / "as_shipped-3").mkdir()
    (tmp_path / "as_shipped-3" / "result.json").write_text(json.dumps(row))
    monkeypatch.setattr(learning, "run_command", None)
    assert train_and_evaluate(tmp_path, ("as shipped", 3)) == row


def test_a_run_trains_with_the_variant_and_keeps_its_result(tmp_path, monkeypatch):
    """The command has the variant's settings; only a begun run is resumed."""
    commands = []

    def run(*words):
        commands.append(words)
        return 'progress\n{"steps": 7, "wall_s": 2.0}\n'

    monkeypatch.setattr(learning, "run_command", run)
    outcomes = {"goal": 150, "collision": 20, "timeout": 30}
    monkeypatch.setattr(learning, "evaluate_in_mazes", lambda *_, **__: outcomes)
    (tmp_path / "one_learning_rate_to_the_end-1").mkdir()
    row = train_and_evaluate(tmp_path, ("one learning rate to the end", 1))
    assert row == outcomes | {"steps": 7, "wall_s": 2.0}
    (words,) = commands
    (setting,) = VARIANTS["one learning rate to the end"]
    assert words[words.index("--set") + 1] == setting
    assert words[words.index("--seed") + 1] == "1"
    assert words[words.index("--stages") + 1] == "1"
    assert "--resume" not in words
    assert train_and_evaluate(tmp_path, ("one learning rate to the end", 1)) == row
    assert len(commands) == 1


def test_rates_are_of_the_test_episodes():
    """The mean is over seeds."""
    runs = [
        {"goal": goal, "collision": 1, "timeout": 2, "steps": steps}
        for goal, steps in ((EPISODES, 100), (EPISODES // 2, 201))
    ]
    row = variant_row("as shipped", runs)
    assert row["mean success"] == 0.75
    assert row["by seed"] == "1.000, 0.500"
    assert row["collisions"] == "1, 1"
    assert row["mean steps"] == 150
