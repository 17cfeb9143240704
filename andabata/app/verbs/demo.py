"""``andabata demo``: all of it, small, from nothing to a driven path and a report."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.options import ConfigFile, EvaluationSeed, Json, Quiet, Sensor, Set, Workers


def demo(
    out: Annotated[Path, typer.Option(help="Folder for the report.")] = Path("data/demo"),
    sensor: Sensor = "utm-30lx",
    seed: EvaluationSeed = 0,
    workers: Workers = 2,
    config: ConfigFile = None,
    settings: Set = None,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Make clouds, grow a forest, learn a little, drive a natural world, and report it."""
    from andabata.app.console import Console
    from andabata.app.demonstration import Demonstration, DemonstrationConfig
    from andabata.app.settings import resolve

    console = Console(quiet, as_json)
    resolved = resolve(DemonstrationConfig, config, settings or ())
    result = Demonstration(resolved, out, seed, workers, console, sensor).run()
    console.result(result, f"report: {result['report']}")
