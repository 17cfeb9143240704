"""Drives many development worlds in the reference plant and fails below a floor of goals.

``python -m andabata.bench.studies.soak`` takes five to ten minutes on two cores, too long for the
test suite: natural-test, world seeds 7300 to 7323, three goals in a row, bullet, the whole chain.
The floor stands two drives below what the robot reached when it was set: 24, 24 and 22 of 24.
"""

import argparse
import sys
from collections.abc import Sequence
from functools import partial

from rich.console import Console
from rich.progress import track

from andabata.bench.studies.privileged import (
    AS_IT_IS,
    Drive,
    drive_with,
    reached_in_a_row,
    variant_row,
)
from andabata.bench.table import markdown_table
from andabata.engine_processes import run_tasks
from worlds.splits import DEVELOPMENT_SEEDS

WORLD, FIRST_WORLD, WORLDS = "natural-test", DEVELOPMENT_SEEDS[0], len(DEVELOPMENT_SEEDS)
"""Preset, first world seed and number of worlds."""

FLOOR = (22, 22, 20)
"""Smallest number of drives, of ``WORLDS``, that reach the first, two and three goals."""


def floor_of(worlds: int) -> tuple[int, ...]:
    """Return the floor for a number of worlds: as many misses as ``FLOOR`` allows of all."""
    return tuple(max(0, worlds - (WORLDS - goals)) for goals in FLOOR)


def shortfalls(reached: Sequence[int], worlds: int) -> list[str]:
    """Return one message for each goal that fewer drives reached than the floor asks for.

    Args:
        reached: Numbers of drives that reached the first, two and three goals.
        worlds: Number of drives.
    """
    return [
        f"goal {number}: expected at least {floor} of {worlds} drives, got {got}"
        for number, (got, floor) in enumerate(zip(reached, floor_of(worlds), strict=True), start=1)
        if got < floor
    ]


def soak(world: str, first_world: int, worlds: int, workers: int) -> list[Drive]:
    """Drive the worlds, with a progress bar on standard error.

    Args:
        world: World preset.
        first_world: First world seed.
        worlds: Number of worlds.
        workers: Number of processes; the result does not depend on it.
    """
    places = [(world, first_world + k) for k in range(worlds)]
    work = run_tasks(partial(drive_with, AS_IT_IS), places, workers)
    bar = track(work, "drives", total=worlds, console=Console(stderr=True))
    return [drive for _, drive in bar]


def main(argv: Sequence[str] | None = None) -> int:
    """Drive, print a Markdown table, and return 1 if a floor is missed, else 0."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--world", default=WORLD, help="World preset.")
    parser.add_argument("--first-world", type=int, default=FIRST_WORLD, help="First world seed.")
    parser.add_argument("--worlds", type=int, default=WORLDS, help="Number of worlds.")
    parser.add_argument("--workers", type=int, default=2, help="Number of processes.")
    options = parser.parse_args(argv)
    drives = soak(options.world, options.first_world, options.worlds, options.workers)
    sys.stdout.write(markdown_table([variant_row("soak", drives)]))
    missed = shortfalls(reached_in_a_row(drives), options.worlds)
    sys.stderr.writelines(f"error: {message}\n" for message in missed)
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
