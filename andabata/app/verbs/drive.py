"""``andabata drive``: one drive in a world."""

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
)


@command
def drive(
    *,
    world: Annotated[str, typer.Option(help="World preset.")] = "natural-test",
    controller: Annotated[
        str,
        typer.Option(
            help="policy+planner, policy, actor-critic, planner, reactive, reactive+planner, "
            "straight or oracle."
        ),
    ] = "policy+planner",
    out: Annotated[Path, typer.Option(help="Folder for the path and its picture.")] = Path(
        "data/runs/drive"
    ),
    record: Annotated[
        Path | None,
        typer.Option(help="Record to this file: .bag (ROS 1), .mcap or .db3 (ROS 2)."),
    ] = None,
    clouds: Annotated[bool, typer.Option(help="Record the clouds too: 8 MB a second.")] = True,
    time_limit: Annotated[
        float, typer.Option(min=1.0, help="Longest drive to each goal, in seconds.")
    ] = 300.0,
    robot: RobotOptions,
    settings: SettingsOptions,
    models: ModelOptions,
    seed: EvaluationSeed = 0,
    output: ConsoleOptions,
) -> None:
    """Visit the goals of one task in a row and draw the path.

    Examples:
        andabata drive
        andabata drive --world hill --seed 3 --out data/runs/hill
        andabata drive --controller oracle --time-limit 60
        andabata drive --record drive.mcap --no-clouds
        andabata drive --robot husky --sensor os1-64 --set robot.mass=60
    """
    from andabata.app.run_folders import write_drive
    from andabata.app.tables import drive_text
    from andabata.app.usage import words
    from andabata.assembly.controllers import CONTROLLERS
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.evaluation.drive import Recording, drive_once

    (name,) = words(controller, CONTROLLERS, "--controller")[:1]
    config = settings.resolve(SimulatedRobotConfig, robot.base())
    console, loaded = output.console(), models.load()
    with console.progress("simulated seconds", None) as step:
        driven = drive_once(
            world,
            seed,
            name,
            config,
            loaded,
            on_second=lambda: step(1),
            record=Recording(record, clouds) if record else None,
            time_limit=time_limit,
        )
    data = write_drive(out, driven, config.model_dump(mode="json"), seed)
    data |= {"record": str(record)} if record else {}
    console.result(data, drive_text(driven.title, data))
