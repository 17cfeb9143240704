"""``andabata evaluate --task spn``: its JSON, its folder, and going on after a kill."""

import json

import numpy as np
import pytest

from andabata.app.cli import main
from andabata.evaluation.ledger import read_ledger
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import RoomComparison, tasks_of
from andabata.report.room_folder import RoomFolder
from andabata.runs.folder import write_json
from rl.laws import NULL_LAWS
from worlds.rooms.catalogue import make_room

WORDS = "evaluate --task spn --policy proportional --rooms env0,env1 --lidars ten-beams --pairs 3"


def run(capsys, folder=None):
    """Return the result of the command, and its output on stderr."""
    words = [*WORDS.split(), "--memory", "reactive", "--workers", "1", "--json"]
    code = main(words if folder is None else [*words, "--out", str(folder)])
    printed = capsys.readouterr()
    assert code == 0, printed.err
    assert printed.out.count("\n") == 1
    return json.loads(printed.out)


def test_the_result_has_a_row_a_cell(capsys):
    """JSON has the rows of the evaluation, its settings and its seed."""
    data = run(capsys)
    assert [(row["room"], row["lidar"], row["memory"]) for row in data["rows"]] == [
        ("spn-env0", "ten-beams", "reactive"),
        ("spn-env1", "ten-beams", "reactive"),
    ]
    assert all(row["trials"] == 3 for row in data["rows"])
    assert data["config"]["pairs"] == 3
    assert (data["pooled"], data["seed"]) == ([], 0)


def test_the_folder_has_all_that_a_report_needs(capsys, tmp_path):
    """Result, settings, policies and drives are read back as they were."""
    data = run(capsys, tmp_path / "run")
    folder = RoomFolder(tmp_path / "run")
    assert folder.result == data
    about = folder.about
    assert (about["verb"], about["task"], about["seed"]) == ("evaluate", "spn", 0)
    assert (folder.config.rooms, folder.config.pairs) == (("spn-env0", "spn-env1"), 3)
    assert list(folder.policies) == ["proportional"]
    cell = Cell("proportional", "ten-beams", "spn-env1", "reactive")
    kept = folder.drives(cell)
    assert [drive.detail.task for drive in kept] == tasks_of(make_room("spn-env1"), folder.config)
    comparison = RoomComparison.of(folder.config, folder.policies)
    for one, other in zip(kept, comparison.drive(cell).attempts, strict=True):
        assert (one.outcome, one.detail.steps) == (other.outcome, other.detail.steps)
        np.testing.assert_allclose(one.path, other.path, atol=1e-5)
    with pytest.raises(ValueError, match="not in list"):
        folder.drives(Cell("proportional", "ten-beams", "spn-env7", "reactive"))


