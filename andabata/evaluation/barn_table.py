"""Tables of the BARN benchmark: runs, their scores, and rows with intervals and differences.

Runs of one world are alike, so worlds are what is counted: intervals are those of the same
controllers on other worlds of the kind.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from andabata.evaluation.attempt import CONTACTS, Attempt
from andabata.evaluation.table import (
    Design,
    Row,
    Sample,
    Table,
    average,
    by_contender,
    by_repetition,
    by_scenario,
    hit_counts,
    is_success,
    mean,
    mean_difference,
    share,
    share_difference,
)
from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.terminations import Outcome

_FASTEST, _SLOWEST = 2.0, 8.0
"""Multiples of the optimal time between which a run's score depends on its time."""


@dataclass(frozen=True)
class BarnMeasures:
    """Measures of a run.

    Attributes:
        optimal_time: Time of the world's path at 2 m/s [s].
        goal_distance: Distance from the goal at the end [m].
        speed: Speed at the end [m/s].
    """

    optimal_time: float
    goal_distance: float
    speed: float


BarnAttempt = Attempt[BarnMeasures]
"""A run; its time is 0 if the robot never left its start."""


def run_row(run: BarnAttempt) -> Row:
    """Return a run, ready for JSON, without its path."""
    return {
        "controller": run.contender,
        "world": run.scenario,
        "trial": run.repetition,
        "outcome": str(run.outcome),
        "contact": run.contact.label,
        "time": run.time,
        "optimal_time": run.detail.optimal_time,
        "left": run.detail.goal_distance,
        "speed": run.detail.speed,
    }


def run_of(row: Mapping[str, Any]) -> BarnAttempt:
    """Return the run of a row of ``run_row``; before contacts were told, all stood."""
    outcome = Outcome(row["outcome"])
    before = Contact.OBSTACLE if outcome is Outcome.COLLISION else Contact.NONE
    return Attempt(
        contender=row["controller"],
        scenario=row["world"],
        repetition=row["trial"],
        outcome=outcome,
        contact=CONTACTS[row.get("contact", before.label)],
        time=row["time"],
        distance=np.nan,
        shortest=np.nan,
        detail=BarnMeasures(row["optimal_time"], row["left"], row["speed"]),
    )


def failure(run: BarnAttempt) -> str | None:
    """Return the kind of a failure: ``collision``, ``timeout`` or ``never_left``; else None."""
    if run.is_success:
        return None
    # A robot that stands at its start is another fault than one that is late: the clock never ran.
    if run.outcome is Outcome.TIMEOUT and run.time == 0.0:
        return "never_left"
    return str(run.outcome)


def score(run: BarnAttempt) -> float:
    """Return the official score, at most 0.5."""
    best = run.detail.optimal_time
    return run.is_success * best / min(max(run.time, _FASTEST * best), _SLOWEST * best)


def ot_over_t(run: BarnAttempt) -> float:
    """Return the optimal time over the run's own, 0 for a failure.

    It tells navigators apart that all have the full score. At the largest speed it is above 1: the
    path ends at the goal, a run 1 m before it, and its clock starts after 0.1 m.
    """
    # A run whose clock never ran has no time.
    return run.detail.optimal_time / run.time if run.is_success and run.time else 0.0


def _head(sample: Sample) -> Row:
    """Return the controller, and how its runs ended."""
    failures = [failure(run) for run in sample.attempts]
    return {
        "controller": sample.attempts[0].contender,
        "worlds": len(sample.clusters),
        "runs": len(sample.attempts),
        "successes": sample.count(is_success),
        "collisions": failures.count("collision"),
        **hit_counts(sample),
        "timeouts": failures.count("timeout"),
        "never_left": failures.count("never_left"),
    }


def _compared(base: Sample, other: Sample) -> Row:
    """Return what is compared."""
    return {
        "controller": other.attempts[0].contender,
        "against": base.attempts[0].contender,
        "worlds": len(base.clusters),
    }


BARN_TABLE = Table(
    by=by_contender,
    design=Design(cluster=by_scenario, repeat=by_repetition),
    columns=(
        _head,
        share(),
        average("mean_time_s", lambda run: run.time, is_success),
        mean("score", score, most=0.5),
        mean("ot_over_t", ot_over_t),
    ),
    comparators=(
        _compared,
        share_difference("success"),
        mean_difference("score", score),
        mean_difference("ot_over_t", ot_over_t),
    ),
)
"""Rows of the controllers, and differences from the first one in the same worlds and trials."""


def barn_failures(runs: Sequence[BarnAttempt]) -> list[Row]:
    """Return the runs that failed, ready for JSON."""
    return [
        {
            "controller": run.contender,
            "world": run.scenario,
            "trial": run.repetition,
            "failure": failure(run),
            "contact": run.contact.label,
            "time_s": run.time,
            "left_m": run.detail.goal_distance,
            "speed_m_s": run.detail.speed,
        }
        for run in runs
        if not run.is_success
    ]
