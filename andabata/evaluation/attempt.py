"""Result of a drive to one goal, of every kind of evaluation."""

import math
from dataclasses import dataclass, field, fields
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from andabata.machine.planar.mover_contact import Contact
from andabata.tasks.terminations import Outcome

Detail = TypeVar("Detail")

CONTACTS = {contact.label: contact for contact in Contact}
"""Contacts by their labels."""

NO_PATH = np.zeros((0, 3))
"""Path of an attempt that was read from a record that keeps none."""


@dataclass(frozen=True)
class Attempt(Generic[Detail]):
    """A drive to one goal.

    Attributes:
        contender: Name of what was compared: a controller or a policy; empty outside of
            comparisons.
        scenario: Name of the world or room.
        repetition: Number of the drive among those of the same contender and scenario, from 0.
        outcome: How it ended.
        contact: Contact of the body at the end: what it touched, and who drove into whom.
        time: Duration by the clock of the rules [s].
        distance: Distance driven [m]; NaN where a record does not keep it.
        shortest: Length of the shortest safe path [m]; NaN where none is known.
        detail: Further measures of the kind of evaluation.
        path: Positions or poses, one a control step, float64, shape (k, 3): x, y, z [m], or x, y
            [m] and yaw [rad] on flat ground; without rows where a record does not keep them. Two
            attempts are equal whatever their paths.

    Attempts of the same unknown length are equal.
    """

    contender: str
    scenario: str
    repetition: int
    outcome: Outcome
    contact: Contact
    time: float
    distance: float
    shortest: float
    detail: Detail
    path: NDArray[np.float64] = field(default_factory=lambda: NO_PATH, compare=False, repr=False)

    def __eq__(self, other: object) -> bool:
        """Return True if all but the paths is equal."""
        if not isinstance(other, Attempt):
            return NotImplemented
        return _compared(self) == _compared(other)

    @property
    def is_success(self) -> bool:
        """True if the goal was reached."""
        return self.outcome is Outcome.GOAL

    @property
    def spl(self) -> float:
        """Success weighted by path length (Anderson et al. 2018), from 0 to 1.

        It is 0 where no shortest path is known.
        """
        if not self.is_success or math.isnan(self.shortest):
            return 0.0
        # The safe path keeps a clearance, which a drive may undercut; and of two lengths of nothing
        # there is no ratio.
        return 1.0 if self.distance <= self.shortest else self.shortest / self.distance


def _compared(attempt: Attempt[Any]) -> tuple[object, ...]:
    """Return the fields of an attempt that make it equal to another.

    Tuples take ``math.nan`` for equal to itself, as dataclasses did before Python 3.13.
    """
    return tuple(getattr(attempt, each.name) for each in fields(attempt) if each.compare)
