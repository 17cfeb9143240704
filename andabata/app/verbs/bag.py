"""``andabata bag``: recordings, without ROS."""

from pathlib import Path
from typing import Annotated, Any

import typer

from andabata.app.options import (
    ConfigFile,
    Datum,
    ForestFile,
    Json,
    PolicyFile,
    Quiet,
    Set,
    SquaresFile,
)

app = typer.Typer(
    help="Recordings, without ROS: info, replay, salvage, export.", no_args_is_help=True
)

BagFile = Annotated[Path, typer.Argument(help="Recording: .bag, .mcap or a ROS 2 folder.")]


@app.command()
def info(file: BagFile, as_json: Json = False, quiet: Quiet = False) -> None:
    """Say what a recording holds: topics, types, counts and rates."""
    from andabata.app.console import Voice, table_of
    from andabata.records.bags import Bag

    voice = Voice(quiet, as_json)
    with Bag(file) as bag:
        spans: dict[str, list[int]] = {}
        for message in bag.messages():
            span = spans.setdefault(message.topic, [message.stamp_ns, message.stamp_ns, 0])
            span[1] = message.stamp_ns
            span[2] += 1
        kinds = bag.topics
    rows: list[dict[str, Any]] = []
    for name, (kind, _) in sorted(kinds.items()):
        first, last, count = spans.get(name, [0, 0, 0])
        seconds = (last - first) / 1e9
        rate = (count - 1) / seconds if count > 1 and seconds > 0 else None
        rows.append({"topic": name, "type": kind, "messages": count, "rate_hz": rate})
    stamps = [stamp for span in spans.values() for stamp in span[:2]]
    duration = (max(stamps) - min(stamps)) / 1e9 if stamps else 0.0
    data = {"file": str(file), "duration_s": duration, "topics": rows}
    voice.result(data, table_of(rows, f"{file.name}, {duration:.1f} s"))


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
            "/encoder_data may be a JointState.",
        ),
    ] = None,
    controller: Annotated[
        str | None, typer.Option(help="Who steers instead of the recorded controller.")
    ] = None,
    datum: Datum = None,
    robot: Annotated[
        str | None, typer.Option(help="Body instead of the recorded one: andabata, husky, jackal.")
    ] = None,
    forest: ForestFile = None,
    squares: SquaresFile = None,
    policy: PolicyFile = None,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Send a recording through the navigator and compare scans and commands with the recorded."""
    from andabata.app.console import Voice
    from andabata.app.datum import datum_notes, datum_overrides
    from andabata.app.replaying import replay_bag
    from andabata.app.settings import resolve
    from andabata.app.usage import pairs
    from andabata.machine.robot import RobotModel
    from andabata.models import Models
    from andabata.tasks.rig import RigConfig

    overrides = (*(settings or ()), *datum_overrides(datum))

    def configure(recorded: RigConfig) -> RigConfig:
        body = {"robot": RobotModel.load(robot)} if robot else {}
        return resolve(RigConfig, config, overrides, recorded.model_copy(update=body))

    names = pairs(renamed or (), "--map")
    voice = Voice(quiet, as_json)
    with voice.progress("recorded seconds", None) as step:
        data = replay_bag(
            file,
            controller,
            Models.load(forest, squares, policy),
            lambda: step(1),
            cloud,
            configure,
            names,
        )
    if data["same_models"] is False:
        voice.say("note: other models drove; scans and commands may differ")
    if data["laser"] != "/2D_scan":
        voice.say(f"note: cells are made of {data['laser']}")
    for note in datum_notes(data):
        voice.say(f"note: {note}")
    text = (
        f"{data['periods']} control periods, {data['scans']} virtual scans: "
        f"{data['differing_scans']} of {data['recorded_scans']} recorded scans and "
        f"{data['differing_commands']} commands differ"
    )
    voice.result(data, text)


@app.command()
def salvage(
    file: Annotated[Path, typer.Argument(help="Damaged or unfinished recording: .bag or .mcap.")],
    out: Annotated[Path, typer.Option(help="New file with the same suffix.")],
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Keep what is whole of a recording. The exit code is 3 when something was lost."""
    from andabata.app.console import Voice
    from andabata.records.salvage import salvage as keep

    voice = Voice(quiet, as_json)
    found = keep(file, out)
    data = {"file": str(out), "messages": found.messages, "lost": found.lost}
    ending = f"the rest is lost: {found.reason}" if found.lost else "nothing was lost"
    voice.result(data | {"reason": found.reason}, f"{out}: {found.messages} messages; {ending}")
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
    """Write clouds as PLY and everything else as CSV."""
    from andabata.app.console import Voice
    from andabata.app.runs import make_folder
    from andabata.records.export import export_bag

    voice = Voice(quiet, as_json)
    folder = make_folder(out)
    with voice.progress("messages", None) as step:
        written = export_bag(file, folder, tuple(topic) if topic else None, lambda: step(1))
    voice.result({"files": [str(path) for path in written]}, f"{len(written)} files in {out}")
