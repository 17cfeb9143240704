"""Table of an evaluation in rooms: a row a cell, and one for all policies of a cell."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple, Self

import numpy as np

from andabata.evaluation.room_drives import RoomDrive
from andabata.evaluation.statistics import (
    clustered_interval,
    group_difference,
    wilson_interval,
)
from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.terminations import Outcome

Row = dict[str, Any]

OracleTask = tuple[int, float] | None
"""Fewest steps of a task, and the length of its shortest way [m], whatever moves there; None where
no way is wide enough for the robot."""

_STEP_COST = 0.001
"""Loss of a task's score with each control step (equation 5)."""


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


@dataclass(frozen=True)
class CellResult:
    """Measures of a cell's drives, in the order of its tasks.

    Attributes:
        cell: Policy, laser, room and memory.
        outcomes: How each drive ended.
        steps: Number of control steps of each.
        lengths: Length of each path [m].
        contacts: Contact of each robot at the end; see ``RoomDrive``.
    """

    cell: Cell
    outcomes: tuple[Outcome, ...]
    steps: tuple[int, ...]
    lengths: tuple[float, ...]
    contacts: tuple[Contact, ...]

    @classmethod
    def of(cls, cell: Cell, drives: Sequence[RoomDrive]) -> Self:
        """Return the measures of drives."""
        return cls(
            cell,
            tuple(drive.outcome for drive in drives),
            tuple(drive.steps for drive in drives),
            tuple(drive.length for drive in drives),
            tuple(drive.contact for drive in drives),
        )

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Self:
        """Return the measures of ``to_json``."""
        outcomes = tuple(Outcome(outcome) for outcome in data["outcomes"])
        cell = Cell(**data["cell"])
        contacts = tuple(Contact(contact) for contact in data["contacts"])
        return cls(cell, outcomes, tuple(data["steps"]), tuple(data["lengths"]), contacts)

    def to_json(self) -> dict[str, Any]:
        """Return the measures, ready for JSON."""
        return asdict(self)

    @property
    def successes(self) -> tuple[bool, ...]:
        """True for each drive that reached its goal."""
        return tuple(outcome is Outcome.GOAL for outcome in self.outcomes)


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


def cell_row(result: CellResult, oracle: Sequence[OracleTask]) -> Row:
    """Return the table's row of a cell.

    Args:
        result: Measures of its drives.
        oracle: Fewest steps and shortest way of each task.
    """
    return _row([result], oracle, wilson_interval(sum(result.successes), len(oracle)))


def pooled_row(results: Sequence[CellResult], oracle: Sequence[OracleTask]) -> Row:
    """Return the row of several policies in cells that differ in the policy alone.

    Args:
        results: Measures of each policy's drives.
        oracle: Fewest steps and shortest way of each task.
    """
    successes = np.array([result.successes for result in results])
    return _row(results, oracle, clustered_interval(successes)) | {
        "policy": ", ".join(result.cell.policy for result in results),
        "policies": len(results),
    }


def difference_row(
    first: Sequence[Sequence[CellResult]], second: Sequence[Sequence[CellResult]]
) -> Row:
    """Return the row of the difference in success of two groups of policies on the same tasks.

    Args:
        first: Measures of each policy of the first group, one for each room.
        second: Measures of the second group, with the same laser, memory and rooms.
    """
    one, other = (
        np.array([[arrived for result in rooms for arrived in result.successes] for rooms in group])
        for group in (first, second)
    )
    gain, cell = group_difference(one, other), second[0][0].cell
    return {
        "policy": _together(second),
        "against": _together(first),
        "lidar": cell.lidar,
        "memory": cell.memory,
        "tasks": one.shape[1],
        "success_rate": float(other.mean()),
        "success_rate_against": float(one.mean()),
        "difference": gain.mean,
        "difference_low": gain.low,
        "difference_high": gain.high,
    }


def _together(group: Sequence[Sequence[CellResult]]) -> str:
    """Return the names of a group's policies."""
    return ", ".join(rooms[0].cell.policy for rooms in group)


def _row(
    results: Sequence[CellResult], oracle: Sequence[OracleTask], interval: tuple[float, float]
) -> Row:
    """Return the row of one policy or of several.

    ``collisions`` are all; ``hit_by_mover`` and ``hit_at_rest`` are those among them that a mover
    caused while the robot drove and while it stood.
    """
    ends = [outcome for result in results for outcome in result.outcomes]
    contacts = [contact for result in results for contact in result.contacts]
    steps = [count for result in results for count in result.steps]
    ratios, spl = [], []
    for result in results:
        for arrived, count, length, best in zip(
            result.successes, result.steps, result.lengths, oracle, strict=True
        ):
            if best is None:
                spl.append(0.0)
                continue
            fewest, way = best
            spl.append(way / max(length, way) if arrived and length > 0 else float(arrived))
            if arrived:
                ratios.append(count / max(fewest, 1))
    reached, cell = ends.count(Outcome.GOAL), results[0].cell
    return {
        "policy": cell.policy,
        "lidar": cell.lidar,
        "room": cell.room,
        "memory": cell.memory,
        "trials": len(ends),
        "successes": reached,
        "collisions": ends.count(Outcome.COLLISION),
        "hit_by_mover": contacts.count(Contact.HIT),
        "hit_at_rest": contacts.count(Contact.HIT_AT_REST),
        "timeouts": ends.count(Outcome.TIMEOUT),
        "success_rate": reached / len(ends),
        "wilson_low": interval[0],
        "wilson_high": interval[1],
        "score": sum(map(task_score, ends, steps)),
        "steps_to_oracle": float(np.mean(ratios)) if ratios else None,
        "spl": float(np.mean(spl)),
        "mean_steps": float(np.mean(steps)),
    }
