"""``andabata evaluate``: judge controllers side by side."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from andabata.app.options import (
    ConfigFile,
    EvaluationSeed,
    ForestFile,
    GroundClassifierFile,
    Json,
    PolicyFile,
    Quiet,
    Robot,
    Sensor,
    Set,
    Workers,
)
from worlds.splits import EVALUATIONS

if TYPE_CHECKING:
    from rich.table import Table


def evaluate(
    world: Annotated[str, typer.Option(help="World preset.")] = "natural-test",
    controllers: Annotated[
        str,
        typer.Option(
            help="Some of learned, actor-critic, reactive, straight, oracle, comma-separated; "
            "learned-map has no map, reactive+map and straight+map have one."
        ),
    ] = "learned,reactive",
    trials: Annotated[
        int, typer.Option(min=1, max=EVALUATIONS, help="Trials of each controller.")
    ] = 20,
    goals: Annotated[int, typer.Option(min=1, max=10, help="Goals in a row.")] = 3,
    suite: Annotated[
        str | None, typer.Option(help="generalisation: 160 worlds, instead of --world, --trials.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the table; a killed evaluation goes on there.")
    ] = None,
    sensor: Sensor = "utm-30lx",
    robot: Robot = "andabata",
    forest: ForestFile = None,
    ground_classifier: GroundClassifierFile = None,
    policy: PolicyFile = None,
    seed: EvaluationSeed = 0,
    workers: Workers = 2,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Drive the same worlds, starts and noises with each controller and count the goals."""
    from functools import partial

    from rich.console import Group

    from andabata.app.console import Console
    from andabata.app.plots.drives import write_failure
    from andabata.app.settings import resolve, with_parts
    from andabata.app.usage import words
    from andabata.assembly.controllers import CONTROLLERS
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.evaluation.evaluate import EvaluationConfig, hazards, summarise
    from andabata.evaluation.evaluate import evaluate as run_evaluation
    from andabata.models import Models
    from andabata.records.runs import describe, make_folder, write_json
    from worlds.catalogue import UnknownWorldError, preset_names

    if world not in preset_names():
        known = ", ".join(preset_names())
        raise UnknownWorldError(f"--world: expected one of {known}, got {world!r}")
    console = Console(quiet, as_json)
    base = EvaluationConfig(
        suite=suite,
        world=world,
        controllers=words(controllers, CONTROLLERS, "--controllers"),
        trials=trials,
        goals=goals,
        seed=seed,
        simulated_robot=with_parts(SimulatedRobotConfig, sensor, robot),
    )
    resolved = resolve(EvaluationConfig, config, settings or (), base)
    models = Models.load(forest, ground_classifier, policy)
    folder = make_folder(out) if out else None
    with console.progress("trials", len(resolved.scenarios)) as step:

        def on_trial(trial: int, rows: list[dict[str, Any]]) -> None:
            step(1, f"world {rows[0]['world_seed']}")

        rows = run_evaluation(
            resolved,
            models,
            workers=workers,
            journal=folder / "trials.jsonl" if folder else None,
            on_failure=partial(write_failure, make_folder(folder / "failures")) if folder else None,
            on_trial=on_trial,
        )
    table = summarise(rows, resolved)
    data: dict[str, Any] = {
        "rows": table,
        "failures": hazards(rows),
        "config": resolved.model_dump(mode="json"),
        "seed": seed,
    }
    if folder:
        write_json(folder / "evaluation.json", data)
        write_json(folder / "run.json", describe("evaluate", data["config"], seed))
    worlds = dict.fromkeys(row["world"] for row in table)
    console.result(data, Group(*(_table(table, name) for name in worlds)))


def _table(rows: list[dict[str, Any]], world: str) -> "Table":
    """Return what is shown of one world, narrow enough for a terminal of 80 columns."""
    from andabata.app.console import table_of

    shown = [
        {
            "controller": row["controller"],
            "goal": str(row["goal"]),
            "reached": f"{row['successes']}/{row['trials']}",
            "95 %": f"{row['wilson_low']:.2f}-{row['wilson_high']:.2f}",
            "hit": row["collisions"],
            "tip": row["tipovers"],
            "late": row["timeouts"],
            "stuck": row["stuck"],
            "spl": f"{row['spl']:.2f}",
            "trespass": None
            if row["trespass_share"] is None
            else f"{100 * row['trespass_share']:.1f} %",
        }
        for row in rows
        if row["world"] == world
    ]
    return table_of(shown, world)
