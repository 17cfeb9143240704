"""``andabata faults``: a fault of each sense and kind, whether it is noticed, and what it costs."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import Given, command
from andabata.app.options.evaluation import (
    EvaluationModelOptions,
    JudgedRobotOptions,
    OffroadEvaluationOptions,
    TrialOptions,
)
from andabata.app.options.faults import FaultMatrixOptions
from andabata.app.options.shared import (
    ConsoleOptions,
    EngineOptions,
    EvaluationSeed,
    SettingsOptions,
)
from andabata.app.run_kinds import OFFROAD, EvaluationRequest, kind_of_task, option_groups
from worlds.splits import DEVELOPMENT_SEED


@command
def faults(
    *,
    listed: Annotated[
        bool, typer.Option("--list", help="List the senses and kinds, and drive nothing.")
    ] = False,
    matrix: FaultMatrixOptions,
    world: Annotated[str, typer.Option(help="World preset.")] = "natural-test",
    controllers: Annotated[
        str, typer.Option(metavar="NAMES", help="Controllers, as for evaluate --controllers.")
    ] = "planner",
    trials: Annotated[int, typer.Option(min=1, help="Number of drives with each fault.")] = 5,
    goals: Annotated[int, typer.Option(min=1, max=10, help="Number of goals in a row.")] = 1,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the table; a killed one goes on there.")
    ] = None,
    robot: JudgedRobotOptions,
    settings: SettingsOptions,
    models: EvaluationModelOptions,
    seed: EvaluationSeed = DEVELOPMENT_SEED,
    engine: EngineOptions,
    output: ConsoleOptions,
) -> None:
    """Drive the same worlds with a typical fault of each sense and kind, and without any.

    The table says whether and when the robot's health said so, what it touched, and how many
    commands were not finite or beyond its limits. It is that of `evaluate --faults` with the faults
    of --senses and --kinds.

    Examples:
        andabata faults --list
        andabata faults --trials 3 --set simulated_robot.plant=kinematic
        andabata faults --senses gnss,laser --kinds off,stuck --onset 10
        andabata faults --out data/runs/faults --workers 4
    """
    from andabata.app.fault_tables import catalogue, catalogue_tables, fault_tables
    from andabata.app.jobs.evaluation import run_evaluation
    from andabata.runs.lock import locked_folder

    console = output.console()
    if listed:
        data = catalogue()
        console.result(data, catalogue_tables(data), f"such as {', '.join(data['typical'][:3])}")
        return
    own = (
        TrialOptions(controllers, trials),
        OffroadEvaluationOptions(world, goals, faults=matrix.text()),
    )
    others = (group() for group in option_groups("evaluate"))
    given = Given(*own, *others, robot, models)
    request = EvaluationRequest(OFFROAD, given, settings, seed, out is not None)
    evaluation = kind_of_task("evaluate", OFFROAD).start(request)
    with locked_folder(out), engine.make(console) as made:
        data = run_evaluation(evaluation, made, out, console)
    console.result(data, fault_tables(data["faults"]))
