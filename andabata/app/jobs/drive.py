"""A drive with its clip and its live view, and the folder that keeps it."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from andabata.app.console import Console
from andabata.app.driven_plant import announce_plant
from andabata.app.tables import drive_text
from andabata.assembly.simulated_robot import SimulatedRobot, SimulatedRobotConfig, at_world
from andabata.evaluation.drive import Recording, drive_once
from andabata.models import Models
from andabata.report.plots.clip import ClipRecorder
from andabata.report.run_folders import write_drive
from andabata.runs import atomic_io
from andabata.runs.folder import make_folder
from andabata.runs.lock import locked_folder
from andabata.viewer.options import ViewConfig
from andabata.viewer.simulated import SimulatedDriveView


@dataclass(frozen=True)
class DriveRequest:
    """A drive that is asked for.

    Attributes:
        world: Preset of the world.
        seed: Seed of the drive.
        controller: Name of the controller.
        goals: Goals in the map [m]; none for the world's own.
        time_limit: Longest drive to each goal [s].
        record: Destination of a recording, or None.
        clip: File of a moving picture, or None.
        view: Choices of a live view, or None.
    """

    world: str
    seed: int
    controller: str
    goals: tuple[tuple[float, float], ...]
    time_limit: float
    record: Recording | None = None
    clip: Path | None = None
    view: ViewConfig | None = None


def run_drive(
    request: DriveRequest,
    config: SimulatedRobotConfig,
    models: Models,
    folder: Path,
    console: Console,
) -> None:
    """Drive, write the folder, and print the result; a live view stays until it is left.

    Args:
        request: Drive that is asked for.
        config: Robot.
        models: Classifiers and policy.
        folder: Folder for the path and its picture.
        console: Console that shows the progress and the result.

    Raises:
        BagError: If the recording cannot be begun.
        GoalError: If no safe path leads to a goal.
        PlantError: If the robot's plant is not installed.
        RunLockError: If another command writes the folder.
        ViewerError: If the live view lacks its package.
    """
    announce_plant(config.plant, console)
    clips: list[ClipRecorder] = []
    with ExitStack() as stack:
        # Locked before anything is driven: a second command would be refused after minutes else.
        stack.enter_context(locked_folder(folder))
        view: SimulatedDriveView | None = None
        if request.view is not None:
            made = SimulatedDriveView(request.view, request.controller, models, console.status)
            view = stack.enter_context(made)

        def watch(simulated_robot: SimulatedRobot) -> None:
            if request.clip is not None:
                clips.append(ClipRecorder(simulated_robot))
            if view is not None:
                view.watch_robot(simulated_robot)

        with console.progress("simulated seconds", None) as step:
            driven = drive_once(
                request.world,
                request.seed,
                request.controller,
                config,
                models,
                on_second=lambda: step(1),
                record=request.record,
                time_limit=request.time_limit,
                on_robot=watch,
                goals=request.goals,
                operator=view,
            )
        if request.clip is not None:
            make_folder(request.clip.parent)
            atomic_io.write(request.clip, clips[0].film(request.clip.suffix))
        settings = at_world(config, driven.world).model_dump(mode="json")
        data: dict[str, Any] = write_drive(folder, driven, settings, request.seed, request.clip)
        data |= {"reality": config.reality.name}
        data |= {"record": str(request.record.path)} if request.record is not None else {}
        data |= {"view": view.report} if view is not None else {}
        console.result(data, drive_text(driven.title, data))
        # The result is printed first: the page may stay open for as long as somebody looks.
        if view is not None:
            view.finish(driven.title)
