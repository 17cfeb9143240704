"""Drives in development worlds in the reference plant, with a floor of goals.

natural-test, world seeds 7300 to 7323, three goals in a row, bullet, the whole chain: five to ten
minutes on two cores. The floor stands two drives below what the robot reached when it was set: 24,
24 and 22 of 24.
"""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.progress import track

from andabata.assembly.controllers import DEFAULT_CONTROLLER
from andabata.bench.studies.soak.outcome import Outcome, Tally
from andabata.engine_processes import ProcessEngine
from andabata.evaluation.offroad import EvaluationConfig, OffroadComparison
from andabata.evaluation.offroad_table import summarise
from andabata.models import Models
from worlds.splits import DEVELOPMENT_SEEDS

WORLDS = len(DEVELOPMENT_SEEDS)
"""Number of worlds."""

_GOALS = 3

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


def evaluation() -> EvaluationConfig:
    """Return the evaluation whose first worlds are driven: that of the development suite."""
    return EvaluationConfig(suite="development", controllers=(DEFAULT_CONTROLLER,), goals=_GOALS)


def drive_worlds(count: int, workers: int) -> list[int]:
    """Return how many drives reach the first, the first two, and all three goals.

    Args:
        count: Number of worlds, each of which is driven once.
        workers: Number of processes; the result does not depend on it.
    """
    config = evaluation()
    comparison, worlds = OffroadComparison.of(config, Models()), range(count)
    with ProcessEngine(workers) as engine:
        work = engine.run(comparison.drive, worlds)
        bar = track(work, "drives", total=count, console=Console(stderr=True))
        attempts = [attempt for _, _, driven in bar for attempt in driven.attempts]
    rows = summarise(attempts, config.controllers)
    return [row["successes"] for row in rows[:_GOALS]]


def worlds_are_driven(count: int, folder: Path) -> Outcome:
    """Check that drives in development worlds reach as many goals as the floor asks for."""
    reached, tally = drive_worlds(count, 2), Tally()
    tally.trials, tally.failures = count, shortfalls(reached, count)
    goals = " and ".join([", ".join(map(str, reached[:-1])), str(reached[-1])])
    return tally.outcome(f"goals 1, 2 and 3 in {goals} of {count} worlds")
