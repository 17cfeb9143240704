"""Registry of the kinds of run: every line holds, options of other tasks are refused, one line."""

import json

import pytest
from rich.console import Console

from andabata.app import run_kinds
from andabata.app.cli import main
from andabata.app.command import Given
from andabata.app.options.evaluation import (
    BarnEvaluationOptions,
    EvaluationModelOptions,
    JudgedRobotOptions,
    OffroadEvaluationOptions,
    RoomEvaluationOptions,
    TrialOptions,
)
from andabata.app.run_kinds import (
    RUN_KINDS,
    RunKind,
    kind_of_task,
    kinds_of,
    known_kind,
    option_groups,
    refuse_foreign,
)
from andabata.configuration.usage import UsageError
from andabata.tasks.rooms import catalogue as room_tasks
from andabata.training.plans import TASKS


@pytest.mark.parametrize("kind", RUN_KINDS, ids=lambda kind: kind.name)
def test_every_function_of_the_registry_is_there(kind):
    """Each name of a line leads to a function; what is evaluated has tasks."""
    for part in ("report", "table", "evaluation", "view"):
        if ":" in getattr(kind, part):
            assert callable(kind.function(part))
    assert not kind.evaluation or kind.tasks


def text_of(table):
    """Return what a terminal of 100 columns shows."""
    console = Console(width=100, record=True, file=None, quiet=False)
    with console.capture() as capture:
        console.print(table)
    return capture.get()


def shown(name, **data):
    """Return what a terminal shows of a report's figures."""
    (kind,) = (kind for kind in RUN_KINDS if kind.name == name)
    return text_of(kind.shown(data))


def test_rows_of_figures_are_the_rows_of_a_table():
    """Values stand under the words of their keys."""
    text = shown("clouds generate", splits=[{"split": "train", "points": 12.0}])
    assert "points a cloud" in text
    assert "train" in text
    assert "12" in text
    assert "Maze2D" in shown("train", tests=[{"stage": "Maze2D", "reached": 3}])
    assert "gdae" in shown("train --task td3", groups=[{"plan": "gdae", "success": 0.5}])


def test_rows_have_the_columns_that_a_terminal_has_room_for():
    """Others of their figures are left to ``--json``."""
    row = {"drive": "run", "goal": 1, "outcome": "goal", "time_s": 4.0, "distance_m": 2.0}
    text = shown("drive", goals=[{**row, "spl": 0.9, "steering_variation": 0.123}])
    assert "reached" in text
    assert "0.90" in text
    assert "0.123" not in text
    text = shown("train --task spn", groups=[{"actor": "K = 20", "best_score": 3.8, "tasks": 16}])
    assert "3.800" in text
    assert "tasks" not in text


def given(*changed):
    """Return the groups of options of ``evaluate``, some of them changed."""
    kinds = {type(each): each for each in changed}
    groups = (*option_groups("evaluate"), JudgedRobotOptions, EvaluationModelOptions)
    return Given(*(kinds.get(group, group()) for group in groups))


@pytest.mark.parametrize(
    ("task", "changed", "message"),
    [
        (
            "spn",
            OffroadEvaluationOptions(world="maze", goals=1),
            "--world, --goals: expected options of --task spn alone, got what belongs to "
            "--task offroad; leave it out or give --task offroad",
        ),
        ("td3", TrialOptions(trials=3), "--trials: .*or give --task offroad$"),
        ("spn", JudgedRobotOptions(robot="husky"), "--robot: .*or give --task offroad$"),
        (
            "barn",
            EvaluationModelOptions(ground_classifier="x", policy=["a"]),
            "--ground-classifier: .*or give --task offroad$",
        ),
        ("barn", RoomEvaluationOptions(memory="map"), "--memory: .*or give --task spn or td3$"),
        ("offroad", RoomEvaluationOptions(pairs=1), "--pairs: .* belongs to --task spn or td3;"),
        ("offroad", BarnEvaluationOptions(told=True), "--told: .* or give --task barn$"),
    ],
)
def test_options_of_another_task_are_refused(task, changed, message):
    """Each that is not its default is named, with the task that it belongs to."""
    with pytest.raises(UsageError, match=f"^{message}"):
        refuse_foreign(kind_of_task("evaluate", task), task, given(changed))


