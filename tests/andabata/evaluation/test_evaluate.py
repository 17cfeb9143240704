"""The evaluation's table: known answers, goals in a row, and a journal that is taken up again."""

import json
import os
from dataclasses import replace

import numpy as np
import pytest

from andabata.evaluation import evaluate as evaluation
from andabata.evaluation.evaluate import EvaluationConfig, evaluate, hazards, summarise
from andabata.evaluation.failure_cause import failure_cause
from andabata.models import Models, shipped_policy
from andabata.tasks.episode_monitor import Outcome
from terrain.classes import SemanticClass
from terrain.heightfield import Heightfield
from terrain.objects import box
from worlds.truth import TruthConfig, build_truth
from worlds.world import World


def attempt(
    trial, goal, outcome, controller="straight", spl=0.5, hazard="", world="maze", energy=20.0
):
    return {
        "controller": controller,
        "trial": trial,
        "world": world,
        "world_seed": 1,
        "difficulty": 0.5,
        "goal": goal,
        "goals": 3,
        "outcome": outcome,
        "hazard": hazard,
        "time_s": 10.0,
        "distance_m": 3.0,
        "spl": spl,
        "trespass_m": 1.0,
        "restlessness": 0.0,
        "energy_j": energy,
        "min_clearance_m": 0.2,
        "end_xy": [0.0, 0.0],
    }


CONFIG = EvaluationConfig(controllers=("straight",), trials=4)
ROWS = [
    attempt(0, 1, "goal"),
    attempt(0, 2, "goal"),
    attempt(0, 3, "goal"),
    attempt(1, 1, "goal"),
    attempt(1, 2, "collision", spl=0.0),
    attempt(2, 1, "tipover", spl=0.0),
    attempt(3, 1, "goal"),
    attempt(3, 2, "goal"),
    attempt(3, 3, "timeout", spl=0.0),
]


def test_energy_is_the_mean_of_the_legs_whose_plant_has_motors():
    rows = [attempt(0, 1, "goal", energy=30.0), attempt(1, 1, "goal", energy=50.0)]
    assert summarise(rows, CONFIG)[0]["energy_j"] == 40.0
    rows = [attempt(0, 1, "goal", energy=None)]
    assert summarise(rows, CONFIG)[0]["energy_j"] is None


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

    def run_one(config, models, on_failure, trial):
        ran.append(trial)
        return [attempt(trial, 1, "goal")]

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


def test_a_journal_begins_whole_or_not_at_all(tmp_path, monkeypatch):
    """A head that is cut short would be taken for another evaluation's."""

    def fail(descriptor):
        raise OSError("power cut")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="power cut"):
        evaluate(CONFIG, Models(), workers=1, journal=tmp_path / "trials.jsonl")
    assert list(tmp_path.iterdir()) == []


def test_a_trial_counts_once_its_line_is_on_the_disk(tmp_path, monkeypatch):
    """Head and lines: each is synced before the next trial begins."""
    journal, seen = tmp_path / "trials.jsonl", []
    monkeypatch.setattr(evaluation, "run_one", lambda *_: [attempt(0, 1, "goal")])
    append = evaluation.append_line
    monkeypatch.setattr(evaluation, "append_line", lambda *line: (append(*line), seen.append(line)))
    evaluate(CONFIG, Models(), workers=1, journal=journal)
    assert [path for path, _ in seen] == [journal] * CONFIG.trials
    assert journal.read_text().splitlines()[1:] == [text for _, text in seen]


def test_a_journal_of_another_evaluation_is_refused(tmp_path):
    journal = tmp_path / "trials.jsonl"
    journal.write_text('{"config": {}}\n')
    with pytest.raises(ValueError, match="expected a journal of this evaluation"):
        evaluate(CONFIG, Models(), workers=1, journal=journal)


def test_a_journal_of_other_models_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(evaluation, "run_one", lambda *_: [attempt(0, 1, "goal")])
    journal = tmp_path / "trials.jsonl"
    evaluate(CONFIG, Models(), workers=1, journal=journal)
    others = replace(Models(), policy=shipped_policy("actor-critic"))
    with pytest.raises(ValueError, match="got one that differs in models; take another --out"):
        evaluate(CONFIG, others, workers=1, journal=journal)


def test_a_journal_of_another_commit_is_refused(monkeypatch, tmp_path):
    monkeypatch.setattr(evaluation, "run_one", lambda *_: [attempt(0, 1, "goal")])
    monkeypatch.setattr(evaluation, "commit", lambda: "one")
    journal = tmp_path / "trials.jsonl"
    evaluate(CONFIG, Models(), workers=1, journal=journal)
    monkeypatch.setattr(evaluation, "commit", lambda: "another")
    with pytest.raises(ValueError, match="got one that differs in commit;"):
        evaluate(CONFIG, Models(), workers=1, journal=journal)


def test_each_kind_of_world_has_rows_of_its_own():
    rows = [attempt(0, 1, "goal"), attempt(1, 1, "goal", world="hollow"), attempt(2, 1, "stuck")]
    table = {
        (row["world"], row["goal"]): row["success_rate"]
        for row in summarise([{**row, "goals": 1} for row in rows], CONFIG)
    }
    assert table == {("maze", 1): 0.5, ("maze", "all"): 0.5, ("hollow", 1): 1, ("hollow", "all"): 1}


def test_failures_are_counted_by_what_was_met():
    rows = [attempt(k, 1, "collision", hazard="low rock") for k in range(3)]
    rows += [attempt(3, 1, "tipover", hazard="slope"), attempt(4, 1, "goal")]
    found = [(row["hazard"], row["outcome"], row["count"]) for row in hazards(rows)]
    assert found == [("low rock", "collision", 3), ("slope", "tipover", 1)]


def hazardous_world():
    """Return a slope of 30 degrees in the east, a low rock, a trunk and a wall."""
    heights = np.zeros((101, 101), dtype=np.float32)
    heights[80:] = (np.arange(21) * 0.2 * np.tan(np.deg2rad(30)))[:, None]
    ground = Heightfield(heights, 0.2)
    things = (
        box(SemanticClass.ROCK, (0.0, 0.0, 0.05), (0.2, 0.2, 0.1)),
        box(SemanticClass.TRUNK, (0.0, 5.0, 1.0), (0.3, 0.3, 2.0)),
        box(SemanticClass.STONE, (0.0, -5.0, 0.02), (0.2, 0.2, 0.04)),
    )
    surface = np.full((100, 100), SemanticClass.GROUND, dtype=np.uint8)
    truth = build_truth(ground, things, TruthConfig())
    return World("made", 0, 0.5, ground, surface, things, (), truth)


@pytest.mark.parametrize(
    ("x", "y", "outcome", "hazard"),
    [
        (0.4, 0.0, Outcome.COLLISION, "low rock"),
        (0.4, 5.0, Outcome.COLLISION, "trunk"),
        (0.0, -5.0, Outcome.COLLISION, "ground"),
        (7.5, 0.0, Outcome.TIPOVER, "slope"),
        (-9.9, 0.0, Outcome.TIPOVER, "border"),
        (-4.0, 0.0, Outcome.TIMEOUT, "no way"),
        (-4.0, 0.0, Outcome.STUCK, "free ground"),
        (0.4, 0.0, Outcome.GOAL, ""),
    ],
)
def test_what_ended_a_drive_is_told_from_the_true_world(x, y, outcome, hazard):
    assert failure_cause(hazardous_world(), np.array([x, y]), outcome) == hazard
