"""``andabata evaluate``: controllers side by side, or policies in rooms."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.evaluation_options import (
    EvaluationModelOptions,
    OffroadEvaluationOptions,
    RoomEvaluationOptions,
)
from andabata.app.options import (
    ClassifierOptions,
    ConsoleOptions,
    EvaluationSeed,
    RobotOptions,
    SettingsOptions,
    Workers,
)
from andabata.app.task_options import OFFROAD, TaskName, check_task, refuse_options


@command
def evaluate(
    *,
    task: TaskName = OFFROAD,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the table; a killed evaluation goes on there.")
    ] = None,
    offroad: OffroadEvaluationOptions,
    rooms: RoomEvaluationOptions,
    robot: RobotOptions,
    settings: SettingsOptions,
    models: EvaluationModelOptions,
    seed: EvaluationSeed = 0,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Drive the same worlds, starts and noises with each controller and count the goals.

    With --task spn or td3, drive the same starts and goals in rooms with each policy, laser and
    memory; a policy drives the robot, and sees in the form, that it was trained with.

    Examples:
        andabata evaluate --trials 100 --workers 4
        andabata evaluate --suite generalisation --out data/runs/generalisation
        andabata evaluate --robot jackal --set terminations.time_limit=120
        andabata evaluate --task spn --rooms env2,env3 --lidars ten-beams
        andabata evaluate --task td3 --policy heading --rooms clutter-movers-7300
    """
    from andabata.app.evaluation_run import run_evaluation
    from andabata.app.room_evaluation import run_room_evaluation
    from andabata.app.tables import evaluation_tables, room_tables
    from andabata.evaluation.evaluate import EvaluationConfig
    from andabata.evaluation.rooms import RoomEvaluationConfig

    check_task(task)
    console = output.console()
    if task != OFFROAD:
        others = (offroad, OffroadEvaluationOptions), (robot, RobotOptions)
        refuse_options(task, (*others, (models, ClassifierOptions)))
        in_rooms = settings.resolve(RoomEvaluationConfig, rooms.base(task, seed))
        policies = models.load_policies(in_rooms.task)
        data = run_room_evaluation(in_rooms, policies, workers, out, console)
        console.result(data, room_tables(data))
        return
    refuse_options(task, ((rooms, RoomEvaluationOptions),))
    config = settings.resolve(EvaluationConfig, offroad.base(robot.base(), seed))
    data = run_evaluation(config, models.load(), workers, out, seed, console)
    console.result(data, evaluation_tables(data["rows"]))
