"""Judging controllers side by side: the same worlds, starts and noises for each of them."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from andabata.app.workers import run_tasks
from andabata.records.storage import write_atomically
from andabata.tasks.judge import JudgeConfig, Outcome
from andabata.tasks.rig import RigConfig
from andabata.tasks.seeds import evaluation_world
from andabata.tasks.trial import Leg
from worlds.world import World

Row = dict[str, Any]


class EvaluationConfig(BaseModel):
    """What is judged.

    Attributes:
        world: World preset.
        controllers: Controllers by name.
        trials: Trials of each controller; each trial has a world of its own.
        seed: Seed of the whole evaluation.
        rig: The robot; results are judged in bullet.
        judge: Rules of each drive.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    world: str = "natural-test"
    controllers: tuple[str, ...] = ("learned", "reactive", "straight", "oracle")
    trials: int = Field(default=20, ge=1)
    seed: int = Field(default=0, ge=0)
    rig: RigConfig = Field(default_factory=RigConfig)
    judge: JudgeConfig = Field(default_factory=JudgeConfig)


@dataclass(frozen=True)
class Models:
    """The files of the classifier and the policy, as bytes; None for the shipped ones."""

    forest: bytes | None = None
    policy: bytes | None = None


def run_one(config: EvaluationConfig, models: Models, trial: int) -> list[Row]:
    """Run every controller through one trial's world.

    Returns:
        One row a leg: controller, trial, world_seed, goal, outcome and what the judge measured.
    """
    from andabata.models import shipped_forest
    from andabata.tasks.controllers import make_controller
    from andabata.tasks.rig import Rig
    from andabata.tasks.scenes import SceneShelf
    from andabata.tasks.trial import run_trial
    from rl.policy import Policy
    from traversability.forest import Forest

    forest = Forest.from_bytes(models.forest) if models.forest else shipped_forest()
    policy = Policy.from_bytes(models.policy) if models.policy else None
    world_seed = evaluation_world(config.seed, trial)
    scene = SceneShelf().get(config.world, world_seed)
    pick = np.random.default_rng([config.seed, trial])
    task = scene.world.tasks[int(pick.integers(len(scene.world.tasks)))]
    rows: list[Row] = []
    for name in config.controllers:
        controller = make_controller(name, scene.world, config.rig, policy)
        rig = Rig(scene, config.rig, forest, controller)
        rng = np.random.default_rng([config.seed, trial, 1])
        legs = run_trial(rig, task, config.judge, rng)
        rows.extend(_leg_row(leg, name, trial, scene.world, len(task.goals)) for leg in legs)
        rig.close()
    return rows


def _leg_row(leg: Leg, controller: str, trial: int, world: World, goals: int) -> Row:
    """Return what the judge measured on one leg, ready for JSON."""
    return {
        "controller": controller,
        "trial": trial,
        "world_seed": world.seed,
        "goal": leg.goal,
        "goals": goals,
        "outcome": str(leg.outcome),
        "time_s": leg.time,
        "distance_m": leg.distance,
        "spl": leg.spl,
        "trespass_m": leg.trespass,
        "restlessness": leg.restlessness,
        "min_clearance_m": leg.min_clearance,
        "end_xy": leg.path[-1, :2].tolist(),
    }


def evaluate(
    config: EvaluationConfig,
    models: Models,
    *,
    workers: int = 2,
    journal: Path | None = None,
    on_trial: Callable[[int, list[Row]], None] | None = None,
) -> list[Row]:
    """Run all trials and return one row a leg, by trial.

    Args:
        config: What is judged.
        models: Classifier and policy.
        workers: Processes.
        journal: JSON-lines file to which finished trials are appended; trials that stand in it are
            not run again, so that a killed evaluation goes on where it was.
        on_trial: Called after each trial.
    """
    done = _read_journal(journal, config)
    missing = [trial for trial in range(config.trials) if trial not in done]
    for trial, rows in run_tasks(partial(run_one, config, models), missing, workers):
        done[trial] = rows
        if journal is not None:
            with journal.open("a", encoding="utf-8") as file:
                file.write(json.dumps({"trial": trial, "rows": rows}) + "\n")
        if on_trial is not None:
            on_trial(trial, rows)
    return [row for trial in range(config.trials) for row in done[trial]]


def _read_journal(journal: Path | None, config: EvaluationConfig) -> dict[int, list[Row]]:
    """Return the finished trials of a journal made with the same configuration.

    Raises:
        ValueError: If the journal belongs to another evaluation.
    """
    if journal is None:
        return {}
    head = json.dumps({"config": config.model_dump(mode="json", exclude={"trials"})})
    if not journal.exists() or journal.stat().st_size == 0:
        journal.write_text(head + "\n", encoding="utf-8")
        return {}
    lines = journal.read_text(encoding="utf-8").splitlines()
    if lines[0] != head:
        raise ValueError(f"{journal}: expected a journal of this evaluation, got another's")
    kept = [line for line in lines[1:] if _is_json(line)]  # A kill may cut the last line short.
    write_atomically(journal, "".join(f"{line}\n" for line in [head, *kept]).encode())
    return {entry["trial"]: entry["rows"] for entry in map(json.loads, kept)}


def _is_json(line: str) -> bool:
    """Return whether a line is whole."""
    try:
        json.loads(line)
    except json.JSONDecodeError:
        return False
    return True


def summarise(rows: Sequence[Row], config: EvaluationConfig) -> list[Row]:
    """Return the table: one row a controller and goal, and one for all goals in a row.

    A goal counts as tried in every trial, so that the figures are those of goals in a row
    (Sanchez et al. 2023, Table 4).
    """
    goals = max((row["goals"] for row in rows), default=0)
    table: list[Row] = []
    for controller in config.controllers:
        mine = [row for row in rows if row["controller"] == controller]
        labels: list[int | str] = [*range(1, goals + 1), "all"]
        table.extend(_table_row(mine, controller, config, goals, label) for label in labels)
    return table


def _table_row(
    rows: Sequence[Row], controller: str, config: EvaluationConfig, goals: int, label: int | str
) -> Row:
    """Return one row of the table; ``all`` counts the last goal and the failures of every leg."""
    from rl.metrics import wilson_interval

    goal = goals if label == "all" else label
    legs = [row for row in rows if label in ("all", row["goal"])]
    reached = sum(row["goal"] == goal and row["outcome"] == Outcome.GOAL for row in rows)
    low, high = wilson_interval(reached, config.trials)
    tried = config.trials * (goals if label == "all" else 1)

    def count(outcome: Outcome) -> int:
        return sum(row["outcome"] == outcome for row in legs)

    def mean(key: str) -> float | None:
        return float(np.mean([row[key] for row in legs])) if legs else None

    return {
        "controller": controller,
        "world": config.world,
        "goal": label,
        "trials": config.trials,
        "successes": reached,
        "collisions": count(Outcome.COLLISION),
        "tipovers": count(Outcome.TIPOVER),
        "timeouts": count(Outcome.TIMEOUT),
        "stuck": count(Outcome.STUCK),
        "success_rate": reached / config.trials,
        "wilson_low": low,
        "wilson_high": high,
        "spl": sum(row["spl"] for row in legs) / tried,
        "trespass_m": mean("trespass_m"),
        "distance_m": mean("distance_m"),
        "mean_time_s": mean("time_s"),
    }
