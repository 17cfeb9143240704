"""``andabata demo``: the whole chain, small, from nothing to a driven path and a report."""

from pathlib import Path
from typing import Annotated

import typer

from andabata.app.command import command
from andabata.app.options.shared import (
    ConsoleOptions,
    EvaluationSeed,
    Sensor,
    SettingsOptions,
    Workers,
)
from worlds.splits import DEVELOPMENT_SEED


@command
def demo(
    *,
    out: Annotated[Path, typer.Option(help="Folder for the report.")] = Path("data/demo"),
    sensor: Sensor = "utm-30lx",
    settings: SettingsOptions,
    seed: EvaluationSeed = DEVELOPMENT_SEED,
    workers: Workers = 2,
    output: ConsoleOptions,
) -> None:
    """Make clouds, train a forest, train a policy a little, drive a natural world, report it.

    Examples:
        andabata demo
        andabata demo --sensor os1-64 --out data/demo-os1
        andabata demo --set trials=4 --set episodes=128 --workers 4
    """
    from andabata.app.jobs.demonstration import Demonstration, DemonstrationConfig

    console, config = output.console(), settings.resolve(DemonstrationConfig)
    result = Demonstration(config, out, seed, workers, console, sensor).run()
    console.result(result, f"report: {result['report']}")
