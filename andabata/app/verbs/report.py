"""``andabata report``: figures of training runs on one page."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options import ClassifierOptions, ConsoleOptions, Workers


@command
def report(
    *,
    runs: Annotated[
        list[Path], typer.Argument(help="Folders of training runs of one plan, a seed each.")
    ],
    tests: Annotated[
        int,
        typer.Option(min=1, max=4, help="Number of drives of each stage's policy, a goal each."),
    ] = 3,
    out: Annotated[
        Path | None, typer.Option(help="HTML file; report.html in the first run by default.")
    ] = None,
    models: ClassifierOptions,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Draw the rewards, worlds, scans and test drives of training runs on one HTML page.

    Examples:
        andabata report data/runs/train
        andabata report data/runs/train/seed-0 data/runs/train/seed-1 --tests 2
        andabata report data/runs/train --out report.html --json
    """
    from andabata.app.console import table_of
    from andabata.app.training_report import common_stages, read_runs, report_runs
    from andabata.records import atomic_io
    from andabata.records.runs import make_folder

    loaded = models.load()
    found = read_runs(runs, loaded)
    path = out or runs[0] / "report.html"
    make_folder(path.parent)
    console, drives = output.console(), len(found) * len(common_stages(found)) * tests
    with console.progress("test drives", drives) as step:
        page, data = report_runs(
            found, loaded, tests=tests, workers=workers, on_test=lambda: step(1)
        )
    atomic_io.write(path, page)
    console.result(data | {"report": str(path)}, table_of(data["tests"], f"report: {path}"))
