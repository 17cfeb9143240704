"""``andabata evaluate``: options, one table, going on after a kill."""

import json

import pytest

from andabata.app.cli import main
from andabata.app.jobs import offroad
from andabata.evaluation import ledger
from andabata.evaluation.judging import JUDGED_BESIDE, JUDGED_FORM
from andabata.evaluation.ledger import read_ledger
from andabata.models import shipped_policy
from rl.policy import with_info
from tests.support.plants import needs_bullet
from worlds.splits import EVALUATION_START, judging_world


def test_the_command_prints_one_table_and_resumes(capsys, tmp_path):
    """The command's rows are the same after a kill in the second trial."""
    words = ["evaluate", "--world", "maze", "--controllers", "straight,oracle", "--trials", "2"]
    words += ["--workers", "1", "--set", "simulated_robot.plant=kinematic"]
    words += ["--set", "terminations.time_limit=30", "--json"]
    words += [
        "--set",
        "simulated_robot.sensing.scanner=horizontal",
        "--out",
        str(tmp_path / "eval"),
    ]

    def result():
        assert main(words) == 0
        out = capsys.readouterr().out
        assert out.count("\n") == 1  # One JSON object and nothing else.
        return json.loads(out)

    data = result()
    assert data["reality"] == "field"
    assert not {"perturbations", "faults"} & set(data)
    (pair,) = data["differences"]
    assert (pair["controller"], pair["against"], pair["trials"]) == ("oracle", "straight", 2)
    assert set(data["rows"][0]) >= {
        *("controller", "world", "goal", "trials", "successes", "collisions", "tipovers"),
        *("timeouts", "stuck", "success_rate", "wilson_low", "wilson_high", "spl"),
        *("trespass_m", "distance_m", "mean_time_s", "steering_variation"),
    }
    assert {row["controller"] for row in data["rows"]} == {"straight", "oracle"}
    assert all({"cause", "count"} <= set(row) for row in data["failures"])
    journal = tmp_path / "eval/trials.jsonl"
    lines = journal.read_text().splitlines()
    journal.write_text("\n".join(lines[:2]) + "\n" + lines[2][:40])  # A kill in the second trial.
    assert result()["rows"] == data["rows"]


@pytest.mark.parametrize(
    ("words", "controllers"),
    [
        ([], ("planner", "reactive")),
        (["--policy", "own"], ("policy+planner", "planner", "reactive")),
    ],
)
def test_the_planner_stands_beside_a_policy_of_ones_own(words, controllers, tmp_path, monkeypatch):
    """Where no controllers are named; nothing is driven here."""
    evaluations = []

    def note(*parts, **others):
        evaluations.append(parts[1])
        raise ValueError("nothing is driven")

    (tmp_path / "own").write_bytes(with_info(shipped_policy(), {"name": "own"}).to_bytes())
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(offroad, "Evaluation", note)
    assert main(["evaluate", "--trials", "1", *words]) != 0
    (config,) = evaluations
    assert config.controllers == controllers


@pytest.mark.parametrize("verb", [["drive"], ["ros", "navigator"]])
def test_a_policy_beside_another_controller_is_refused(verb, tmp_path, monkeypatch, capsys):
    """Whatever the command, before anything is driven."""
    (tmp_path / "own").write_bytes(with_info(shipped_policy(), {"name": "own"}).to_bytes())
    monkeypatch.chdir(tmp_path)
    assert main([*verb, "--controller", "reactive", "--policy", "own"]) == 1
    message = "--policy: expected a controller that drives by it, got reactive"
    assert message in capsys.readouterr().err


def test_disturbances_come_with_what_they_cost(capsys, tmp_path):
    """Rows have every arm, ``perturbations`` the differences, ``run.json`` the level."""
    words = ["evaluate", "--world", "maze", "--controllers", "straight", "--trials", "2"]
    words += ["--workers", "1", "--reality", "field", "--perturb", "latency=0.3", "--json"]
    words += ["--set", "simulated_robot.plant=kinematic", "--set", "terminations.time_limit=4"]
    words += ["--set", "simulated_robot.sensing.scanner=horizontal", "--out", str(tmp_path)]
    assert main(words) == 0
    data = json.loads(capsys.readouterr().out)
    names = {row["controller"] for row in data["rows"]}
    assert names == {"straight", "straight@latency=0.3"}
    (row,) = data["perturbations"]
    assert (row["disturbance"], row["strength"], row["trials"]) == ("latency", 0.3, 2)
    assert data["reality"] == "field"
    about = json.loads((tmp_path / "run.json").read_text())
    assert about["reality"] == "field"
    assert about["config"]["simulated_robot"]["reality"]["soft_iron"] == 0.03


@pytest.fixture
def tiny(monkeypatch, tmp_path):
    """Patch the judging split to worlds that were looked at, and return words of two trials.

    Brief ones: in the plant of training, and ended after a second.
    """
    monkeypatch.setattr("worlds.splits.JUDGING_START", EVALUATION_START)
    form = {name: value for name, value in JUDGED_FORM.items() if name != "terminations"}
    for name, value in (
        ("JUDGED_TRIALS", 2),
        ("JUDGED_PLANTS", ("kinematic", "wheels")),
        ("JUDGED_FORM", form),
    ):
        monkeypatch.setattr(f"andabata.evaluation.judging.{name}", value)
    monkeypatch.setattr(ledger, "commit", lambda: "0123456789ab")
    (tmp_path / "own.jsonl").touch()
    return [
        *("evaluate", "--release", "0.0.0", "--ledger", str(tmp_path / "own.jsonl")),
        *("--controllers", "straight", "--engine", "serial", "--json", "--quiet"),
        *("--set", "simulated_robot.plant=kinematic", "--set", "terminations.time_limit=1"),
        *("--set", "simulated_robot.sensing.scanner=horizontal"),
    ]


