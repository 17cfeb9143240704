"""``andabata view``: recordings, drives and evaluations in a browser."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.models import ModelOptions
from andabata.app.options.recording import RecordingOptions
from andabata.app.options.shared import ConsoleOptions
from andabata.app.options.view import PageOptions


@command
def view(
    *,
    run_or_bag: Annotated[
        Path,
        typer.Argument(
            help="Run folder of drive, of evaluate in rooms or fields, or of lidar-study; or a "
            "recording: .bag, .mcap, .db3 or a ROS 2 folder."
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="Write one HTML file that plays by itself, instead of serving."),
    ] = None,
    first: Annotated[
        list[str] | None,
        typer.Option(
            metavar="WHAT=VALUE",
            help="Drive of an evaluation to begin with, as room=spn-env1 or drive=3; may be "
            "repeated.",
        ),
    ] = None,
    controller: Annotated[
        str | None, typer.Option(help="Controller instead of the recorded one.")
    ] = None,
    page: PageOptions,
    recording: RecordingOptions,
    models: ModelOptions,
    output: ConsoleOptions,
) -> None:
    """Show a recording, a drive, or the drives of an evaluation in rooms in a browser.

    A recording is sent through the navigator again; drives in rooms are driven again, with the same
    noise. The page is served on this machine alone, until Ctrl-C.

    Examples:
        andabata view drive.mcap
        andabata view data/runs/drive --view-speed 5
        andabata view data/runs/spn --first room=spn-env1 --first drive=3
        andabata view drive.mcap --out drive.html
    """
    from andabata.app.replay_text import replay_notes, replay_text
    from andabata.app.viewing import is_run_folder, view_folder, view_recording
    from andabata.configuration.usage import UsageError, pairs

    if out is not None and out.suffix != ".html":
        raise UsageError(f"--out: expected a file that ends in .html, got {out}")
    console, config = output.console(), page.view_config()
    if is_run_folder(run_or_bag):
        view_folder(run_or_bag, config, pairs(first or (), "--first"), out, console)
        shown = {"run": str(run_or_bag)} | ({"page": str(out)} if out else {})
        console.result(shown, f"page: {out}" if out else f"viewed: {run_or_bag}")
        return
    options = recording.replay(models.load(), controller)
    data = view_recording(run_or_bag, options, config, out, console)
    for note in replay_notes(data):
        console.status(f"note: {note}")
    data |= {"page": str(out)} if out else {}
    console.result(data, replay_text(data), *([f"page: {out}"] if out else []))
