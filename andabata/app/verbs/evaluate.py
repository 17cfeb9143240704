"""``andabata evaluate``: controllers side by side, or policies in rooms."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import Given, OptionGroups, command, typed_options
from andabata.app.options.evaluation import EvaluationModelOptions, JudgedRobotOptions
from andabata.app.options.shared import (
    ConsoleOptions,
    EngineOptions,
    EvaluationSeed,
    SettingsOptions,
)
from andabata.app.options.task import EvaluationTaskName
from andabata.app.run_kinds import OFFROAD, EvaluationRequest, kind_of_task, option_groups


@command
def evaluate(
    *,
    context: typer.Context,
    task: EvaluationTaskName = OFFROAD,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the table; a killed evaluation goes on there.")
    ] = None,
    own: Annotated[Given, OptionGroups(option_groups("evaluate"))],
    robot: JudgedRobotOptions,
    settings: SettingsOptions,
    models: EvaluationModelOptions,
    seed: EvaluationSeed = 0,
    engine: EngineOptions,
    output: ConsoleOptions,
) -> None:
    """Drive the same worlds, starts and noises with each controller and count the goals.

    With --task spn or td3, drive the same starts and goals in rooms with each policy, laser and
    memory; a policy drives the robot, and sees in the form, that it was trained with.
    With --task barn, drive fields of cylinders by the rules of the BARN benchmark.

    With --release, judge: fresh worlds at --reality field, in rooms with drift and noise, 200
    trials, beside null controllers and the oracle, once for each release. All other seeds develop.

    Examples:
        andabata evaluate --trials 100 --workers 4
        andabata evaluate --suite generalisation --out data/runs/generalisation
        andabata evaluate --task spn --rooms env2,env3 --lidars ten-beams
        andabata evaluate --task td3 --policy nulls --rooms clutter-movers-7300
        andabata evaluate --release 0.2.0 --out data/runs/judged
    """
    from andabata.app.jobs.evaluation import run_evaluation
    from andabata.runs.lock import locked_folder

    kind, console = kind_of_task("evaluate", task), output.console()
    given = own | Given(robot, models)
    typed = typed_options(context)
    request = EvaluationRequest(task, given, settings, seed, out is not None, typed)
    evaluation = kind.start(request)
    with locked_folder(out), engine.make(console) as made:
        data = run_evaluation(evaluation, made, out, console)
    console.result(data, kind.function("table")(data))
