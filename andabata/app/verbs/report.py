"""``andabata report``: what training runs came to."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.options import ForestFile, GroundClassifierFile, Json, Quiet, Workers


def report(
    runs: Annotated[
        list[Path], typer.Argument(help="Folders of training runs of one plan, a seed each.")
    ],
    tests: Annotated[
        int, typer.Option(min=1, max=4, help="Drives of each stage's policy, a goal each.")
    ] = 3,
    out: Annotated[
        Path | None, typer.Option(help="HTML file; report.html in the first run by default.")
    ] = None,
    forest: ForestFile = None,
    ground_classifier: GroundClassifierFile = None,
    workers: Workers = 2,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Draw the rewards, worlds, scans and test drives of training runs on one HTML page."""
    from andabata.app.console import Console, table_of
    from andabata.app.training_report import common_stages, read_runs, report_runs
    from andabata.models import Models
    from andabata.records import atomic_io
    from andabata.records.runs import make_folder

    console = Console(quiet, as_json)
    models = Models.load(forest, ground_classifier)
    found = read_runs(runs, models)
    path = out or runs[0] / "report.html"
    make_folder(path.parent)
    drives = len(found) * len(common_stages(found)) * tests
    with console.progress("test drives", drives) as step:
        page, data = report_runs(
            found, models, tests=tests, workers=workers, on_test=lambda: step(1)
        )
    atomic_io.write(path, page)
    console.result(data | {"report": str(path)}, table_of(data["tests"], f"report: {path}"))
