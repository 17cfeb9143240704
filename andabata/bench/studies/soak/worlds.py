"""Drives in development worlds in the reference plant, with a floor of goals.

natural-test, world seeds 7300 to 7323, three goals in a row, bullet, the whole chain: five to ten
minutes on two cores. The floor stands two drives below what the robot reached when it was set: 24,
24 and 22 of 24.
"""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from rich.console import Console
from rich.progress import track

from andabata.bench.studies.privileged import AS_IT_IS, Drive, drive_with, reached_in_a_row
from andabata.bench.studies.soak.outcome import Outcome, Tally
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


def drive_worlds(world: str, first_world: int, worlds: int, workers: int) -> list[Drive]:
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


def worlds_are_driven(count: int, folder: Path) -> Outcome:
    """Check that drives in development worlds reach as many goals as the floor asks for."""
    drives = drive_worlds(WORLD, FIRST_WORLD, count, 2)
    reached, tally = reached_in_a_row(drives), Tally()
    tally.trials, tally.failures = count, shortfalls(reached, count)
    goals = " and ".join([", ".join(map(str, reached[:-1])), str(reached[-1])])
    return tally.outcome(f"goals 1, 2 and 3 in {goals} of {count} worlds")
