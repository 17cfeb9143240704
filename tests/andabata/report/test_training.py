"""Report of training runs: figures, test drives, and runs that it refuses."""

import json

import pytest

from andabata.app.cli import main
from andabata.configuration.settings import resolve
from andabata.training.plans import TrainingPlan, load_plan
from andabata.training.run import HISTORY, learn, read_history


def plan(*more):
    """Return a plan of two tiny stages."""
    overrides = ["validation=1", "learner.hidden=[16, 16]", *more]
    overrides += ["learner.episodes_per_iteration=2"]
    overrides += ["stages.Maze2D.episodes=4", "stages.Maze3D.episodes=2"]
    for name, limit in (("Maze2D", 4.0), ("Maze3D", 3.0)):
        overrides += [
            f"stages.{name}.environment.seeds=[0, 1]",
            f"stages.{name}.environment.terminations.time_limit={limit}",
        ]
    return resolve(TrainingPlan, overrides=overrides, base=load_plan("actor-critic"))


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Return a folder with two runs, of two stages and of one."""
    folder = tmp_path_factory.mktemp("runs")
    learn(folder / "five", plan(), range(2), 5)
    learn(folder / "six", plan(), range(1), 6)
    return folder


def report(capsys, *words):
    """Return the exit code, and the result or the error text."""
    code = main(["report", *map(str, words), "--json", "--quiet"])
    printed = capsys.readouterr()
    return code, json.loads(printed.out) if code == 0 else printed.err


def test_two_runs_are_driven_and_drawn(capsys, runs, tmp_path):
    """Two runs of a plan give figures, test drives and the same page again."""
    words = [runs / "five", runs / "six", "--tests", "2", "--out", tmp_path / "page.html"]
    code, data = report(capsys, *words)
    assert code == 0
    page = (tmp_path / "page.html").read_bytes()
    assert page.count(b"<figcaption") == 6  # Rewards, 2 of goals, world, scans, tests.
    # Only stage 1 is over in both.
    assert [(row["run"], row["stage"]) for row in data["stages"]] == [
        ("seed 5", "Maze2D"),
        ("seed 6", "Maze2D"),
    ]
    history = [row for row in read_history(runs / "five" / HISTORY) if row["name"] == "Maze2D"]
    (row, _) = data["stages"]
    assert row["goal_last_40"] == sum(g["outcomes"].get("goal", 0) for g in history)
    steps = history[-1]["steps"]  # Stage 1 has no episodes of earlier stages.
    assert row["mean_time_s"] == pytest.approx(0.1 * steps / 4)
    drives = data["tests"]
    assert [(row["run"], row["test"]) for row in drives] == [
        ("seed 5", 1),
        ("seed 5", 2),
        ("seed 6", 1),
        ("seed 6", 2),
    ]
    assert all(row["shortest_m"] > 5 for row in drives)
    # Four seconds at 0.3 m/s are too few to cross a maze.
    assert all(row["distance_m"] < 0.35 * 4 for row in drives)
    assert all(row["outcome"] != "goal" and row["time_s"] <= 4 for row in drives)
    again = [*words[:-1], tmp_path / "again.html", "--workers", "1"]
    assert report(capsys, *again)[0] == 0
    assert (tmp_path / "again.html").read_bytes() == page


def test_the_page_of_one_run_is_in_its_folder(capsys, runs):
    """The page of one run is written into its folder."""
    code, data = report(capsys, runs / "five", "--tests", "1", "--workers", "1")
    assert code == 0
    assert [row["stage"] for row in data["tests"]] == ["Maze2D", "Maze3D"]
    assert data["report"] == str(runs / "five/report.html")


def test_runs_that_do_not_belong_together_are_refused(capsys, runs, tmp_path):
    """Runs of different plans, or with one seed twice, are refused."""
    learn(tmp_path / "other", plan("learner.action_repeat=4"), range(1), 7)
    code, error = report(capsys, runs / "five", tmp_path / "other")
    assert code == 1
    assert "expected the settings of" in error


def test_runs_with_other_rewards_stand_on_one_page(capsys, runs, tmp_path):
    """Of one seed, too: they are named by their folders."""
    learn(tmp_path / "bold", plan("stages.Maze2D.environment.reward.collision=-1"), range(1), 5)
    code, data = report(capsys, runs / "five", tmp_path / "bold", "--tests", "1", "--workers", "1")
    assert code == 0
    assert [row["run"] for row in data["tests"]] == ["five, seed 5", "bold, seed 5"]
    assert {row["stage"] for row in data["tests"]} == {"Maze2D"}


def test_a_run_does_not_stand_on_a_page_twice(capsys, runs):
    """It is refused with the next step."""
    code, error = report(capsys, runs / "five", runs / "five")
    assert code == 1
    assert "expected another seed in each, got [5, 5]; name each folder once" in error


def test_a_folder_without_a_finished_run_is_refused(capsys, runs, tmp_path):
    """Folders of no run, another verb, or an unfinished stage are refused."""
    code, error = report(capsys, tmp_path)
    assert code == 1
    assert "run.json: No such file" in error
    about = json.loads((runs / "six/run.json").read_text())
    (tmp_path / "run.json").write_text(json.dumps(about | {"verb": "drive"}))
    code, error = report(capsys, tmp_path)
    assert code == 1
    assert "drive.json: No such file" in error
    (tmp_path / "run.json").write_text(json.dumps(about))
    rows = read_history(runs / "six" / HISTORY)
    (tmp_path / HISTORY).write_text(json.dumps(rows[0]) + "\n")
    code, error = report(capsys, tmp_path)
    assert code == 1
    assert "expected a stage that is over, got none; train --resume" in error
    (tmp_path / HISTORY).write_text(json.dumps(rows[-1]) + "\n")
    (tmp_path / "run.json").write_text(json.dumps(about | {"forest": "0" * 64}))
    code, error = report(capsys, tmp_path)
    assert code == 1
    assert f"expected the forest of the run, {'0' * 12}, got " in error
