"""Law that sees: turns to the free direction nearest to the goal's, by the present windows alone.

It is the plain reactive navigator that a policy without a memory has to beat. Laws that see nothing
flatter a policy. It remembers nothing. Its constants were chosen in rooms to develop in
(``clutter-7303`` to ``clutter-7305``).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from rl.goal_laws import Law

WINDOWS, RANGES = "windows", "ranges"
"""Names of the term with the nearest of each window of bearing: as 1 / d [1/m], or as d [m]."""

_MARGIN = 0.05
"""Room that is kept on each side of the body [m]."""

_LOOK = 1.0
"""Distance up to which a direction has to be free [m]; nearer goals need no more."""

_KEEPING = 0.9
"""Weight of the turn to a direction beside its angle from the goal: without it the side on which an
obstacle is passed changes from scan to scan. From 1 on it would not turn to the goal in the open.
"""

_REACTION = 0.5
"""Time in which the free way straight ahead may be driven [s]."""


@dataclass(frozen=True)
class SeeingPolicy(Law):
    """Turns to the free direction nearest to the goal's, as fast as the way ahead is free.

    A direction is free where a strip of the body's width is, up to the goal or ``_LOOK``. Where
    none is, it turns to the one that is free for longest. Turn and speed are those of
    ``HeadingPolicy`` for that direction, and what lies ahead limits the speed.

    Attributes:
        weights: ``bearings``, the middle of each window [rad], shape (w,); ``radius``, that of the
            robot [m], shape (1,).
        terms: Names of the terms that it reads: None, the windows and the goal.
    """

    terms: tuple[str, ...] | None = None

    architecture = "sees"
    constants: ClassVar[frozenset[str]] = frozenset(("bearings", "radius"))

    def __post_init__(self) -> None:
        """Check that there are windows, one for each bearing."""
        super().__post_init__()
        windows = self.weights["bearings"].shape
        shapes = [term.shape for term in self.observations.terms if term.name in (WINDOWS, RANGES)]
        if shapes != [windows]:
            raise ValueError(
                f"observations: expected a term {WINDOWS!r} or {RANGES!r} of shape {windows}, got "
                f"shapes {shapes}; give each window its bearing"
            )

    def _wanted(self, observations: NDArray[np.float32]) -> Mapping[str, NDArray[np.float64]]:
        """Return actions by name, before they are limited, shape (n,) each."""
        x, y = self._goals(observations)
        goal, ranges = np.arctan2(y, x), self._ranges(observations)
        seen = self.weights["bearings"].astype(np.float64)
        # The goal's own direction, straight ahead, and those of the windows.
        straight = np.zeros_like(goal)
        directions = np.column_stack([goal, straight, np.tile(seen, (len(goal), 1))])
        free = self._free_ways(directions, ranges, seen)
        needed = np.minimum(np.hypot(x, y), _LOOK)[:, None]
        off = np.abs(_wrapped(directions - goal[:, None])) + _KEEPING * np.abs(directions)
        # Any free direction is better than one that is not, of which the longest is the best.
        cost = np.where(free >= needed, off, 4.0 * np.pi - free)
        best = directions[np.arange(len(goal)), cost.argmin(axis=1)]
        return self._towards(best, free[:, 1] / _REACTION)

    def _ranges(self, observations: NDArray[np.float32]) -> NDArray[np.float64]:
        """Return the nearest distance of each window [m], shape (n, w)."""
        names = {term.name for term in self.observations.terms}
        name = WINDOWS if WINDOWS in names else RANGES
        nearest = observations[:, self.observations.slice_of(name)].astype(np.float64)
        return nearest if name == RANGES else 1.0 / np.maximum(nearest, 1e-6)

    def _free_ways(
        self,
        directions: NDArray[np.float64],
        ranges: NDArray[np.float64],
        seen: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """Return how far the body can go in directions before it touches what windows show [m].

        Args:
            directions: Bearings [rad], shape (n, d).
            ranges: Nearest distance of each window [m], shape (n, w).
            seen: Middle of each window [rad], shape (w,).
        """
        half = float(self.weights["radius"][0]) + _MARGIN
        off = directions[:, :, None] - seen
        along = ranges[:, None] * np.cos(off)
        room = half**2 - (ranges[:, None] * np.sin(off)) ** 2
        touching = along - np.sqrt(np.maximum(room, 0.0))
        blocked = (room > 0.0) & (along > 0.0)
        return np.where(blocked, np.maximum(touching, 0.0), np.inf).min(axis=2)


def _wrapped(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return angles from -pi to pi [rad]."""
    return (angles + np.pi) % (2.0 * np.pi) - np.pi
