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
    EvaluationSeed,
    RobotOptions,
    SettingsOptions,
    Workers,
)
from andabata.app.task_options import (
    BARN,
    OFFROAD,
    SPN,
    EvaluationTaskName,
    check_task,
    refuse_options,
)


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
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Drive the same worlds, starts and noises with each controller and count the goals.

    With --task spn, drive the same starts and goals in rooms with each policy, laser and memory.
    With --task barn, drive fields of cylinders by the rules of the BARN benchmark.

    Examples:
        andabata evaluate --trials 100 --workers 4
        andabata evaluate --controllers planner,oracle --world hill --goals 1
        andabata evaluate --suite generalisation --out data/runs/generalisation
        andabata evaluate --robot jackal --set terminations.time_limit=120
        andabata evaluate --task spn --rooms env2,env3 --lidars ten-beams
        andabata evaluate --task barn --controllers arcs,gap --trials 1
    """
    from andabata.app.barn_evaluation import run_barn_evaluation
    from andabata.app.barn_tables import barn_tables
    from andabata.app.evaluation_run import run_evaluation
    from andabata.app.room_evaluation import run_room_evaluation
    from andabata.app.tables import evaluation_tables, room_tables
    from andabata.evaluation.barn import BarnEvaluationConfig
    from andabata.evaluation.evaluate import EvaluationConfig
    from andabata.evaluation.rooms import RoomEvaluationConfig

    check_task(task, (OFFROAD, SPN, BARN))
    console = output.console()
    off_road = (offroad, OffroadEvaluationOptions), (robot, RobotOptions)
    in_rooms, in_fields = (rooms, RoomEvaluationOptions), (barn, BarnEvaluationOptions)
    if task == BARN:
        refuse_options(task, (*off_road, (models, EvaluationModelOptions)), OFFROAD)
        refuse_options(task, (in_rooms,), SPN)
        fields = settings.resolve(BarnEvaluationConfig, barn.base(seed, driven))
        data = run_barn_evaluation(fields, workers, out, console)
        console.result(data, barn_tables(data))
        return
    refuse_options(task, (in_fields,), BARN)
    if task == SPN:
        refuse_options(task, (*off_road, (driven, TrialOptions), (models, ClassifierOptions)))
        wanted = settings.resolve(RoomEvaluationConfig, rooms.base(seed))
        data = run_room_evaluation(wanted, models.load_policies(), workers, out, console)
        console.result(data, room_tables(data))
        return
    refuse_options(task, (in_rooms,))
    config = settings.resolve(EvaluationConfig, offroad.base(robot.base(), seed, driven))
    data = run_evaluation(config, models.load(), workers, out, seed, console)
    console.result(data, evaluation_tables(data["rows"]))
