"""``andabata evaluate``: controllers side by side."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options import (
    ConsoleOptions,
    EvaluationSeed,
    ModelOptions,
    RobotOptions,
    SettingsOptions,
    Workers,
)
from worlds.splits import EVALUATIONS


@command
def evaluate(
    *,
    world: Annotated[str, typer.Option(help="World preset.")] = "natural-test",
    controllers: Annotated[
        str,
        typer.Option(
            help="Some of policy, actor-critic, reactive, straight, without a map; "
            "policy+planner, reactive+planner, planner, with the local planner; oracle; "
            "random+planner, away+planner, null controllers; comma-separated."
        ),
    ] = "policy+planner,reactive",
    trials: Annotated[
        int, typer.Option(min=1, max=EVALUATIONS, help="Number of trials of each controller.")
    ] = 20,
    goals: Annotated[int, typer.Option(min=1, max=10, help="Number of goals in a row.")] = 3,
    suite: Annotated[
        str | None,
        typer.Option(
            help="generalisation (160 worlds) or development (24), instead of --world, --trials."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the table; a killed evaluation goes on there.")
    ] = None,
    robot: RobotOptions,
    settings: SettingsOptions,
    models: ModelOptions,
    seed: EvaluationSeed = 0,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Drive the same worlds, starts and noises with each controller and count the goals.

    Examples:
        andabata evaluate --trials 100 --workers 4
        andabata evaluate --controllers planner,oracle --world hill --goals 1
        andabata evaluate --suite generalisation --out data/runs/generalisation
        andabata evaluate --suite development --controllers policy,random+planner
        andabata evaluate --robot jackal --set terminations.time_limit=120
    """
    from andabata.app.evaluation_run import run_evaluation
    from andabata.app.tables import evaluation_tables
    from andabata.app.usage import words
    from andabata.assembly.controllers import CONTROLLERS, RENAMED_CONTROLLERS
    from andabata.evaluation.evaluate import EvaluationConfig
    from worlds.catalogue import UnknownWorldError, preset_names

    if world not in preset_names():
        known = ", ".join(preset_names())
        raise UnknownWorldError(f"--world: expected one of {known}, got {world!r}")
    base = EvaluationConfig(
        suite=suite,
        world=world,
        controllers=words(controllers, CONTROLLERS, "--controllers", RENAMED_CONTROLLERS),
        trials=trials,
        goals=goals,
        seed=seed,
        simulated_robot=robot.base(),
    )
    console, config = output.console(), settings.resolve(EvaluationConfig, base)
    data = run_evaluation(config, models.load(), workers, out, seed, console)
    console.result(data, evaluation_tables(data["rows"]))