@needs_bullet
def test_a_release_is_judged_once_beside_null_controllers(tiny, capsys, tmp_path):
    """Its worlds, all controllers, an entry; it goes on in its folder and nowhere else."""
    path, words = tmp_path / "own.jsonl", [*tiny, "--out", str(tmp_path / "run")]
    assert main(words) == 0
    data = json.loads(capsys.readouterr().out)
    controllers = {row["controller"] for row in data["rows"]}
    assert controllers == {"straight", *JUDGED_BESIDE}
    assert {row["trials"] for row in data["rows"]} == {2}
    assert [row["controller"] for row in data["differences"]] == list(JUDGED_BESIDE)
    assert data["reality"] == "field"
    assert data["seed"] == judging_world("0.0.0", 0)
    (entry,) = read_ledger(path)
    assert data["ledger"] == entry.model_dump(mode="json")
    assert (entry.table, entry.release, entry.state) == ("evaluate off-road", "0.0.0", "finished")
    assert entry.seeds == f"natural-test {EVALUATION_START} to {EVALUATION_START + 1}"
    journal = tmp_path / "run/trials.jsonl"
    lines = journal.read_text().splitlines()
    assert [json.loads(line)["rows"][0]["world_seed"] for line in lines[1:]] == [
        *(EVALUATION_START, EVALUATION_START + 1),
    ]
    journal.write_text("\n".join(lines[:2]) + "\n" + lines[2][:40])  # A kill in the second trial.
    assert main(words) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == data["rows"]
    assert main([*tiny, "--out", str(tmp_path / "other")]) == 1
    assert "expected a release that evaluate off-road has not judged" in capsys.readouterr().err
    assert len(read_ledger(path)) == 1


@needs_bullet
def test_in_the_other_plant_those_that_are_asked_for_are_judged(tiny, capsys, tmp_path):
    """In the same worlds, and in a table of its own."""
    path, other = tmp_path / "own.jsonl", ["--set", "simulated_robot.plant=wheels"]
    assert main([*tiny, *other, "--out", str(tmp_path / "run")]) == 0
    data = json.loads(capsys.readouterr().out)
    assert {row["controller"] for row in data["rows"]} == {"straight"}
    (entry,) = read_ledger(path)
    assert entry.table == "evaluate off-road, wheels"
    assert entry.seeds == f"natural-test {EVALUATION_START} to {EVALUATION_START + 1}"


@needs_bullet
@pytest.mark.parametrize(
    ("more", "message"),
    [
        ([], "--release: expected --out beside it, got none"),
        (["--out", "x", "--seed", "0"], "--release: expected no --seed beside it"),
        (["--out", "x", "--world", "lake"], "--world: expected natural-test, "),
        (["--out", "x", "--suite", "development"], "--release: expected no --suite beside it"),
        (["--out", "x", "--trials", "1"], "--trials: expected 2 to 1000"),
        (["--out", "x", "--set", "world=lake"], "world: expected natural-test"),
        (["--out", "x", "--set", "seed=3"], "seed: expected that of release"),
        (["--out", "x", "--task", "barn"], "--release, --ledger: expected options of --task barn"),
    ],
)
def test_what_a_release_leaves_no_choice_of_is_refused(
    tiny, capsys, tmp_path, monkeypatch, more, message
):
    """Before anything is driven or entered."""
    monkeypatch.chdir(tmp_path)
    words = tiny if "barn" not in more else tiny[: tiny.index("--controllers")]
    assert main([*words, *more]) == 2
    assert capsys.readouterr().err.startswith("error: ")
    assert main([*words, *more]) == 2
    assert message in capsys.readouterr().err
    assert (tmp_path / "own.jsonl").read_bytes() == b""
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(
    "words",
    [
        ["evaluate", "--seed", "500800000"],
        ["evaluate", "--set", "seed=500800000"],
        ["evaluate", "--task", "spn", "--set", "seed=500800000"],
        ["drive", "--seed", "500800000"],
        ["demo", "--seed", "500800000"],
        ["world", "render", "maze", "--seed", "500800000"],
        ["bench", "localization", "--seed", "500800000"],
        ["bench", "fields", "--seed", "500800000"],
        ["clouds", "generate", "--out", "x", "--seed", "500800000"],
        ["train", "--out", "x", "--set", "stages.Maze2D.environment.seeds=[500800000]"],
        ["evaluate", "--task", "td3", "--rooms", "clutter-500800000"],
    ],
)
def test_a_judging_seed_without_its_release_is_refused(words, capsys, tmp_path, monkeypatch):
    """Whatever the command: what was expected, what came, what to do."""
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    error = capsys.readouterr().err
    assert "got 500800000, which judges 0.2.0; take another seed" in error
    assert "evaluate --release 0.2.0" in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())
