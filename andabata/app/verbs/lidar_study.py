"""``andabata lidar-study``: a fixed policy while its laser is moved and changed."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.evaluation import Pairs, RoomPolicyOptions
from andabata.app.options.shared import (
    ConsoleOptions,
    EngineOptions,
    EvaluationSeed,
    SettingsOptions,
)


@command
def lidar_study(
    *,
    lidar: Annotated[
        str, typer.Option(help="Laser as it is: a name or a label, as for evaluate --lidars.")
    ] = "ten-beams",
    rooms: Annotated[
        str | None,
        typer.Option(metavar="NAMES", help="Rooms, comma-separated; by default eight random ones."),
    ] = None,
    memory: Annotated[
        str, typer.Option(help="reactive, or map, which gives the policy sub-goals.")
    ] = "reactive",
    pairs: Pairs = 100,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the study; a killed one goes on there.")
    ] = None,
    policies: RoomPolicyOptions,
    settings: SettingsOptions,
    seed: EvaluationSeed = 0,
    engine: EngineOptions,
    output: ConsoleOptions,
) -> None:
    """Move, turn and change the laser under a fixed policy, and say where to mount it.

    Each laser drives the same tasks as the laser as it is.

    Examples:
        andabata lidar-study
        andabata lidar-study --lidar front-180 --pairs 50 --out data/runs/study
        andabata lidar-study --set forward=[0.02,0.04] --set turned=[] --json
    """
    from andabata.app.jobs import rooms as room_evaluation
    from andabata.app.jobs.evaluation import run_evaluation
    from andabata.app.options.room_words import lidar_word, room_words
    from andabata.app.tables import study_table
    from andabata.configuration.usage import UsageError
    from andabata.evaluation.lidar_study import DEVELOPMENT, LidarStudyConfig
    from andabata.evaluation.rooms import REACTIVE, WITH_MAP
    from andabata.runs.lock import locked_folder

    if memory not in (REACTIVE, WITH_MAP):
        raise UsageError(f"--memory: expected {REACTIVE} or {WITH_MAP}, got {memory!r}")
    base = LidarStudyConfig.model_validate(
        {
            "lidar": lidar_word(lidar),
            "rooms": DEVELOPMENT if rooms is None else room_words(rooms),
            "memory": memory,
            "pairs": pairs,
            "seed": seed,
        }
    )
    console, config = output.console(), settings.resolve(LidarStudyConfig, base)
    study = room_evaluation.lidar_study(config, policies.load_policies(config.task))
    with locked_folder(out), engine.make(console) as made:
        data = run_evaluation(study, made, out, console)
    console.result(data, study_table(data), data["advice"])
