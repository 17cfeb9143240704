"""Sections on training for TD3's task: success against episodes (Guo et al., Fig. 4a)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from andabata.evaluation.room_drives import drive_tasks
from andabata.evaluation.room_policies import TRAINED
from andabata.evaluation.room_table import Cell
from andabata.evaluation.rooms import (
    REACTIVE,
    RoomEvaluationConfig,
    cell_task,
    judged_task,
    tasks_of,
)
from andabata.report.blocks import Fact, Plot, Table
from andabata.report.page import Section
from andabata.report.plots.room_curves import SuccessCurves, success_figure
from andabata.report.plots.rooms import trajectories_figure
from andabata.report.training_folder import TrainingRun, plans_text, runs_by_plan
from andabata.report.training_page import TrainingSections
from andabata.tasks.rooms.config import RoomConfig
from andabata.training.plans import algorithms, load_plan
from worlds.rooms.catalogue import make_room

Row = dict[str, Any]

GOOD = 0.85
"""Share of successes whose first episode is shown: the paper has it after 1,200."""

_BASELINE = "gdae"
"""Name of the plan whose final success the others are compared with, if it is among the runs: as it
is or with other settings, the one that ends best."""

_NAMED_CHANGES = 2
"""Largest number of changed settings in the name of a plan."""

_SHOWN_ROOMS, _SHOWN_TASKS = 4, 6
"""Numbers of rooms, and of drives in each, that are shown of a policy."""

_SUCCESS_TEXT = (
    "Success is the share of the latest episodes, exploring, that reached their goals. In the "
    "paper it is 97.12 % after 10,000 episodes, 84.78 % of GDAE, and 84.58 % after 1,200; rooms, "
    "robot and simulator are this project's own."
)

_RUNS_TEXT = "Validation: random tasks in rooms that no pool holds, not exploring."

_DRIVES_TEXT = "The first run of each plan, in rooms of validation."


def success_sections(runs: Sequence[TrainingRun]) -> TrainingSections:
    """Return the sections on training runs of TD3's task.

    Args:
        runs: Several seeds of one plan or of several.

    Raises:
        ValueError: If two runs of one plan have the same seed.
    """
    groups = runs_by_plan(runs, plan_name)
    curves = {name: success_curves(runs) for name, runs in groups.items()}
    rows = [_group_row(name, runs, curves) for name, runs in groups.items()]
    run_rows = [_run_row(name, run) for name, some in groups.items() for run in some]
    title = "mean over seeds, lowest to highest"
    caption = f"Success against episodes (Fig. 4a): {title}"
    plot = Plot(success_figure(curves, title), "success", caption, drawn=True)
    drives = (_drives(name, run) for name, (run, *_) in groups.items())
    return TrainingSections(
        title="Learning to drive without a map",
        lead=plans_text(groups, "plan"),
        rows={"groups": rows, "runs": run_rows},
        learning=Section("Success during training", _SUCCESS_TEXT, plot, Table(rows)),
        runs=Section("Runs", _RUNS_TEXT, Table(run_rows)),
        drives=Section("Drives of the policies", _DRIVES_TEXT, *drives),
        facts=[_fact(row) for row in rows],
    )


def plan_name(run: TrainingRun) -> str:
    """Return the name of the plan that differs least from a run's, and the settings that differ."""
    mine, names = _settings(run.plan.model_dump(mode="json")), algorithms("td3")
    plans = (load_plan(name, task="td3").model_dump(mode="json") for name in names)
    changes = {
        name: _changes(_settings(plan), mine) for name, plan in zip(names, plans, strict=True)
    }
    name = min(changes, key=lambda one: len(changes[one]))
    named, more = changes[name][:_NAMED_CHANGES], len(changes[name]) - _NAMED_CHANGES
    return ", ".join([name, *named]) + (f" and {more} more" if more > 0 else "")


