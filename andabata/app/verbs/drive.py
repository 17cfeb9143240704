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
from andabata.app.view_options import DriveViewOptions
from worlds.splits import DEVELOPMENT_SEED


@command
def drive(
    *,
    world: Annotated[str, typer.Option(help="World preset.")] = "natural-test",
    controller: Annotated[
        str,
        typer.Option(
            help="policy+planner, policy, actor-critic, planner, reactive, reactive+planner, "
            "straight, random+planner, away+planner or oracle."
        ),
    ] = "policy+planner",
    goal: Annotated[
        list[str] | None,
        typer.Option(
            metavar="X,Y",
            help="Goal of your own in the map, in metres, instead of the world's; may be repeated.",
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for the path and its picture.")] = Path(
        "data/runs/drive"
    ),
    record: Annotated[
        Path | None,
        typer.Option(help="Record to this file: .bag (ROS 1), .mcap or .db3 (ROS 2)."),
    ] = None,
    clouds: Annotated[bool, typer.Option(help="Record the clouds too: 8 MB a second.")] = True,
    local_map: Annotated[
        bool,
        typer.Option(
            "--map/--no-map",
            help="Record the local map, the plan and the heading error too, for Nav2, grid_map "
            "and Foxglove.",
        ),
    ] = True,
    clip: Annotated[
        Path | None,
        typer.Option(
            help="Draw the drive as a moving picture: a .gif, or an .mp4 where there is ffmpeg; a "
            ".png is a picture of its last moment."
        ),
    ] = None,
    time_limit: Annotated[
        float, typer.Option(min=1.0, help="Longest drive to each goal, in seconds.")
    ] = 300.0,
    robot: RobotOptions,
    settings: SettingsOptions,
    models: ModelOptions,
    viewer: DriveViewOptions,
    seed: EvaluationSeed = DEVELOPMENT_SEED,
    output: ConsoleOptions,
) -> None:
    """Visit the goals of one task in a row and draw the path.

    Examples:
        andabata drive
        andabata drive --world hill --seed 7300 --goal -15,-30 --view
        andabata drive --world natural-test --seed 7300 --clip drive.gif
        andabata drive --record drive.mcap --no-clouds
        andabata drive --robot husky --sensor os1-64 --set robot.mass=60
    """
    from andabata.app.drive_run import DriveRequest, run_drive
    from andabata.app.plots.film import FilmError, check_film
    from andabata.app.usage import UsageError, numbers, words
    from andabata.assembly.controllers import CONTROLLERS, RENAMED_CONTROLLERS
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.evaluation.drive import Recording

    (name,) = words(controller, CONTROLLERS, "--controller", RENAMED_CONTROLLERS)[:1]
    config = settings.resolve(SimulatedRobotConfig, robot.base())
    if clip is not None:
        try:
            check_film(clip)
        except FilmError as error:
            raise UsageError(str(error)) from error
    pairs = (numbers(text, 2, "--goal") for text in goal or ())
    request = DriveRequest(
        world=world,
        seed=seed,
        controller=name,
        goals=tuple((x, y) for x, y in pairs),
        time_limit=time_limit,
        record=Recording(record, clouds, local_map) if record else None,
        clip=clip,
        view=viewer.wanted(),
    )
    run_drive(request, config, models.load(), out, output.console())
