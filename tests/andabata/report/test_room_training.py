"""Report of training in rooms: figures of the tests by hand, several seeds and several actors."""

import json

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.app.jobs.training import with_features
from andabata.report.room_training import TABLE_1, RoomTest
from andabata.training.plans import load_plan
from andabata.training.run import HISTORY
from tests.support.room_policies import point_policy

ALL = [50] * 16


def iteration(steps, tasks, is_last=False):
    """Return a row of a history."""
    found = None if tasks is None else {"steps": tasks, "score": 0.0, "successes": 0}
    base = {"name": "Rooms", "mean_steps": 9.0, "validation": {}, "played": 16}
    return base | {"steps": steps, "tasks": found, "is_last": is_last}


def write(folder, plan, seed, tests):
    """Write the folder of a run that had tests."""
    folder.mkdir()
    about = {"verb": "train", "seed": seed, "config": plan.model_dump(mode="json")}
    about |= {"forest": "", "ground_classifier": ""}
    (folder / "run.json").write_text(json.dumps(about))
    rows = [iteration(5000 * (k + 1), tasks) for k, tasks in enumerate(tests)]
    rows.append(iteration(5000 * len(rows) + 900, None, is_last=True))
    (folder / HISTORY).write_text("".join(json.dumps(row) + "\n" for row in rows))
    (folder / "policy_Rooms.safetensors").write_bytes(point_policy(seed).to_bytes())
    return folder


def lost(*numbers):
    """Return the steps of tasks some of which failed."""
    return [None if k in numbers else 50 for k in range(16)]


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Return a folder with two seeds of one plan, and one with another actor."""
    folder = tmp_path_factory.mktemp("runs")
    plan = with_features(load_plan(task="spn"), 20)
    write(folder / "seed-0", plan, 0, [lost(3, 15), ALL, lost(15)])
    write(folder / "seed-1", plan, 1, [lost(*range(8)), *[lost(12)] * 4, lost(0)])
    write(folder / "one", load_plan("sac-1d", task="spn"), 0, [ALL])
    return folder


def report(capsys, *words):
    """Return the exit code, and the result or the error text."""
    code = main(["report", *map(str, words), "--json", "--quiet"])
    printed = capsys.readouterr()
    return code, json.loads(printed.out) if code == 0 else printed.err


def test_figures_of_seeds_are_means_of_their_best_tests(capsys, runs):
    """Scores, seeds that hold all tasks and the last tests, by hand; the page has its pictures."""
    code, data = report(capsys, runs)
    assert code == 0, data
    (group,) = data["groups"]
    assert (group["actor"], group["seeds"], group["tasks"]) == ("K = 20", 2, 16)
    whole, one_lost = 16 * 0.95, 15 * 0.95 - 1
    assert group["best_score"] == pytest.approx((whole + one_lost) / 2)
    # Tasks 12 to 15 are those of the hardest room: the second seed did them all in its last test.
    assert group["best_score_hardest_room"] == pytest.approx(4 * 0.95)
    assert group["seeds_with_all_tasks"] == 1
    assert group["last_reached"] == pytest.approx(np.mean([np.mean([14, 16, 15]), 15]))
    assert (group["paper_score_env3"], group["paper_score_env0_3"]) == TABLE_1["K = 20"]
    assert group["best_steps_to_oracle"] > 0.5
    first, second = data["runs"]
    assert (first["first_steps_with_all_tasks"], first["best_reached"]) == (10000, 16)
    assert (second["first_steps_with_all_tasks"], second["best_reached"]) == (None, 15)
    assert 0 <= first["chosen_reached"] <= 16
    page = (runs / "report.html").read_text()
    assert page.count("<figcaption") == 2
    assert "The rooms are this project&#x27;s own" in page


def test_actors_stand_side_by_side(capsys, runs):
    """Several plans have a row and curves each, named as in the paper's table."""
    words = [runs / "seed-0", runs / "seed-1", runs / "one", "--out", runs / "both.html"]
    code, data = report(capsys, *words)
    assert code == 0, data
    assert [(row["actor"], row["seeds"]) for row in data["groups"]] == [
        ("K = 20", 2),
        ("1D input", 1),
    ]
    assert data["groups"][1]["paper_score_env0_3"] == TABLE_1["1D input"][1]
    assert (runs / "both.html").read_text().count("<figcaption") == 3


def test_ratios_count_the_tasks_that_succeeded():
    """T/oracle leaves failures out, and there is none without a success."""
    test = RoomTest(5000, (50, None, 30))
    assert test.ratio([25, 10, 30]) == pytest.approx((2 + 1) / 2)
    assert RoomTest(5000, (None,)).ratio([10]) is None
    np.testing.assert_allclose(test.scores, [0.95, -1, 0.97])
    assert test.reached == 2


def test_runs_that_do_not_belong_together_are_refused(capsys, runs, tmp_path):
    """One seed twice, other rooms, no tests, and a run that is not over."""
    code, error = report(capsys, runs / "seed-0", runs / "seed-0")
    assert (code, "K = 20: expected another seed in each, got [0, 0]" in error) == (1, True)
    plan = load_plan(task="spn")
    data = plan.model_dump()
    data["stages"]["Rooms"]["environment"]["rooms"] = ["spn-env0"]
    other = write(tmp_path / "other", type(plan).model_validate(data), 3, [[50] * 4])
    code, error = report(capsys, runs / "seed-0", other)
    assert (code, "expected the rooms spn-env0, spn-env1" in error) == (1, True)
    none = write(tmp_path / "none", plan, 4, [None])
    code, error = report(capsys, none)
    assert (code, "expected tests on fixed tasks, got none" in error) == (1, True)
    (none / HISTORY).write_text(json.dumps(iteration(5000, ALL)) + "\n")
    code, error = report(capsys, none)
    assert (code, "expected a stage that is over" in error) == (1, True)
