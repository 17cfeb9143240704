"""``andabata drive``: one drive in a world."""

from contextlib import ExitStack
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
from andabata.app.view_options import ViewOptions


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
            help="Draw the drive as a moving picture: a .gif, or an .mp4 where there is ffmpeg."
        ),
    ] = None,
    time_limit: Annotated[
        float, typer.Option(min=1.0, help="Longest drive to each goal, in seconds.")
    ] = 300.0,
    robot: RobotOptions,
    settings: SettingsOptions,
    models: ModelOptions,
    viewer: ViewOptions,
    seed: EvaluationSeed = 0,
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
    from andabata.app.plots.clip import ClipRecorder
    from andabata.app.plots.film import FilmError, check_film
    from andabata.app.run_folders import write_drive
    from andabata.app.tables import drive_text
    from andabata.app.usage import UsageError, numbers, words
    from andabata.app.viewer.simulated import SimulatedDriveView
    from andabata.assembly.controllers import CONTROLLERS, RENAMED_CONTROLLERS
    from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig
    from andabata.evaluation.drive import Recording, drive_once
    from andabata.records import atomic_io
    from andabata.records.runs import make_folder

    (name,) = words(controller, CONTROLLERS, "--controller", RENAMED_CONTROLLERS)[:1]
    config = settings.resolve(SimulatedRobotConfig, robot.base())
    if clip is not None:
        try:
            check_film(clip)
        except FilmError as error:
            raise UsageError(str(error)) from error
    goals = [(x, y) for x, y in (numbers(text, 2, "--goal") for text in goal or ())]
    console, loaded = output.console(), models.load()
    clips: list[ClipRecorder] = []
    with ExitStack() as stack:
        view: SimulatedDriveView | None = None
        if viewer.view:
            made = SimulatedDriveView(viewer.view_config(), name, loaded, console.status)
            view = stack.enter_context(made)

        def watch(simulated_robot: SimulatedRobot) -> None:
            if clip is not None:
                clips.append(ClipRecorder(simulated_robot))
            if view is not None:
                view.watch_robot(simulated_robot)

        with console.progress("simulated seconds", None) as step:
            driven = drive_once(
                world,
                seed,
                name,
                config,
                loaded,
                on_second=lambda: step(1),
                record=Recording(record, clouds, local_map) if record else None,
                time_limit=time_limit,
                on_robot=watch,
                goals=goals,
                operator=view,
            )
        if clip is not None:
            make_folder(clip.parent)
            atomic_io.write(clip, clips[0].film(clip.suffix))
        data = write_drive(out, driven, config.model_dump(mode="json"), seed, clip)
        data |= {"record": str(record)} if record else {}
        data |= {"view": view.report} if view is not None else {}
        console.result(data, drive_text(driven.title, data))
        if view is not None:
            view.finish(driven.title)
