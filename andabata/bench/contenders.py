"""Contenders that do the same work in turns, and how fast each is."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from andabata.bench.speed_peers import Work
from andabata.bench.table import Row, benchmark_row
from andabata.machine.plants import bullet_step

OURS = "andabata"
"""Name of this project in the tables."""


@dataclass(frozen=True)
class Contender:
    """Implementation of a case.

    Attributes:
        subject: Name for tables.
        amount: Units of work in one call.
        make: Function that prepares the work and returns it as a call; raises ImportError if the
            peer is not installed.
    """

    subject: str
    amount: float
    make: Callable[[], Work]


@dataclass(frozen=True)
class Case:
    """Kind of work with its contenders.

    Attributes:
        name: Name for tables.
        unit: Unit of the speed.
        contenders: Contenders, ours first.
    """

    name: str
    unit: str
    contenders: tuple[Contender, ...]


def run_case(case: Case, runs: int, seconds: float, status: Callable[[str], None]) -> list[Row]:
    """Return one row for each contender that is installed: the median over turns.

    The contenders take turns, so that a busy machine slows all of them.

    Args:
        case: Work and its contenders.
        runs: Number of turns.
        seconds: Shortest duration of a turn of one contender [s].
        status: Function that is called with a message for each contender that is left out.
    """
    works: list[tuple[Contender, Work]] = []
    for contender in case.contenders:
        try:
            work = contender.make()
        except ImportError as error:
            way = bullet_step() if error.name == "pybullet" else "extra `peers`"
            status(f"{contender.subject}: left out, {error.name} is not installed ({way})")
            continue
        work()  # Compiled code is compiled, caches are warm.
        works.append((contender, work))
    speeds: dict[str, list[float]] = {contender.subject: [] for contender, _ in works}
    for _ in range(runs):
        for contender, work in works:
            speeds[contender.subject].append(contender.amount / _seconds_of(work, seconds))
    ours = float(np.median(speeds[works[0][0].subject]))
    rows = []
    for subject, values in speeds.items():
        median = float(np.median(values))
        row = benchmark_row(case.name, subject, median, case.unit, runs, median / ours)
        rows.append(row | {"low": min(values), "high": max(values)})
    return rows


def _seconds_of(work: Work, seconds: float) -> float:
    """Return the mean duration of a call [s], which is called for at least ``seconds``."""
    spent, calls, turn = 0.0, 0, time.perf_counter()
    while calls == 0 or time.perf_counter() - turn < seconds:
        began = time.perf_counter()
        own = work()
        spent += own if isinstance(own, float) else time.perf_counter() - began
        calls += 1
    return spent / calls
