"""Table of an evaluation in rooms: a row a cell, and one for all policies of a cell."""

from collections import Counter
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from andabata.evaluation.attempt import Attempt
from andabata.evaluation.room_drives import RoomAttempt
from andabata.evaluation.statistics import group_difference, wilson_interval
from andabata.evaluation.table import (
    Column,
    Design,
    Row,
    Sample,
    Table,
    average,
    by_contender,
    by_task,
    counts,
    hit_counts,
    is_success,
    pair,
    share,
    share_difference,
)
from andabata.tasks.terminations import Outcome
from worlds.rooms.catalogue import make_room

_STEP_COST = 0.001
"""Loss of a task's score with each control step (equation 5)."""

_OVER_ROOMS = ("policy", "lidar", "memory")
"""Columns that tell cells of a room apart."""

_COUNTS = ("trials", "successes", "collisions", "timeouts")
"""Counts that are added up over rooms."""

Groups = Sequence[tuple[str, ...]]
"""Names of policies that differ in the seed alone, together."""


@dataclass(frozen=True)
class Cell:
    """One cell of the comparison.

    Attributes:
        policy: Name of the policy.
        lidar: Name or label of the laser.
        room: Name of the room.
        memory: ``reactive`` or ``map``.
    """

    policy: str
    lidar: str
    room: str
    memory: str

    @classmethod
    def of(cls, attempt: RoomAttempt) -> "Cell":
        """Return the cell of an attempt."""
        detail = attempt.detail
        return cls(attempt.contender, detail.lidar, attempt.scenario, detail.memory)


class RoomTable(NamedTuple):
    """Rows of an evaluation in rooms.

    Attributes:
        rows: Rows of the cells.
        pooled: Rows of policies together that differ in the seed alone.
        differences: Rows of the differences in success between them, all rooms together.
    """

    rows: list[Row]
    pooled: list[Row]
    differences: list[Row]


def task_score(outcome: Outcome, steps: int) -> float:
    """Return the score of a task: 1 - 0.001 T after T control steps, or -1 (equation 5)."""
    return 1 - _STEP_COST * steps if outcome is Outcome.GOAL else -1.0


def room_table(attempts: Sequence[RoomAttempt], groups: Groups) -> RoomTable:
    """Return the table of attempts whose oracles are known.

    Args:
        attempts: Attempts, by cell.
        groups: Names of policies that belong together, in the order of their rows.
    """
    pooled = Table(_conditions, _TASKS, (*_CELL_COLUMNS, _together, _movers))
    return RoomTable(
        Table(Cell.of, _TASKS, (*_CELL_COLUMNS, _movers)).rows(attempts),
        [
            row
            for names in groups
            if len(names) > 1
            for row in pooled.rows(_of_policies(attempts, names))
        ],
        _differences(groups).differences(attempts),
    )


def over_rooms(rows: Sequence[Mapping[str, Any]]) -> list[Row]:
    """Return the counts of all rooms together, a row a policy, laser and memory.

    Args:
        rows: Rows of cells, as ``room_table`` has them.

    Returns:
        Rows with the counts of the ends and the success rate with its interval (Wilson), which
        takes all drives for independent.
    """
    totals: dict[tuple[str, ...], Counter[str]] = {}
    for row in rows:
        cell = tuple(row[key] for key in _OVER_ROOMS)
        totals.setdefault(cell, Counter()).update({key: row[key] for key in _COUNTS})
    return [
        dict(zip(_OVER_ROOMS, cell, strict=True)) | counts | _rate(counts)
        for cell, counts in totals.items()
    ]


def _rate(counts: Mapping[str, int]) -> Row:
    """Return the success rate of counts with its interval."""
    reached, trials = counts["successes"], counts["trials"]
    low, high = wilson_interval(reached, trials)
    return {"success_rate": reached / trials, "wilson_low": low, "wilson_high": high}


def _of_policies(attempts: Sequence[RoomAttempt], names: Collection[str]) -> list[RoomAttempt]:
    """Return the attempts of some policies."""
    return [attempt for attempt in attempts if attempt.contender in names]


def _differences(groups: Groups) -> Table:
    """Return the table of what differs between groups of policies, by laser and memory."""
    numbers = {name: k for k, names in enumerate(groups) for name in names}

    def within(attempt: RoomAttempt) -> Hashable:
        return attempt.detail.lidar, attempt.detail.memory

    def by(attempt: RoomAttempt) -> Hashable:
        return within(attempt), numbers[attempt.contender]

    gain = share_difference("difference", method=group_difference)
    return Table(by, _TASKS, (), (_compared, gain), within)


def _compared(base: Sample, other: Sample) -> Row:
    """Return what is compared, and both rates."""
    detail = other.attempts[0].detail
    first, second = pair(base, other, is_success)
    return {
        "policy": ", ".join(map(str, other.repeats)),
        "against": ", ".join(map(str, base.repeats)),
        "lidar": detail.lidar,
        "memory": detail.memory,
        "tasks": first.shape[1],
        "success_rate": float(second.mean()),
        "success_rate_against": float(first.mean()),
    }


_TASKS = Design(cluster=by_task, repeat=by_contender)
"""What is hard for one policy is hard for the others: tasks count."""


def _conditions(attempt: RoomAttempt) -> Hashable:
    """Return laser, room and memory."""
    return attempt.detail.lidar, attempt.scenario, attempt.detail.memory


def _head(sample: Sample) -> Row:
    """Return the cell, and how many of its drives reached their goals."""
    cell = Cell.of(sample.attempts[0])
    return {
        **{"policy": cell.policy, "lidar": cell.lidar, "room": cell.room, "memory": cell.memory},
        **{"trials": len(sample.attempts), "successes": sample.count(is_success)},
    }


def _together(sample: Sample) -> Row:
    """Return the names of the policies of a row, and their number."""
    names = list(map(str, sample.repeats))
    return {"policy": ", ".join(names), "policies": len(names)}


def _movers(sample: Sample) -> Row:
    """Return the number of a room's movers, which the oracle leaves out."""
    # The oracle drives as if nothing moved: where something does, the ratio to it is no bound.
    return {"movers": len(make_room(sample.attempts[0].scenario).movers)}


def _score(sample: Sample) -> Row:
    """Return the sum of the scores of the tasks."""
    return {"score": sum(task_score(each.outcome, each.detail.steps) for each in sample.attempts)}


def _steps_to_oracle(attempt: Attempt[Any]) -> float | None:
    """Return the ratio of the steps to those of the oracle; None without a goal or an oracle."""
    # Failures have no steps to compare: a ratio that counted them would reward early collisions.
    fewest = attempt.detail.oracle_steps
    if fewest is None or not attempt.is_success:
        return None
    return float(attempt.detail.steps / max(fewest, 1))


_CELL_COLUMNS: Sequence[Column] = (
    _head,
    counts(collisions=Outcome.COLLISION),
    hit_counts,
    counts(timeouts=Outcome.TIMEOUT),
    share(ends="wilson"),
    _score,
    average("steps_to_oracle", _steps_to_oracle),
    average("spl", lambda attempt: attempt.spl),
    average("mean_steps", lambda attempt: attempt.detail.steps),
)
