"""Compares a Ray of this machine with processes: the same clouds by each, in turns.

``python -m andabata.bench.studies.engines`` (extra ``ray``) keeps both engines open and gives each
of them the same worlds, again and again: what else the machine does meets both. Starting the
engines is left out.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from statistics import median

from andabata.bench.table import Row, markdown_table
from andabata.datasets.generate import generate_dataset
from andabata.datasets.labelled_cloud import CloudsConfig
from andabata.engine import Engine
from andabata.engine_processes import ProcessEngine
from andabata.engine_ray import RayEngine


def compare(clouds: int, turns: int, workers: int) -> list[Row]:
    """Return a row of seconds for each engine, and the ratio to processes.

    Args:
        clouds: Number of clouds of a turn.
        turns: Number of turns; the first one, in which workers load what they need, is left out.
        workers: Number of workers of each engine.
    """
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        engines: dict[str, Engine] = {
            "processes": stack.enter_context(ProcessEngine(workers)),
            "ray": stack.enter_context(RayEngine(workers)),
        }
        seconds: dict[str, list[float]] = {name: [] for name in engines}
        for turn in range(turns + 1):
            for name, engine in engines.items():
                seconds[name].append(_time(engine, folder / f"{name}-{turn}", clouds, turn))
    pairs = zip(seconds["ray"][1:], seconds["processes"][1:], strict=True)
    ratios = {"processes": 1.0, "ray": median(one / other for one, other in pairs)}
    return [
        {
            "engine": name,
            "clouds": clouds * turns,
            "fastest turn [s]": round(min(taken[1:]), 2),
            "all turns [s]": round(sum(taken[1:]), 1),
            "median ratio": round(ratios[name], 3),
        }
        for name, taken in seconds.items()
    ]


def _time(engine: Engine, folder: Path, clouds: int, seed: int) -> float:
    """Return the time in which an engine makes a data set [s]."""
    begin, config = time.perf_counter(), CloudsConfig()
    generate_dataset(folder, config, {"train": clouds}, seed, lambda count: None, engine=engine)
    return time.perf_counter() - begin


def main(argv: Sequence[str] | None = None) -> int:
    """Compare and print a Markdown table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--clouds", type=int, default=125, help="Number of clouds of a turn.")
    parser.add_argument("--turns", type=int, default=4, help="Number of turns.")
    parser.add_argument("--workers", type=int, default=2, help="Number of workers.")
    options = parser.parse_args(argv)
    rows = compare(options.clouds, options.turns, options.workers)
    sys.stdout.write(markdown_table(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
