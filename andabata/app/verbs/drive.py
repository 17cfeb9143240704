"""``andabata drive``: one drive in a world."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.options import (
    ConfigFile,
    EvaluationSeed,
    ForestFile,
    GroundClassifierFile,
    Json,
    PolicyFile,
    Quiet,
    Robot,
    Sensor,
    Set,
)


def drive(
    world: Annotated[str, typer.Option(help="World preset.")] = "natural-test",
    controller: Annotated[
        str, typer.Option(help="learned, reactive, straight or oracle.")
    ] = "learned",
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
    sensor: Sensor = "utm-30lx",
    robot: Robot = "andabata",
    forest: ForestFile = None,
    ground_classifier: GroundClassifierFile = None,
    policy: PolicyFile = None,
    seed: EvaluationSeed = 0,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Visit the goals of one task in a row and draw the way."""
    from andabata.app.console import Console
    from andabata.app.plots.drives import drive_picture
    from andabata.app.settings import resolve, with_parts
    from andabata.app.usage import words
    from andabata.assembly.controllers import CONTROLLERS
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.evaluation.drive import Recording, drive_once
    from andabata.models import Models
    from andabata.records import atomic_io
    from andabata.records.runs import describe, make_folder, write_json

    (name,) = words(controller, CONTROLLERS, "--controller")[:1]
    console = Console(quiet, as_json)
    resolved = resolve(
        SimulatedRobotConfig,
        config,
        settings or (),
        with_parts(SimulatedRobotConfig, sensor, robot),
    )
    with console.progress("simulated seconds", None) as step:
        driven = drive_once(
            world,
            seed,
            name,
            resolved,
            Models.load(forest, ground_classifier, policy),
            on_second=lambda: step(1),
            record=Recording(record, clouds) if record else None,
            time_limit=time_limit,
        )
    make_folder(out)
    atomic_io.write(
        out / "drive.png",
        drive_picture(driven.world, driven.path, driven.task.goals, driven.title),
    )
    write_json(out / "drive.json", driven.as_dict())
    write_json(out / "run.json", describe("drive", resolved.model_dump(mode="json"), seed))
    attempts = "\n".join(
        f"goal {attempt['goal']}: {attempt['outcome']} after {attempt['time_s']:.1f} s and "
        f"{attempt['distance_m']:.1f} m, {attempt['trespass_m']:.1f} m of trespass"
        for attempt in driven.as_dict()["legs"]
    )
    data = {**driven.as_dict(), "picture": str(out / "drive.png")}
    data.pop("path")
    data |= {"record": str(record)} if record else {}
    recorded = f"\nrecord: {record}" if record else ""
    console.result(data, f"{driven.title}\n{attempts}\npicture: {out / 'drive.png'}{recorded}")
