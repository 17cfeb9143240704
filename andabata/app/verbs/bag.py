"""``andabata bag``: recordings, without ROS."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from andabata.app.options import (
    ConfigFile,
    Datum,
    ForestFile,
    GroundClassifierFile,
    Json,
    Mountings,
    PolicyFile,
    Quiet,
    SensorHeight,
    Set,
)

if TYPE_CHECKING:
    from rich.table import Table

    from andabata.records.bags import LeftOut
    from andabata.records.summary import BagSummary

app = typer.Typer(
    help="Recordings, without ROS: info, replay, salvage, export.", no_args_is_help=True
)

BagFile = Annotated[Path, typer.Argument(help="Recording: .bag, .mcap, .db3 or a ROS 2 folder.")]


@app.command()
def info(file: BagFile, as_json: Json = False, quiet: Quiet = False) -> None:
    """Say what a recording holds: topics, types, counts and rates, and what cannot be read.

    Counts are of what is in the file. The exit code is 3 when a part of the file is damaged.
    """
    from andabata.app.console import Console
    from andabata.records.summary import summarise

    console = Console(quiet, as_json)
    with console.progress("messages", None) as step:
        found = summarise(file, lambda: step(1))
    rows = [topic.to_json() for topic in found.topics]
    data = {"file": str(file), "duration_s": found.duration_s, "topics": rows}
    data |= {"left_out": _left_out(found.left_out), "notes": list(found.notes)}
    console.result(data, _table(found, f"{file.name}, {found.duration_s:.1f} s"))
    told = {row["topic"]: row["reason"] for row in rows if not row["readable"]}
    lines = [f"{topic} can't be read: {reason}" for topic, reason in told.items()]
    lines += _notes([each for each in found.left_out if each.topic not in told], found.notes)
    if not as_json:
        for line in lines:
            typer.echo(line)
    if found.damaged:
        console.status(f"`andabata bag salvage {file.name} --out NEW` keeps what is whole")
        raise typer.Exit(3)


def _table(found: "BagSummary", title: str) -> "Table":
    """Return a recording's table, with the columns that tell something."""
    from andabata.app.console import table_of

    shown = ["topic", "type", "messages", "rate_hz"]
    shown += ["connections"] if any(topic.connections > 1 for topic in found.topics) else []
    shown += ["readable"] if not all(topic.readable for topic in found.topics) else []
    rows = [topic.to_json() for topic in found.topics]
    return table_of([{key: _yes_no(row[key]) for key in shown} for row in rows], title)


