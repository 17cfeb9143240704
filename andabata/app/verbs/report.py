"""``andabata report``: figures of runs on one page."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options import ClassifierOptions, ConsoleOptions, Workers


@command
def report(
    *,
    runs: Annotated[
        list[Path],
        typer.Argument(
            help="Folders of training runs, a seed each; or one of evaluate in rooms or of "
            "lidar-study."
        ),
    ],
    tests: Annotated[
        int,
        typer.Option(
            min=1, max=4, help="Number of drives of each off-road stage's policy, a goal each."
        ),
    ] = 3,
    out: Annotated[
        Path | None, typer.Option(help="HTML file; report.html in the first folder by default.")
    ] = None,
    models: ClassifierOptions,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Draw the rewards, worlds, scans and test drives of training runs on one HTML page.

    Of runs in rooms: learning curves, ends and paths, support points, tours.

    Examples:
        andabata report data/runs/train
        andabata report data/runs/train/seed-0 data/runs/train/seed-1 --tests 2
        andabata report data/runs/spn --out report.html --json
        andabata report data/runs/study
    """
    from andabata.app.reports import make_report, run_folders
    from andabata.records import atomic_io
    from andabata.records.runs import make_folder

    path = out or runs[0] / "report.html"
    made = make_report(run_folders(runs), models, tests, workers, console := output.console())
    make_folder(path.parent)
    atomic_io.write(path, made.page)
    console.result(made.data | {"report": str(path)}, made.shown, f"report: {path}")
