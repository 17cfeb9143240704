"""Starts and goals: on truly traversable ground, with room, and with a safe path between them."""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from worlds.truth import TraversabilityMap
from worlds.world import Start, Task

START_ROOM = 1.3
"""Clearance of every start and goal [m]: room to turn at full speed, whatever the heading."""

PATH_ROOM = 0.5
"""Clearance of the safe path that is proven to exist [m]."""


class UnsolvableWorldError(ValueError):
    """A world in which no tasks with safe paths could be found."""


class Places:
    """Places of a world from which a robot can set off, and which of them hang together."""

    def __init__(self, truth: TraversabilityMap) -> None:
        """Find the free places of a map and the regions that a safe path can cross."""
        self.truth = truth
        self._regions, _ = label(truth.clearance >= PATH_ROOM)
        self._roomy = np.argwhere((truth.clearance >= START_ROOM) & (self._regions > 0))
        self._region_of = self._regions[tuple(self._roomy.T)]

    def draw(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Return a random roomy place [m], shape (2,).

        Raises:
            UnsolvableWorldError: If there is none.
        """
        if not len(self._roomy):
            raise UnsolvableWorldError(
                f"world: expected a place with {START_ROOM} m of room, got none"
            )
        return self._place(self._roomy[rng.integers(len(self._roomy))])

    def _place(self, cell: NDArray[np.intp]) -> NDArray[np.float64]:
        """Return the centre of a cell [m]."""
        origin = np.array([self.truth.x_min, self.truth.y_min])
        return origin + (cell + 0.5) * self.truth.cell

    def nearby(
        self,
        place: NDArray[np.float64],
        near: float,
        far: float,
        rng: np.random.Generator,
    ) -> NDArray[np.float64] | None:
        """Return a random roomy place of the same region, ``near`` to ``far`` [m] away, or None."""
        origin = np.array([self.truth.x_min, self.truth.y_min])
        # The cells are in order of x: only those within reach are looked at.
        column, reach = (place[0] - origin[0]) / self.truth.cell, far / self.truth.cell + 1
        first, last = np.searchsorted(self._roomy[:, 0], [column - reach, column + reach])
        cells = self._roomy[first:last]
        gaps = np.hypot(*(origin + (cells + 0.5) * self.truth.cell - place).T)
        region = self._regions[tuple(((place - origin) / self.truth.cell).astype(int))]
        fits = (gaps >= near) & (gaps <= far) & (self._region_of[first:last] == region)
        choices = np.flatnonzero(fits)
        return self._place(cells[rng.choice(choices)]) if len(choices) else None


def draw_task(
    places: Places,
    goals: int,
    reach: tuple[float, float],
    longest: float,
    rng: np.random.Generator,
    heading: float | None = None,
) -> Task | None:
    """Return a start and goals in a row, each leg proven by a search on the true map, or None.

    Args:
        places: Free places.
        goals: Number of goals.
        reach: Straight distance from goal to goal, least and most [m].
        longest: Most length of the safe path from goal to goal [m], so that it can be driven before
            the time limit.
        rng: Source of randomness.
        heading: Start heading [rad]; None faces the first goal, give or take 45 degrees.
    """
    here = start = places.draw(rng)
    visited: list[tuple[float, float]] = []
    for _ in range(goals):
        goal = places.nearby(here, *reach, rng)
        path = None if goal is None else places.truth.shortest_path(here, goal, PATH_ROOM)
        if goal is None or path is None or _length(path) > longest:
            return None
        visited.append((float(goal[0]), float(goal[1])))
        here = goal
    if heading is None:
        to_goal = np.arctan2(visited[0][1] - start[1], visited[0][0] - start[0])
        heading = float(to_goal + rng.uniform(-np.pi / 4, np.pi / 4))
    return Task(Start(float(start[0]), float(start[1]), heading), tuple(visited))


def _length(path: NDArray[np.float64]) -> float:
    """Return a path's length [m]."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def draw_tasks(
    truth: TraversabilityMap,
    count: int,
    goals: int,
    reach: tuple[float, float],
    longest: float,
    rng: np.random.Generator,
    heading: float | None = None,
) -> tuple[Task, ...]:
    """Return ``count`` tasks; see ``draw_task``.

    Raises:
        UnsolvableWorldError: If they are not found in 30 attempts a task.
    """
    places = Places(truth)
    tasks: list[Task] = []
    for _ in range(30 * count):
        task = draw_task(places, goals, reach, longest, rng, heading)
        if task is not None:
            tasks.append(task)
        if len(tasks) == count:
            return tuple(tasks)
    raise UnsolvableWorldError(f"world: expected {count} solvable tasks, got {len(tasks)}")
