"""Runs of evaluations of every kind: tables, folder, progress."""

import json

import pytest

from andabata.app.console import Console
from andabata.app.jobs.evaluation import Evaluation, run_evaluation
from andabata.engine import SerialEngine
from tests.support.toy_benchmark import TOY_TABLE, ToyComparison, ToyConfig


@pytest.fixture
def evaluation():
    """Return an evaluation whose command had another seed than its settings."""
    config = ToyConfig(controllers=("walker", "runner"), seed=5)
    comparison = ToyComparison(config.controllers, config.seed)
    files = {"policies/0.txt": b"one"}

    def tabulate(attempts, engine):
        assert isinstance(engine, SerialEngine)
        return {"rows": TOY_TABLE.rows(attempts)}

    about = {"task": "toy", "extra": [1]}
    return Evaluation("evaluate", config, 7, comparison, tabulate, about, files)


def test_the_result_has_tables_settings_and_seed(evaluation):
    """The seed is the command's; without a folder nothing is written."""
    data = run_evaluation(evaluation, SerialEngine(), None, Console(quiet=True))
    assert list(data) == ["rows", "config", "seed"]
    assert (data["seed"], data["config"]["seed"]) == (7, 5)
    assert [row["controller"] for row in data["rows"]] == ["walker", "runner"]


def test_the_folder_has_journal_result_settings_and_files(evaluation, tmp_path):
    """``run.json`` says how it was made; files of the run and of its cells stand beside."""
    folder = tmp_path / "new" / "run"
    data = run_evaluation(evaluation, SerialEngine(), folder, Console(quiet=True))
    assert json.loads((folder / "evaluation.json").read_text()) == data
    about = json.loads((folder / "run.json").read_text())
    assert (about["verb"], about["task"], about["extra"]) == ("evaluate", "toy", [1])
    assert (about["seed"], about["config"]) == (7, data["config"])
    assert (folder / "policies/0.txt").read_bytes() == b"one"
    assert (folder / "maps/moor.txt").read_bytes() == b"moor"
    assert len((folder / "toy.jsonl").read_text().splitlines()) == 1 + 3


def test_progress_names_the_cells(evaluation, capsys):
    """One step for each, called as the comparison calls it."""
    run_evaluation(evaluation, SerialEngine(), None, Console())
    text = capsys.readouterr().err
    assert "worlds" in text
    assert "3/3" in text
    assert "the moor" in text
