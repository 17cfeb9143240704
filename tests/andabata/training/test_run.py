"""Whole runs through the command line: the same seed gives the same bytes, a kill costs nothing."""

import json

import pytest

from andabata.app.cli import main
from andabata.app.settings import resolve
from andabata.training.plans import TrainingPlan, load_plan
from andabata.training.run import CHECKPOINT, HISTORY, POLICY, learn
from rl.policy import Policy
from traversability.cartesian.classifier import GroundClassifier


def result(capsys, *words):
    code = main([*words, "--json"])
    out = capsys.readouterr().out
    assert code == 0
    assert out.count("\n") == 1  # One JSON object and nothing else.
    return json.loads(out)


@pytest.fixture(scope="module")
def clouds(tmp_path_factory):
    folder = tmp_path_factory.mktemp("clouds")
    words = ["clouds", "generate", "--out", str(folder), "--train", "2", "--validation", "1"]
    assert main([*words, "--seed", "7", "--workers", "1", "--quiet"]) == 0
    return folder


def test_the_same_seed_gives_the_same_clouds_whatever_the_workers(capsys, clouds, tmp_path):
    words = ["--train", "2", "--validation", "1", "--seed", "7", "--workers", "2"]
    again = result(capsys, "clouds", "generate", "--out", str(tmp_path / "again"), *words)
    manifest = json.loads((clouds / "manifest.json").read_text())
    assert again["sha256"] == {entry["file"]: entry["sha256"] for entry in manifest["clouds"]}
    assert (tmp_path / "again/manifest.json").read_bytes() == (
        clouds / "manifest.json"
    ).read_bytes()


def test_a_classifier_is_trained_and_judged(capsys, clouds, tmp_path):
    out = tmp_path / "forest"
    words = ["--clouds", str(clouds), "--out", str(out), "--set", "trees=30"]
    # Two clouds have too few cells for the usual leaves, and for a screen before the trees.
    words += ["--set", "min_leaf=20", "--set", "screen_trees=0"]
    data = result(capsys, "classifier", "train", *words)
    names = [
        "accuracy",
        "precision",
        "recall",
        "specificity",
        "balanced_accuracy",
        "f1_red",
        "iou_red",
    ]
    assert all(0 <= data[name] <= 1 for name in names)
    assert set(data["confusion"]) == {"tp", "tn", "fp", "fn"}
    assert sum(data["n_cells"].values()) == 320
    again = result(
        capsys,
        "classifier",
        "evaluate",
        "--clouds",
        str(clouds),
        "--forest",
        str(out / "forest.npz"),
    )
    assert again["confusion"] == data["confusion"]
    assert json.loads((out / "run.json").read_text())["config"]["trees"] == 30


def test_a_classifier_of_squares_is_trained_and_judged(capsys, clouds, tmp_path):
    out = tmp_path / "squares"
    words = ["--clouds", str(clouds), "--out", str(out), "--set", "trees=30", "--set", "share=1"]
    data = result(capsys, "classifier", "ground", *words)
    assert data["ground_cells"] > 1000
    assert data["f1_red"] > 0.5  # Two clouds teach that much.
    assert list(data["bands"]) == ["0.7_to_1.8_m", "1.8_to_3.2_m", "3.2_to_5_m", "5_to_10_m"]
    learned = GroundClassifier.load(out / "ground_classifier.npz")
    assert learned.summary["config"]["trees"] == 30
    assert json.loads((out / "run.json").read_text())["config"]["share"] == 1


@pytest.mark.parametrize("wrong", ["--set trees=0", "--set tree=3"])
def test_a_wrong_setting_writes_nothing(clouds, tmp_path, wrong):
    out = tmp_path / "forest"
    words = ["classifier", "train", "--clouds", str(clouds), "--out", str(out), *wrong.split()]
    assert main(words) == 2
    assert not out.exists()


def test_controllers_are_judged_in_one_table(capsys, tmp_path):
    words = [
        "evaluate",
        "--world",
        "maze",
        "--controllers",
        "straight,oracle",
        "--trials",
        "2",
        "--workers",
        "1",
    ]
    words += ["--set", "simulated_robot.plant=kinematic", "--set", "terminations.time_limit=30"]
    words += [
        "--set",
        "simulated_robot.sensing.scanner=horizontal",
        "--out",
        str(tmp_path / "eval"),
    ]
    data = result(capsys, *words)
    row = data["rows"][0]
    assert set(row) >= {
        "controller",
        "world",
        "goal",
        "trials",
        "successes",
        "collisions",
        "tipovers",
        "timeouts",
        "stuck",
        "success_rate",
        "wilson_low",
        "wilson_high",
        "spl",
        "trespass_m",
        "distance_m",
        "mean_time_s",
    }
    assert {r["controller"] for r in data["rows"]} == {"straight", "oracle"}
    journal = tmp_path / "eval/trials.jsonl"
    lines = journal.read_text().splitlines()
    journal.write_text("\n".join(lines[:2]) + "\n" + lines[2][:40])  # A kill in the second trial.
    assert result(capsys, *words)["rows"] == data["rows"]


def test_a_drive_is_drawn(capsys, tmp_path):
    words = ["drive", "--world", "maze", "--controller", "oracle", "--set", "plant=kinematic"]
    words += ["--set", "sensing.scanner=horizontal", "--out", str(tmp_path / "drive")]
    data = result(capsys, *words)
    assert data["success"]
    assert data["attempts"][0]["trespass_m"] == 0.0
    assert (tmp_path / "drive/drive.png").stat().st_size > 10_000
    assert json.loads((tmp_path / "drive/run.json").read_text())["config"]["plant"] == "kinematic"


def small_plan():
    overrides = ["validation=1", "learner.hidden=[16, 16]", "learner.batch=2"]
    overrides += ["learner.minibatch=16", "stages.Natural.rehearsal=0.5"]
    for name, episodes, limit in (("Maze2D", 4, 8.0), ("Maze3D", 2, 6.0), ("Natural", 2, 6.0)):
        overrides += [
            f"stages.{name}.episodes={episodes}",
            f"stages.{name}.environment.seeds=[0, 1]",
            f"stages.{name}.environment.terminations.time_limit={limit}",
        ]
    return resolve(TrainingPlan, overrides=overrides, base=load_plan())


def test_a_killed_training_ends_with_the_same_bytes(tmp_path):
    config = small_plan()
    whole = learn(tmp_path / "whole", config, range(2), 5, 1)

    def kill(generation):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        learn(tmp_path / "killed", config, range(2), 5, 1, on_iteration=kill)
    with pytest.raises(ValueError, match="expected an empty folder, got a run"):
        learn(tmp_path / "killed", config, range(2), 5, 1)
    again = learn(tmp_path / "killed", config, range(2), 5, 1, resume=True)
    for name in (CHECKPOINT, POLICY, HISTORY, "policy_Maze2D.safetensors"):
        first, second = ((tmp_path / run / name).read_bytes() for run in ("whole", "killed"))
        assert first == second, name
    assert (again["stage"], again["episodes"]) == (whole["stage"], whole["episodes"])
    info = Policy.load(tmp_path / "whole" / POLICY).info
    assert info["stage"] == "Maze3D"
    assert info["config"]["learner"]["hidden"] == [16, 16]


def test_nothing_to_resume_is_an_error(tmp_path):
    assert main(["train", "--resume", "--out", str(tmp_path / "none"), "--quiet"]) == 1