@pytest.mark.parametrize("task", ["offroad", "spn", "td3", "barn"])
def test_defaults_and_shared_options_are_taken(task):
    """Defaults are no options; ``--trials`` belongs to two tasks, ``--policy`` to all."""
    policy = EvaluationModelOptions(policy=["a"])
    refuse_foreign(kind_of_task("evaluate", task), task, given(policy))
    if task in ("offroad", "barn"):
        refuse_foreign(kind_of_task("evaluate", task), task, given(TrialOptions("gap", 3)))


def test_an_unknown_task_is_refused():
    """The error says which tasks a verb has."""
    with pytest.raises(UsageError, match="--task: expected offroad, spn or td3, got 'moon'"):
        kind_of_task("train", "moon")
    with pytest.raises(UsageError, match="expected offroad, spn, td3 or barn, got 'moon'"):
        kind_of_task("evaluate", "moon")


def test_tasks_in_rooms_are_those_that_there_are_plans_for():
    """Training knows the tasks of the plans and of the settings."""
    assert tuple(task for kind in kinds_of("train") for task in kind.tasks) == TASKS
    assert ("offroad", *room_tasks.ROOM_TASKS) == TASKS


TOY = RunKind(
    "evaluate --task toy",
    ("evaluate",),
    tasks=("toy",),
    evaluation="tests.support.toy_benchmark:toy_evaluation",
    report="tests.support.toy_benchmark:report_toy",
    table="tests.support.toy_benchmark:toy_table",
)
"""The one line that a benchmark takes."""


@pytest.fixture
def toy(monkeypatch):
    """Add the toy benchmark to the registry."""
    monkeypatch.setattr(run_kinds, "RUN_KINDS", [*RUN_KINDS, TOY])


def test_a_benchmark_takes_one_line(toy, capsys, tmp_path):
    """Command, settings, folder, journal that goes on, table, report and refusals are there."""
    folder = tmp_path / "run"
    words = ["evaluate", "--task", "toy", "--seed", "3", "--workers", "1", "--out", str(folder)]
    assert main([*words, "--json", "--set", 'controllers=["walker","runner"]']) == 0
    data = json.loads(capsys.readouterr().out)
    assert [row["controller"] for row in data["rows"]] == ["walker", "runner"]
    assert data["rows"][0]["success_rate"] == pytest.approx(2 / 3)
    assert (data["seed"], data["config"]["controllers"]) == (3, ["walker", "runner"])
    assert known_kind(json.loads((folder / "run.json").read_text())) is TOY
    journal = folder / "toy.jsonl"
    whole = journal.read_text()
    journal.write_text("\n".join(whole.splitlines()[:2]))
    (folder / "maps/plain.txt").unlink()
    assert main([*words, "--json", "--set", 'controllers=["walker","runner"]']) == 0
    assert json.loads(capsys.readouterr().out) == data
    assert journal.read_text() == whole
    assert not (folder / "maps/plain.txt").exists()
    assert main([*words, "--set", 'controllers=["walker","runner"]', "--quiet"]) == 0
    assert "runner" in capsys.readouterr().out
    assert main(["report", str(folder), "--json", "--quiet"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == data["rows"]
    assert "Three worlds" in (folder / "report.html").read_text()
    assert main(["evaluate", "--task", "toy", "--world", "maze"]) == 2
    assert "--world: expected options of --task toy alone" in capsys.readouterr().err
    assert main([*words, "--quiet"]) == 1
    assert "differs in controllers; take another --out" in capsys.readouterr().err