@pytest.mark.parametrize("is_old", [False, True])
def test_drives_are_those_of_the_policy_of_that_name(capsys, tmp_path, is_old):
    """Policies keep the order in which they were given, also in folders that do not tell it."""
    words = ["evaluate", "--task", "spn", "--policy", "proportional", "--policy", "heading"]
    words += ["--rooms", "env0", "--lidars", "ten-beams", "--memory", "reactive", "--pairs", "2"]
    assert main([*words, "--workers", "1", "--json", "--out", str(tmp_path)]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    if is_old:
        about = json.loads((tmp_path / "run.json").read_text())
        del about["policy_names"]
        write_json(tmp_path / "run.json", about)
    folder = RoomFolder(tmp_path)
    assert list(folder.policies) == ["proportional", "heading"]
    steps = {
        name: [
            drive.detail.steps
            for drive in folder.drives(Cell(name, "ten-beams", "spn-env0", "reactive"))
        ]
        for name in folder.policies
    }
    assert steps["proportional"] != steps["heading"]
    comparison = RoomComparison.of(folder.config, folder.policies)
    for name, kept in steps.items():
        cell = Cell(name, "ten-beams", "spn-env0", "reactive")
        assert [drive.detail.steps for drive in comparison.drive(cell).attempts] == kept
    assert [row["policy"] for row in rows] == ["proportional", "heading"]


def test_null_controllers_stand_beside_the_shipped_policy(capsys):
    """Where no policy is named; whoever names some gets these alone."""
    words = ["evaluate", "--task", "td3", "--rooms", "clutter-7300", "--memory", "reactive"]
    words += ["--pairs", "1", "--engine", "serial", "--json", "--quiet"]
    for named, expected in (([], ["shipped", *NULL_LAWS]), (["--policy", "sees"], ["sees"])):
        assert main([*words, *named]) == 0
        rows = json.loads(capsys.readouterr().out)["rows"]
        assert [row["policy"] for row in rows] == expected


def test_a_killed_evaluation_goes_on(capsys, tmp_path):
    """After a kill in the second cell the first is not driven again, and the rows are the same."""
    data = run(capsys, tmp_path / "run")
    folder = RoomFolder(tmp_path / "run")
    lines = folder.journal.read_text().splitlines()
    folder.journal.write_text("\n".join(lines[:2]) + "\n" + lines[2][:30])
    (first, second) = (folder.path / "drives" / f"{k}.npz" for k in (0, 1))
    first.unlink()
    second.unlink()
    (folder.path / "evaluation.json").unlink()
    assert run(capsys, tmp_path / "run") == data
    assert not first.exists()
    assert second.exists()


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        ("--task moon", 2, "--task: expected offroad, spn, td3 or barn, got 'moon'"),
        ("--task spn --world maze", 2, "--world: expected options of --task spn alone"),
        ("--task spn --robot husky", 2, "--robot: expected options of --task spn alone"),
        ("--task spn --forest f", 2, "--forest: expected options of --task spn alone"),
        ("--rooms env0", 2, "--rooms: expected options of --task offroad alone"),
        ("--task spn --rooms moon", 2, "--rooms: expected one of gdae, spn-crowded"),
        ("--task spn --policy proportional --set rooms=['x']", 2, "barn-narrow-K, got 'x'"),
        ("--task spn --policy proportional --set pair=1", 2, "pair: expected a known field"),
        ("--task spn --policy missing", 1, "missing: No such file"),
        ("--policy a --policy b", 2, "--policy: expected one off-road, got 2"),
    ],
)
def test_errors_take_one_line(capsys, words, code, message):
    """A mistake is one line on stderr with its exit code."""
    assert main(["evaluate", *words.split(), "--quiet", "--workers", "1"]) == code
    printed = capsys.readouterr()
    assert (printed.out, printed.err.count("\n")) == ("", 1)
    assert message in printed.err


STUDY = "lidar-study --policy proportional --rooms env0 --pairs 4 --workers 1"


def test_a_study_prints_rows_and_advice(capsys, tmp_path):
    """JSON has a row a laser; the folder is read as that of an evaluation."""
    sets = [f"--set={name}=[]" for name in ("left", "turned", "resolution_deg", "max_range")]
    words = [*STUDY.split(), *sets, "--set=forward=[0.05]", "--set=fov_deg=[90]"]
    assert main([*words, "--json", "--out", str(tmp_path / "run")]) == 0
    data = json.loads(capsys.readouterr().out)
    names = ["as it is", "0.05 m forward", "field of view 90 deg"]
    assert [row["text"] for row in data["rows"]] == names
    assert data["advice"].startswith("No pose is shown to be better")
    assert data["policies"] == ["proportional"]
    folder = RoomFolder(tmp_path / "run")
    assert (folder.about["verb"], folder.result) == ("lidar-study", data)
    assert len(folder.drives(Cell("proportional", "90|20|10|0", "spn-env0", "reactive"))) == 4
    assert main([*words, "--quiet"]) == 0
    out = capsys.readouterr().out
    assert "0.05 m forward" in out
    assert data["advice"] in out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--lidar radar", "--lidar: expected FOV|RESOLUTION|RANGE"),
        ("--lidar ten-beams,front-180", "--lidar: expected one laser"),
        ("--memory both", "--memory: expected reactive or map, got 'both'"),
        ("--rooms moon", "--rooms: expected one of gdae, spn-crowded"),
        ("--set forward=[5]", "with x 5: Input should be less than or equal to 1"),
    ],
)
def test_a_study_of_what_cannot_be_is_refused(capsys, words, message):
    """A mistake is one line on stderr with exit code 2."""
    assert main([*STUDY.split(), *words.split()]) == 2
    printed = capsys.readouterr()
    assert (printed.out, printed.err.count("\n")) == ("", 1)
    assert message in printed.err


