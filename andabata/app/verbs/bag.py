"""``andabata bag``: recordings, without ROS."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.faults import FaultOptions
from andabata.app.options.models import ModelOptions
from andabata.app.options.recording import RecordedRobot, RecordingOptions
from andabata.app.options.shared import ConsoleOptions

app = typer.Typer(
    help="Recordings, without ROS: info, replay, salvage, export, layout.", no_args_is_help=True
)

BagFile = Annotated[Path, typer.Argument(help="Recording: .bag, .mcap, .db3 or a ROS 2 folder.")]


@app.command()
@command
def info(*, file: BagFile, output: ConsoleOptions) -> None:
    """List the topics of a recording with types, counts and rates, and what cannot be read.

    Counts are of what is in the file. The exit code is 3 when a part of the file is damaged.

    Examples:
        andabata bag info drive.bag
        andabata bag info drive.bag --json
    """
    from andabata.app.tables import recording_notes, recording_table
    from andabata.records.summary import summarise

    console = output.console()
    with console.progress("messages", None) as step:
        summary = summarise(file, lambda: step(1))
    data = {
        "file": str(file),
        "duration_s": summary.duration_s,
        "topics": [topic.to_json() for topic in summary.topics],
        "left_out": [asdict(each) for each in summary.left_out],
        "notes": list(summary.notes),
    }
    title = f"{file.name}, {summary.duration_s:.1f} s"
    console.result(data, recording_table(summary, title), *recording_notes(summary))
    # Exit code 3: there is a result, and something is missing from it.
    if summary.damaged:
        console.status(f"`andabata bag salvage {file.name} --out NEW` keeps what is whole")
        raise typer.Exit(3)


@app.command()
@command
def replay(
    *,
    file: BagFile,
    controller: Annotated[
        str | None, typer.Option(help="Controller instead of the recorded one.")
    ] = None,
    robot: RecordedRobot = None,
    faults: FaultOptions,
    recording: RecordingOptions,
    models: ModelOptions,
    output: ConsoleOptions,
) -> None:
    """Send a recording through the navigator and compare scans and commands with the recorded.

    Readings are turned into the robot's axes by /tf_static and /tf, or by --mounting. The exit code
    is 3 when data were left out, 1 when no scan could be made.

    Examples:
        andabata bag replay drive.bag
        andabata bag replay drive.bag --mounting imu=0,0,0.1,0,0,180
        andabata bag replay drive.bag --faults gnss:stuck@20
        andabata bag replay outdoor.bag --robot husky --cloud /points
        andabata bag replay outdoor.bag --map /fix=/navsat/fix --unit wheels=rpm
    """
    from andabata.app.replay_text import replay_notes, replay_text
    from andabata.replay.replay import replay_bag
    from andabata.replay.result import NoScanError, no_scan_reason

    options = recording.replay(models.load(), controller, robot, faults.read())
    console = output.console()
    with console.progress("recorded seconds", None) as step:
        data = replay_bag(file, options, lambda: step(1))
    for note in replay_notes(data):
        console.status(f"note: {note}")
    console.result(data, replay_text(data))
    # After the result, whose counts show the cause.
    if not data["scans"]:
        raise NoScanError(no_scan_reason(data))
    if data["left_out"]:
        raise typer.Exit(3)


@app.command()
@command
def salvage(
    *,
    file: Annotated[
        Path, typer.Argument(help="Damaged or unfinished recording: .bag, .mcap, .db3 or a folder.")
    ],
    out: Annotated[Path, typer.Option(help="New file with the same suffix, or new folder.")],
    output: ConsoleOptions,
) -> None:
    """Copy all whole messages of a damaged recording.

    The exit code is 3 when something was lost.

    Examples:
        andabata bag salvage broken.bag --out whole.bag
        andabata bag salvage broken.bag --out again.bag --json
    """
    from andabata.app.tables import salvage_text
    from andabata.records.salvage import salvage as keep

    result = keep(file, out)
    data = {
        "file": str(out),
        "messages": result.messages,
        "lost": result.lost,
        "lost_messages": result.lost_messages,
        "reason": result.reason,
        "notes": list(result.notes),
        "finished": result.finished,
    }
    output.console().result(data, salvage_text(data))
    if result.lost:
        raise typer.Exit(3)


@app.command()
@command
def export(
    *,
    file: Annotated[
        Path,
        typer.Argument(
            help="Recording: .bag, .mcap, .db3 or a ROS 2 folder; or the run folder of a drive."
        ),
    ],
    out: Annotated[
        Path,
        typer.Option(help="Folder; or a file: .rrd (rerun), .tum, .geojson, .ply, .las, .laz."),
    ],
    topic: Annotated[
        list[str] | None,
        typer.Option(help="Topic to export; may be repeated; all by default."),
    ] = None,
    clouds: Annotated[
        str | None, typer.Option(help="Format of the clouds in a folder: ply, pcd, las or laz.")
    ] = None,
    datum: Annotated[
        str | None,
        typer.Option(
            metavar="LAT,LON[,ALT]",
            help="Origin of the map for .geojson, in degrees and metres; by default the recorded.",
        ),
    ] = None,
    output: ConsoleOptions,
) -> None:
    """Write a recording for other tools; the suffix of --out chooses the format.

    A folder gets clouds as PLY with all their fields and everything else as CSV. Arrays of more
    than 64 bytes are written as base64, others of more than 4,096 values as a JSON list. A file
    gets the robot's tracks: .tum with times and rotations, .geojson on Earth with goals and fixes,
    .ply, .las and .laz as points in the map; or the whole scene for rerun, .rrd. The exit code is 3
    when messages were left out.

    Examples:
        andabata bag export drive.bag --out exported
        andabata bag export drive.bag --out x --topic /3D_cloud --clouds pcd
        andabata bag export drive.mcap --out drive.rrd
        andabata bag export drive.mcap --out path.tum --topic /ground_truth
        andabata bag export data/runs/drive --out path.geojson
    """
    from andabata.app.bag_exports import ExportRequest
    from andabata.app.bag_exports import export as write

    console = output.console()
    request = ExportRequest(file, out, tuple(topic) if topic else None, clouds, datum)
    with console.progress("messages", None) as step:
        exported = write(request, lambda: step(1))
    console.result(exported.data, exported.text)
    if exported.left_out:
        raise typer.Exit(3)


@app.command()
@command
def layout(
    *,
    out: Annotated[Path, typer.Option(help="JSON file to write.")],
    ros: Annotated[
        int,
        typer.Option(min=1, max=2, help="2 for .mcap and .db3 recordings, 1 for .bag files."),
    ] = 2,
    output: ConsoleOptions,
) -> None:
    """Write a layout for Foxglove: 3D scene, steering, heading error, speed and health.

    In Foxglove open the recording, then the layout by "Import from file".

    Examples:
        andabata bag layout --out foxglove.json
        andabata bag layout --out foxglove1.json --ros 1
    """
    from andabata.exports.foxglove_layout import foxglove_layout
    from andabata.runs import atomic_io
    from andabata.runs.strict_json import dumps

    content = foxglove_layout(1 if ros == 1 else 2)
    atomic_io.write(out, dumps(content, indent=2).encode())
    data = {"file": str(out), "panels": list(content["configById"])}
    output.console().result(data, f"layout for Foxglove in {out}")
