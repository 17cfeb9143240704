"""Report of training for TD3's task: curves and figures by hand, plans side by side."""

import json

import pytest

from andabata.app.cli import main
from andabata.report.success import plan_name, success_curves
from andabata.report.training_folder import TrainingRun
from andabata.training.plans import load_plan
from andabata.training.run import HISTORY
from tests.support.room_policies import window_policy


def write(folder, plan_name, seed, rates, steps=1000):
    """Write the folder of a run that counts a success rate after each 100 episodes."""
    folder.mkdir()
    plan = load_plan(plan_name, task="td3")
    about = {"verb": "train", "seed": seed, "config": plan.model_dump(mode="json")}
    (folder / "run.json").write_text(json.dumps(about | {"forest": "", "ground_classifier": ""}))
    base = {"name": "Rooms", "mean_steps": 9.0, "played": 50, "is_last": False, "validation": {}}
    rows = [base | {"episodes": 50, "steps": 10, "recent_success": 1.0}]
    for k, rate in enumerate(rates, start=1):
        rows.append(base | {"episodes": 100 * k, "steps": steps * k, "recent_success": rate})
    rows[-1] |= {"is_last": True, "validation": {"Rooms": 0.75}}
    (folder / HISTORY).write_text("".join(json.dumps(row) + "\n" for row in rows))
    (folder / "policy_Rooms.safetensors").write_bytes(window_policy(plan_name).to_bytes())
    return folder


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Return a folder with two seeds of one plan, the baseline, and a baseline that was changed."""
    folder = tmp_path_factory.mktemp("runs")
    write(folder / "seed-0", "td3", 0, [0.2, 0.9, 1.0, 1.0])
    write(folder / "seed-1", "td3", 1, [0.4, 0.8, 0.9])
    write(folder / "gdae", "gdae", 0, [0.1, 0.3, 0.5], steps=8000)
    slower = write(folder / "gdae-slower", "gdae", 0, [0.1, 0.8], steps=9000)
    about = json.loads((slower / "run.json").read_text())
    about["config"]["learner"]["learning_rate"] = 1e-4
    (slower / "run.json").write_text(json.dumps(about))
    return folder


def test_curves_are_those_that_all_seeds_have(runs):
    """Nothing is counted before the window is full; the longer run is cut."""
    found = success_curves([TrainingRun.read(runs / f"seed-{seed}") for seed in (0, 1)])
    assert found.episodes.tolist() == [100, 200, 300]
    assert found.steps.tolist() == [1000, 2000, 3000]
    assert found.rates.tolist() == [[0.2, 0.9, 1.0], [0.4, 0.8, 0.9]]


def test_plans_are_named_by_what_they_change(runs):
    """Each variant has its name; a changed one that of the nearest, with the settings changed."""
    run = TrainingRun.read(runs / "gdae")
    assert plan_name(run) == "gdae"
    shipped = run.plan.learner
    run.plan.__dict__["learner"] = shipped.model_copy(update={"tau": 0.3})
    assert plan_name(run) == "gdae, tau=0.3"
    three = {"gamma": 0.9, "tau": 0.3, "batch_size": 64}
    run.plan.__dict__["learner"] = shipped.model_copy(update=three)
    assert plan_name(run) == "gdae, gamma=0.9, tau=0.3 and 1 more"


def test_the_report_compares_with_the_baseline(capsys, runs):
    """Means over seeds, the first good episode, and the share of the baseline's steps, by hand.

    The baseline is the run of its plan that ends best, here one with another learning rate.
    """
    names = ("seed-0", "seed-1", "gdae", "gdae-slower")
    words = [*(runs / name for name in names), "--out", runs / "all.html"]
    code = main(["report", *map(str, words), "--json", "--quiet"])
    printed = capsys.readouterr()
    assert code == 0, printed.err
    td3, gdae, slower = json.loads(printed.out)["groups"]
    assert (td3["plan"], td3["seeds"], td3["episodes"], td3["steps"]) == ("td3", 2, 300, 3000)
    assert td3["success"] == pytest.approx(0.95)
    assert td3["lowest_success"] == pytest.approx(0.9)
    assert td3["first_good_episodes"] == 200
    assert td3["share_of_baseline"] == pytest.approx(2000 / 18000)
    assert (gdae["first_good_episodes"], gdae["share_of_baseline"]) == (None, None)
    assert (slower["plan"], slower["share_of_baseline"]) == ("gdae, learning_rate=0.0001", 1.0)
    assert (runs / "all.html").read_text().count("<figcaption") == 4


def test_runs_of_two_tasks_are_not_mixed(capsys, runs, tmp_path):
    """SPN's training has a report of its own."""
    other = tmp_path / "spn"
    other.mkdir()
    config = load_plan(task="spn").model_dump(mode="json")
    (other / "run.json").write_text(json.dumps({"verb": "train", "config": config}))
    assert main(["report", str(runs / "gdae"), str(other), "--quiet"]) == 2
    error = capsys.readouterr().err
    assert "expected a run of `train --task td3` as the first, got `train --task spn`" in error
