"""The evaluation's table: known answers, goals in a row, and a journal that is taken up again."""

import json

import pytest

from andabata.app import evaluation
from andabata.app.evaluation import EvaluationConfig, Models, evaluate, summarise


def leg(trial, goal, outcome, controller="straight", spl=0.5):
    return {
        "controller": controller,
        "trial": trial,
        "world_seed": 1,
        "goal": goal,
        "goals": 3,
        "outcome": outcome,
        "time_s": 10.0,
        "distance_m": 3.0,
        "spl": spl,
        "trespass_m": 1.0,
        "restlessness": 0.0,
        "min_clearance_m": 0.2,
        "end_xy": [0.0, 0.0],
    }


CONFIG = EvaluationConfig(controllers=("straight",), trials=4)
ROWS = [
    leg(0, 1, "goal"),
    leg(0, 2, "goal"),
    leg(0, 3, "goal"),
    leg(1, 1, "goal"),
    leg(1, 2, "collision", spl=0.0),
    leg(2, 1, "tipover", spl=0.0),
    leg(3, 1, "goal"),
    leg(3, 2, "goal"),
    leg(3, 3, "timeout", spl=0.0),
]


def test_goals_in_a_row_count_every_trial():
    table = {row["goal"]: row for row in summarise(ROWS, CONFIG)}
    assert [table[goal]["successes"] for goal in (1, 2, 3, "all")] == [3, 2, 1, 1]
    assert [table[goal]["success_rate"] for goal in (1, 2, 3, "all")] == [0.75, 0.5, 0.25, 0.25]
    assert (table[2]["collisions"], table[1]["tipovers"], table[3]["timeouts"]) == (1, 1, 1)
    assert table["all"]["collisions"] == table["all"]["tipovers"] == table["all"]["timeouts"] == 1
    assert table[1]["spl"] == pytest.approx(0.5 * 3 / 4)
    assert table["all"]["spl"] == pytest.approx(0.5 * 6 / 12)


def test_wilson_interval_holds_the_rate():
    for row in summarise(ROWS, CONFIG):
        assert 0 <= row["wilson_low"] < row["success_rate"] < row["wilson_high"] <= 1


def test_a_journal_is_taken_up_again(tmp_path, monkeypatch):
    ran = []

    def run_one(config, models, trial):
        ran.append(trial)
        return [leg(trial, 1, "goal")]

    monkeypatch.setattr(evaluation, "run_one", run_one)
    journal = tmp_path / "trials.jsonl"
    first = evaluate(CONFIG, Models(), workers=1, journal=journal)
    assert ran == [0, 1, 2, 3]
    lines = journal.read_text().splitlines()
    journal.write_text(
        "\n".join(lines[:3]) + "\n" + lines[3][: len(lines[3]) // 2]
    )  # A kill mid-line.
    ran.clear()
    assert evaluate(CONFIG, Models(), workers=1, journal=journal) == first
    assert ran == [2, 3]
    assert json.loads(journal.read_text().splitlines()[-1])["trial"] == 3


def test_a_journal_of_another_evaluation_is_refused(tmp_path):
    journal = tmp_path / "trials.jsonl"
    journal.write_text('{"config": {}}\n')
    with pytest.raises(ValueError, match="expected a journal of this evaluation"):
        evaluate(CONFIG, Models(), workers=1, journal=journal)