def test_what_was_trained_is_evaluated_and_reported(capsys, tmp_path):
    """TD3's task from training to page: two seeds of GDAE's plan, a law, and movers."""
    out = tmp_path / "gdae"
    sets = ("stages.Rooms.steps=200", "validation=1", "stages.Rooms.environment.random_rooms=1")
    small = ["learner.hidden=[8, 8]", "learner.updates_per_step=0.05", *sets]
    words = ["train", "--task", "td3", "--variant", "gdae", "--seeds", "2", "--workers", "1"]
    words += [word for text in small for word in ("--set", text)]
    assert main([*words, "--out", str(out), "--json", "--quiet"]) == 0
    assert [run["stage"] for run in json.loads(capsys.readouterr().out)["runs"]] == ["Rooms"] * 2
    policies = [("--policy", str(out / f"seed-{seed}/policy.safetensors")) for seed in (0, 1)]
    words = ["evaluate", "--task", "td3", *(word for pair in policies for word in pair)]
    words += ["--policy", "heading", "--rooms", "clutter-movers-7300", "--memory", "reactive"]
    words += ["--pairs", "2", "--workers", "1", "--quiet"]
    folder = tmp_path / "rooms"
    assert main([*words, "--out", str(folder), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [row["policy"] for row in data["rows"]] == ["seed-0", "seed-1", "heading"]
    assert [row["policy"] for row in data["pooled"]] == ["seed-0, seed-1"]
    for row in data["rows"]:
        assert (row["lidar"], row["movers"] > 0) == ("trained", True)
        assert row["hit_by_mover"] + row["hit_at_rest"] <= row["collisions"]
    assert RoomFolder(folder).about["task"] == "td3"
    for made in (out, folder):
        assert main(["report", str(made), "--json", "--quiet"]) == 0
        capsys.readouterr()
    assert "Fig. 4a" in (out / "report.html").read_text()
    page = (folder / "report.html").read_text()
    assert "hit by a mover while standing" in page


def test_a_release_is_judged_in_the_rooms_of_the_task(capsys, tmp_path, monkeypatch):
    """On starts and goals of its own beside laws, once; tried with a split that is patched."""
    monkeypatch.setattr("worlds.splits.JUDGING_START", 7)
    monkeypatch.setattr("andabata.evaluation.judging.JUDGED_TRIALS", 1)
    monkeypatch.setattr("andabata.evaluation.rooms.JUDGES_BY_TASK", {"spn": ("spn-env0",)})
    monkeypatch.setattr("andabata.evaluation.ledger.commit", lambda: "0123456789ab")
    path = tmp_path / "own.jsonl"
    path.touch()
    words = ["evaluate", "--task", "spn", "--release", "0.0.0", "--ledger", str(path)]
    words += ["--policy", "proportional", "--lidars", "ten-beams", "--memory", "reactive"]
    words += ["--engine", "serial", "--json", "--quiet", "--out"]
    assert main([*words, str(tmp_path / "run")]) == 0
    data = json.loads(capsys.readouterr().out)
    policies = [row["policy"] for row in data["rows"]]
    assert policies == ["proportional", *NULL_LAWS]
    assert (data["seed"], data["config"]["pairs"]) == (7, 1)
    assert (data["config"]["task"]["drift"], data["config"]["task"]["noise"]) == (1.0, 0.01)
    (entry,) = read_ledger(path)
    assert (entry.table, entry.state) == ("evaluate spn", "finished")
    assert entry.seeds == "starts and goals of seed 7, 1 in each room"
    assert main([*words, str(tmp_path / "other")]) == 1
    assert "expected a release that evaluate spn has not judged" in capsys.readouterr().err
    for more in (["--seed", "0"], ["--rooms", "env0"]):
        assert main([*words, str(tmp_path / "new"), *more]) == 2
        assert f"--release: expected no {more[0]}" in capsys.readouterr().err
    assert main([*words, str(tmp_path / "new"), "--pairs", "0"]) == 2
    assert "--pairs: expected 1 or more" in capsys.readouterr().err
    assert main([*words, str(tmp_path / "shield"), "--set", "task.shield={}"]) == 0
    assert [each.table for each in read_ledger(path)][1:] == ["evaluate spn, with the shield"]
