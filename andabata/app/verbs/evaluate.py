"""``andabata evaluate``: controllers side by side, or policies in rooms."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.evaluation_options import (
    BarnEvaluationOptions,
    EvaluationModelOptions,
    OffroadEvaluationOptions,
    RoomEvaluationOptions,
    TrialOptions,
)
from andabata.app.options import (
    ClassifierOptions,
    ConsoleOptions,
    EngineOptions,
    EvaluationSeed,
    RobotOptions,
    SettingsOptions,
)
from andabata.app.task_options import (
    BARN,
    OFFROAD,
    EvaluationTaskName,
    check_task,
    refuse_options,
)
from andabata.tasks.registration import ROOM_TASKS


@command
def evaluate(
    *,
    task: EvaluationTaskName = OFFROAD,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the table; a killed evaluation goes on there.")
    ] = None,
    driven: TrialOptions,
    offroad: OffroadEvaluationOptions,
    rooms: RoomEvaluationOptions,
    barn: BarnEvaluationOptions,
    robot: RobotOptions,
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

    Examples:
        andabata evaluate --trials 100 --workers 4
        andabata evaluate --suite generalisation --out data/runs/generalisation
        andabata evaluate --task spn --rooms env2,env3 --lidars ten-beams
        andabata evaluate --task barn --controllers arcs,gap --trials 1
        andabata evaluate --task td3 --policy heading --rooms clutter-movers-7300
    """
    from andabata.app.barn_evaluation import barn_evaluation
    from andabata.app.barn_tables import barn_tables
    from andabata.app.evaluation_run import run_evaluation
    from andabata.app.offroad_evaluation import offroad_evaluation
    from andabata.app.room_evaluation import room_evaluation
    from andabata.app.tables import evaluation_tables, room_tables
    from andabata.evaluation.barn import BarnEvaluationConfig
    from andabata.evaluation.offroad import EvaluationConfig
    from andabata.evaluation.rooms import RoomEvaluationConfig
    from andabata.records.run_lock import locked_folder

    check_task(task, (OFFROAD, *ROOM_TASKS, BARN))
    console = output.console()
    off_road = (offroad, OffroadEvaluationOptions), (robot, RobotOptions)
    in_rooms, in_fields = (rooms, RoomEvaluationOptions), (barn, BarnEvaluationOptions)
    if task == BARN:
        refuse_options(task, (*off_road, (models, ClassifierOptions)))
        refuse_options(task, (in_rooms,), " or ".join(ROOM_TASKS))
        fields = settings.resolve(BarnEvaluationConfig, barn.base(seed, driven, models.policy))
        with locked_folder(out), engine.make(console) as made:
            data = run_evaluation(barn_evaluation(fields), made, out, console)
        console.result(data, barn_tables(data))
        return
    refuse_options(task, (in_fields,), BARN)
    if task != OFFROAD:
        refuse_options(task, (*off_road, (driven, TrialOptions), (models, ClassifierOptions)))
        wanted = settings.resolve(RoomEvaluationConfig, rooms.base(task, seed))
        policies = models.load_policies(wanted.task)
        with locked_folder(out), engine.make(console) as made:
            data = run_evaluation(room_evaluation(wanted, policies), made, out, console)
        console.result(data, room_tables(data))
        return
    refuse_options(task, (in_rooms,))
    config = settings.resolve(EvaluationConfig, offroad.base(robot.base(), seed, driven))
    with locked_folder(out), engine.make(console) as made:
        trials = offroad_evaluation(config, models.load(), seed, has_pictures=out is not None)
        data = run_evaluation(trials, made, out, console)
    console.result(data, evaluation_tables(data["rows"]))
