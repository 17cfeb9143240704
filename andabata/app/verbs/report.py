"""``andabata report``: figures of runs on one page."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.models import ClassifierOptions
from andabata.app.options.shared import ConsoleOptions, Workers


@command
def report(
    *,
    runs: Annotated[
        list[Path],
        typer.Argument(
            help="Folder of any run: clouds generate, classifier, train, drive, evaluate, "
            "lidar-study. Several of train, a seed or plan each, or of drive in one world."
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
    figures: Annotated[
        Path | None, typer.Option(help="Folder for each figure of the page as PNG and as SVG.")
    ] = None,
    models: ClassifierOptions,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Write one HTML page about runs: tables, the papers' figures, failures, and how to repeat it.

    The page needs no network: it is one file, for light and dark screens and for paper. Lines in it
    are zoomed by buttons, dragged, and read under the pointer.

    Examples:
        andabata report data/runs/train
        andabata report data/runs/train/seed-0 data/runs/train/seed-1 --tests 2
        andabata report data/runs/spn --out report.html --json
        andabata report data/runs/drive --figures figures
        andabata report data/runs/generalisation
    """
    from andabata.app.reports import make_report, run_folders
    from andabata.report.options import ReportOptions
    from andabata.runs import atomic_io
    from andabata.runs.folder import make_folder

    path, console = out or runs[0] / "report.html", output.console()
    options = ReportOptions(models.load, tests, workers, console.progress)
    page, found, table = make_report(run_folders(runs), options)
    content = page.to_bytes()
    make_folder(path.parent)
    atomic_io.write(path, content)
    data = found | {"report": str(path), "bytes": len(content)}
    if figures is not None:
        data["figures"] = page.write_figures(make_folder(figures))
    console.result(data, table, f"report: {path}")
