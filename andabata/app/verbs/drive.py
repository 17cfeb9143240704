"""``andabata drive``: one drive in a world."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.drive import ClipOptions, Controller, Goals, RecordOptions
from andabata.app.options.faults import FaultOptions
from andabata.app.options.models import ModelOptions
from andabata.app.options.shared import (
    ConsoleOptions,
    EvaluationSeed,
    RobotOptions,
    SettingsOptions,
)
from andabata.app.options.view import DriveViewOptions
from worlds.splits import DEVELOPMENT_SEED


@command
def drive(
    *,
    world: Annotated[str, typer.Option(help="World preset.")] = "natural-test",
    controller: Controller = None,
    goal: Goals = None,
    out: Annotated[Path, typer.Option(help="Folder for the path and its picture.")] = Path(
        "data/runs/drive"
    ),
    record: RecordOptions,
    clip: ClipOptions,
    time_limit: Annotated[
        float, typer.Option(min=1.0, help="Longest drive to each goal, in seconds.")
    ] = 300.0,
    robot: RobotOptions,
    faults: FaultOptions,
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
        andabata drive --record drive.mcap --no-clouds --faults gnss:stuck@20
        andabata drive --robot husky --sensor os1-64 --set robot.mass=60
    """
    from andabata.app.jobs.drive import DriveRequest, run_drive
    from andabata.assembly.controllers import (
        CONTROLLERS,
        default_controller,
        refuse_unused_policy,
    )
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.configuration.usage import numbers, words

    loaded = models.load()
    named = default_controller(loaded) if controller is None else controller
    (name,) = words(named, CONTROLLERS, "--controller", takes_own=True)[:1]
    refuse_unused_policy((name,), loaded, "--controller")
    base = robot.base().model_copy(update={"faults": faults.read()})
    config = settings.resolve(SimulatedRobotConfig, base)
    pairs = (numbers(text, 2, "--goal") for text in goal or ())
    request = DriveRequest(
        world=world,
        seed=seed,
        controller=name,
        goals=tuple((x, y) for x, y in pairs),
        time_limit=time_limit,
        record=record.recording(),
        clip=clip.checked(),
        view=viewer.wanted(),
    )
    run_drive(request, config, loaded, out, output.console())