@app.command()
def replay(
    file: BagFile,
    cloud: Annotated[
        str | None,
        typer.Option(help="A 3D laser's topic (PointCloud2) instead of the turning laser's two."),
    ] = None,
    renamed: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            metavar="OURS=THEIRS",
            help="A topic's name in this recording, as /fix=/navsat/fix; may be repeated. "
            "/encoder_data may be a JointState, an Odometry or a TwistStamped.",
        ),
    ] = None,
    unit: Annotated[
        list[str] | None,
        typer.Option(
            metavar="QUANTITY=UNIT",
            help="Unit of acceleration (m/s2, g, mg), angular_velocity (rad/s, deg/s), "
            "magnetic_field (T, mT, uT, nT, G, mG) or wheels (rad/s, m/s, rpm, deg/s), or a factor "
            "to SI, where sizes don't tell it; may be repeated.",
        ),
    ] = None,
    controller: Annotated[
        str | None, typer.Option(help="Who steers instead of the recorded controller.")
    ] = None,
    datum: Datum = None,
    robot: Annotated[
        str | None, typer.Option(help="Body instead of the recorded one: andabata, husky, jackal.")
    ] = None,
    mounting: Mountings = None,
    sensor_height: SensorHeight = None,
    forest: ForestFile = None,
    ground_classifier: GroundClassifierFile = None,
    policy: PolicyFile = None,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Send a recording through the navigator and compare scans and commands with the recorded.

    Readings are turned into the robot's axes by /tf_static and /tf, or by --mounting. The exit code
    is 3 when data were left out, 1 when no scan could be made.
    """
    from andabata.app.console import Console
    from andabata.app.datum import datum_notes, datum_overrides
    from andabata.app.mountings import mountings_in_words, read_mountings, with_height
    from andabata.app.settings import resolve
    from andabata.app.usage import pairs, units
    from andabata.assembly.simulated_robot import SimulatedRobotConfig
    from andabata.machine.robot import RobotModel
    from andabata.models import Models
    from andabata.replay.options import ReplayOptions
    from andabata.replay.replay import replay_bag
    from andabata.replay.result import NoScanError, no_scan_reason, summary_text

    overrides = (*with_height(settings, sensor_height), *datum_overrides(datum))

    def configure(recorded: SimulatedRobotConfig) -> SimulatedRobotConfig:
        body = {"robot": RobotModel.load(robot)} if robot else {}
        return resolve(SimulatedRobotConfig, config, overrides, recorded.model_copy(update=body))

    mountings = read_mountings(mounting or ())
    names = pairs(renamed or (), "--map")
    given_units = units(unit or ())
    console = Console(quiet, as_json)
    with console.progress("recorded seconds", None) as step:
        models = Models.load(forest, ground_classifier, policy)
        options = ReplayOptions(controller, models, cloud, configure, names, mountings, given_units)
        data = replay_bag(file, options, lambda: step(1))
    if data["same_models"] is False:
        console.status("note: other models drove; scans and commands may differ")
    if data["laser"] != "/2D_scan":
        console.status(f"note: cells are made of {data['laser']}")
    for note in datum_notes(data):
        console.status(f"note: {note}")
    console.result(data, f"{summary_text(data)}\n{mountings_in_words(data['frames'])}")
    if not data["scans"]:
        raise NoScanError(no_scan_reason(data))
    if data["left_out"]:
        raise typer.Exit(3)


@app.command()
def salvage(
    file: Annotated[
        Path, typer.Argument(help="Damaged or unfinished recording: .bag, .mcap, .db3 or a folder.")
    ],
    out: Annotated[Path, typer.Option(help="New file with the same suffix, or new folder.")],
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Keep what is whole of a recording. The exit code is 3 when something was lost."""
    from andabata.app.console import Console
    from andabata.records.salvage import salvage as keep

    console = Console(quiet, as_json)
    found = keep(file, out)
    data = {"file": str(out), "messages": found.messages, "lost": found.lost}
    data |= {"lost_messages": found.lost_messages, "reason": found.reason}
    count = "an unknown number of" if found.lost_messages is None else found.lost_messages
    ending = f"{count} messages lost: {found.reason}" if found.lost else "nothing was lost"
    lines = [f"{out}: {found.messages} messages; {ending}", *_notes((), found.notes)]
    console.result(data | {"notes": list(found.notes)}, "\n".join(lines))
    if found.lost:
        raise typer.Exit(3)


@app.command()
def export(
    file: BagFile,
    out: Annotated[Path, typer.Option(help="Folder for the files.")],
    topic: Annotated[
        list[str] | None, typer.Option(help="A topic to export; may be repeated; all without.")
    ] = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Write clouds as PLY with all their fields and everything else as CSV.

    Arrays of more than 64 bytes are written as base64, others of more than 4,096 values as a JSON
    list. The exit code is 3 when messages were left out.
    """
    from andabata.app.console import Console
    from andabata.records.export import export_bag

    console = Console(quiet, as_json)
    with console.progress("messages", None) as step:
        found = export_bag(file, out, tuple(topic) if topic else None, lambda: step(1))
    data = {
        "files": [str(path) for path in found.files],
        "left_out": _left_out(found.left_out),
        "notes": list(found.notes),
    }
    lines = [f"{len(found.files)} files in {out}", *_notes(found.left_out, found.notes)]
    console.result(data, "\n".join(lines))
    if found.left_out:
        raise typer.Exit(3)


def _yes_no(value: object) -> object:
    """Return a truth value as a word."""
    return ("no", "yes")[value] if isinstance(value, bool) else value


def _left_out(found: "Sequence[LeftOut]") -> list[dict[str, Any]]:
    """Return what was left out, ready for JSON."""
    return [asdict(each) for each in found]


def _notes(left_out: "Sequence[LeftOut]", notes: "Sequence[str]") -> list[str]:
    """Return in words what was left out and what else people should know."""
    return [str(each) for each in left_out] + [f"note: {note}" for note in notes]
