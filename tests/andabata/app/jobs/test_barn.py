"""``andabata evaluate --task barn``: options, results, tables, errors."""

import json

import pytest

from andabata.app.barn_tables import barn_tables
from andabata.app.cli import main
from andabata.app.options.evaluation import BarnEvaluationOptions, TrialOptions
from andabata.configuration.usage import UsageError
from andabata.evaluation.barn import BarnEvaluationConfig
from andabata.models import shipped_policy
from tests.support.barn_folders import write_world
from tests.support.moving_barn_folders import write_moving_world

BLIND = ["evaluate", "--task", "barn", "--controllers", "straight,random", "--workers", "1"]


def test_the_defaults_are_the_benchmarks():
    """Generated worlds, all controllers, ten trials, the benchmark's robot."""
    assert BarnEvaluationOptions().base(0, TrialOptions()) == BarnEvaluationConfig()
    driven = TrialOptions("gap", 3)
    config = BarnEvaluationOptions(vehicle="barn-slow", told=True, fields="narrow").base(5, driven)
    assert (config.controllers, config.trials, config.seed) == (("gap",), 3, 5)
    assert (config.believed, config.vehicle.delay, config.fields) == (None, 0.15, "narrow")


@pytest.mark.parametrize(
    ("options", "driven", "message"),
    [
        ({"vehicle": "car"}, {}, "--vehicle: expected one of barn"),
        ({"fields": "wide"}, {}, "--fields: expected one of published, narrow"),
        ({}, {"controllers": "policy"}, "--controllers: expected some of arcs"),
        ({"official": True}, {}, "--official: expected a folder"),
        ({"official": True, "worlds": "x"}, {"trials": 3}, "--official: expected a folder"),
        ({"official": True, "worlds": "x", "vehicle": "barn-slow"}, {}, "--official"),
    ],
)
def test_other_values_are_refused(options, driven, message):
    """Each by its option."""
    with pytest.raises(UsageError, match=message):
        BarnEvaluationOptions(**options).base(0, TrialOptions(**driven))


def test_results_as_json_as_tables_and_in_a_folder(capsys, tmp_path):
    """Both scores are always there; a second call takes all from the journal."""
    words = [*BLIND, "--trials", "2", "--set", "count=2", "--out", str(tmp_path / "run")]
    assert main([*words, "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert [row["controller"] for row in data["rows"]] == ["straight", "random"]
    assert {"score", "ot_over_t", "score_low", "ot_over_t_high", "collisions"} <= set(
        data["rows"][0]
    )
    assert data["differences"][0]["against"] == "straight"
    assert len(data["failures"]) == sum(4 - row["successes"] for row in data["rows"])
    for name in ("evaluation.json", "run.json", "worlds.jsonl"):
        assert (tmp_path / "run" / name).is_file()
    assert main([*words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == data
    assert main([*words, "--quiet"]) == 0
    text = capsys.readouterr().out
    assert all(word in text for word in ("score", "OT / t", "hit", "late", "Differences"))


def test_one_controller_has_no_differences():
    """Tables without a second controller are two."""
    row = {"worlds": 1, "runs": 1, "successes": 1, "collisions": 0, "timeouts": 0, "never_left": 0}
    row |= {"success_rate": 1.0, "success_low": 0.2, "success_high": 1.0, "controller": "gap"}
    row |= {"mean_time_s": 9.0, "score": 0.5, "ot_over_t": 0.5}
    row |= {f"{name}_{end}": None for name in ("score", "ot_over_t") for end in ("low", "high")}
    data = {"rows": [row], "differences": [], "about": "light simulator"}
    assert len(barn_tables(data).renderables) == 2


def test_tables_of_moving_fields_tell_who_hit_whom(capsys, tmp_path):
    """Columns of hits with movers, and a note of what was read past in the files."""
    words = [*BLIND[:3], "--controllers", "straight", "--trials", "1", "--workers", "1"]
    moving = [*words, "--fields", "moving-hard", "--set", "first_seed=7300", "--set", "count=1"]
    assert main([*moving, "--quiet"]) == 0
    assert "standing" in capsys.readouterr().out
    folder = write_moving_world(tmp_path)
    assert main([*words, "--worlds", str(folder), "--quiet"]) == 0
    text = capsys.readouterr().out
    assert "standing" not in text
    assert "read as <pose> (the first of 4 such faults)" in " ".join(text.split())


def test_broken_folders_are_named(capsys, tmp_path):
    """A missing folder, a missing path, a broken world: file, line and element."""
    assert main([*BLIND, "--worlds", str(tmp_path / "none")]) != 0
    assert "expected a folder with world_N.world" in capsys.readouterr().err
    folder = write_world(tmp_path / "worlds")
    (folder / "path_1.npy").rename(folder / "path_2.npy")
    assert main([*BLIND, "--worlds", str(folder)]) != 0
    assert "expected path_1.npy for world_1" in capsys.readouterr().err
    (folder / "path_2.npy").rename(folder / "path_1.npy")
    file = folder / "world_1.world"
    file.write_text(file.read_text().replace("<length>1</length>", "<length>x</length>", 1))
    assert main([*BLIND, "--worlds", str(folder)]) != 0
    assert "world_1.world:" in (text := capsys.readouterr().err)
    assert "<length>" in text


def test_options_of_other_tasks_are_refused(capsys):
    """Off-road and in rooms what belongs to barn, and the other way."""
    for words in (
        ["evaluate", "--worlds", "x"],
        ["evaluate", "--task", "spn", "--official"],
        ["evaluate", "--task", "spn", "--trials", "3"],
        [*BLIND, "--rooms", "env0"],
        [*BLIND, "--world", "maze"],
    ):
        assert main(words) != 0
        assert "expected options of --task" in capsys.readouterr().err


def test_a_policy_that_drives_elsewhere_is_refused(capsys, tmp_path):
    """A file of another policy, and several files; options of classifiers stay refused."""
    file = tmp_path / "spn.safetensors"
    file.write_bytes(shipped_policy("spn").to_bytes())
    words = [*BLIND[:3], "--controllers", "distilled", "--workers", "1", "--set", "count=1"]
    assert main([*words, "--policy", str(file)]) != 0
    text = " ".join(capsys.readouterr().err.split())
    assert "expected a policy distilled from the sampling MPC" in text
    assert "andabata policy distill" in text
    assert main([*words, "--policy", str(file), "--policy", str(file)]) != 0
    assert "--policy: expected one with --task barn, got 2" in capsys.readouterr().err
    assert main([*words, "--forest", str(file)]) != 0
    assert "expected options of --task" in capsys.readouterr().err