def _settings(plan: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the settings of a plan by their names with dots."""
    found: dict[str, Any] = {}
    for name, value in plan.items():
        if isinstance(value, Mapping):
            found |= _settings(value, f"{prefix}{name}.")
        else:
            found[prefix + name] = value
    return found


def _changes(plan: Mapping[str, Any], mine: Mapping[str, Any]) -> list[str]:
    """Return the settings of a run that its plan has otherwise, each as ``name=value``."""
    names = [name for name in {**mine, **plan} if mine.get(name) != plan.get(name)]
    return [f"{name.rpartition('.')[2]}={mine.get(name)}" for name in names]


def success_curves(runs: Sequence[TrainingRun]) -> SuccessCurves:
    """Return the success of several seeds over the updates that all of them have.

    Updates before the window of the latest episodes is full are left out, but for the last one.
    """
    rows = [_counted(run) for run in runs]
    length = min(map(len, rows))
    rows = [some[:length] for some in rows]
    episodes, steps, rates = (
        np.array([[row[key] for row in some] for some in rows], dtype=np.float64)
        for key in ("episodes", "steps", "recent_success")
    )
    return SuccessCurves(episodes.mean(axis=0), steps.mean(axis=0), rates)


def _fact(row: Row) -> Fact:
    """Return the success of a plan at the end of its training."""
    text = f"lowest of {row['seeds']} seeds {row['lowest_success']:.3f}"
    return Fact(row["plan"], f"{row['success']:.3f}", text)


def _counted(run: TrainingRun) -> list[Row]:
    """Return the updates of a run's last stage from when its window is full, the last at least."""
    stage = run.stages[-1]
    rows = [row for row in run.history if row["name"] == stage.name]
    return [row for row in rows if row["episodes"] >= stage.window] or rows[-1:]


def _group_row(name: str, runs: Sequence[TrainingRun], curves: Mapping[str, SuccessCurves]) -> Row:
    """Return the figures of a plan: means over its seeds."""
    mine = curves[name]
    final = mine.rates[:, -1]
    return {
        "plan": name,
        "seeds": len(runs),
        "episodes": round(float(mine.episodes[-1])),
        "steps": round(float(mine.steps[-1])),
        "success": float(final.mean()),
        "lowest_success": float(final.min()),
        "first_good_episodes": _first(mine, GOOD, mine.episodes),
        "share_of_baseline": _share_of_baseline(mine, curves),
    }


def _first(curves: SuccessCurves, rate: float, amounts: Any) -> float | None:  # noqa: ANN401
    """Return the amount of training at which the seeds' mean first has a rate, None if never."""
    there = np.flatnonzero(curves.rates.mean(axis=0) >= rate)
    return float(amounts[there[0]]) if len(there) else None


def _share_of_baseline(mine: SuccessCurves, curves: Mapping[str, SuccessCurves]) -> float | None:
    """Return the steps to the baseline's final success, as a share of the baseline's steps.

    Returns:
        Share; None without a baseline, or where its success is not reached.
    """
    named = [one for name, one in curves.items() if name.split(",")[0] == _BASELINE]
    if not named:
        return None
    baseline = max(named, key=lambda one: float(one.rates[:, -1].mean()))
    steps = _first(mine, float(baseline.rates[:, -1].mean()), mine.steps)
    return None if steps is None else steps / float(baseline.steps[-1])


def _run_row(name: str, run: TrainingRun) -> Row:
    """Return the figures of a run."""
    last, stage = _counted(run)[-1], run.stages[-1].name
    return {
        "plan": name,
        "seed": run.seed,
        "episodes": last["episodes"],
        "steps": last["steps"],
        "success": last["recent_success"],
        "validation": last["validation"].get(stage),
        "collision_weight": run.plan.collision_weight,
    }


def _drives(name: str, run: TrainingRun) -> Plot:
    """Return drives of a run's policy in rooms of validation."""
    policy = run.policy(run.stages[-1].name)
    names = run.environment(RoomConfig).unseen.rooms[:_SHOWN_ROOMS]
    config = RoomEvaluationConfig(task=judged_task("td3"), rooms=names, pairs=_SHOWN_TASKS)
    rooms = [make_room(room) for room in names]
    cells = [Cell(name, TRAINED, room.name, REACTIVE) for room in rooms]
    drives = {
        (name, room.name): drive_tasks(
            policy, cell_task(cell, config, policy), tasks_of(room, config)
        )
        for room, cell in zip(rooms, cells, strict=True)
    }
    text = f"{name}, seed {run.seed}"
    figure = trajectories_figure(drives, rooms, text)
    return Plot(figure, f"paths-{name}", f"Paths and ends: {text} (rooms: Fig. 3)", drawn=True)
