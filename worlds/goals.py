"""Starts and goals on truly traversable ground, with clearance and a safe path between them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from worlds.traversability_map import Reason, TraversabilityMap
from worlds.world import Start, Task

START_CLEARANCE = 1.3
"""Clearance of every start and goal [m]: enough to turn at full speed from any heading."""

PATH_CLEARANCE = 0.5
"""Clearance of the safe path of each task [m]."""


_WORDS = {
    Reason.SOLID: "a solid object",
    Reason.VEGETATION: "high vegetation",
    Reason.SLOPE: "a slope that is too steep",
    Reason.STEP: "a step that is too high",
    Reason.BORDER: "the border of the world",
    Reason.WATER: "water",
    Reason.LOW: "a low object",
}
"""What stands at a forbidden place, in an error."""


class UnsolvableWorldError(ValueError):
    """Raised if no tasks with safe paths are found in a world."""


class GoalError(ValueError):
    """Raised for a given goal to which no safe path leads."""


class FreeSpace:
    """The possible starts and goals of a world, by connected region.

    Attributes:
        truth: True map of the world.
    """

    def __init__(self, truth: TraversabilityMap) -> None:
        """Label the regions of a map that are connected by safe paths.

        Args:
            truth: True map of the world.
        """
        self.truth = truth
        self._regions, _ = label(truth.clearance >= PATH_CLEARANCE)
        self._candidates = np.argwhere((truth.clearance >= START_CLEARANCE) & (self._regions > 0))
        self._region_of = self._regions[tuple(self._candidates.T)]

    def sample(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Return a random place with clearance [m], shape (2,).

        Raises:
            UnsolvableWorldError: If there is none.
        """
        if not len(self._candidates):
            raise UnsolvableWorldError(
                f"world: expected a place with {START_CLEARANCE} m of clearance, got none; "
                f"lower the difficulty"
            )
        return self._centre(self._candidates[rng.integers(len(self._candidates))])

    def _centre(self, cell: NDArray[np.intp]) -> NDArray[np.float64]:
        """Return the centre of a cell [m]."""
        origin = np.array([self.truth.x_min, self.truth.y_min])
        return origin + (cell + 0.5) * self.truth.cell

    def sample_near(
        self,
        place: NDArray[np.float64],
        near: float,
        far: float,
        rng: np.random.Generator,
    ) -> NDArray[np.float64] | None:
        """Return a random place with clearance in the same region [m], shape (2,), or None.

        Args:
            place: Map coordinates [m], shape (2,).
            near: Least distance from ``place`` [m].
            far: Largest distance from ``place`` [m].
            rng: Source of randomness.
        """
        origin = np.array([self.truth.x_min, self.truth.y_min])
        # The cells are sorted by x: a binary search leaves those within reach.
        column, reach = (place[0] - origin[0]) / self.truth.cell, far / self.truth.cell + 1
        first, last = np.searchsorted(self._candidates[:, 0], [column - reach, column + reach])
        cells = self._candidates[first:last]
        distances = np.hypot(*(origin + (cells + 0.5) * self.truth.cell - place).T)
        region = self._regions[tuple(((place - origin) / self.truth.cell).astype(int))]
        fits = (distances >= near) & (distances <= far) & (self._region_of[first:last] == region)
        choices = np.flatnonzero(fits)
        return self._centre(cells[rng.choice(choices)]) if len(choices) else None

    def check(self, start: Start, goal: tuple[float, float]) -> None:
        """Raise an error if no safe path leads from a start to a goal.

        Args:
            start: Initial pose of the robot.
            goal: Map coordinates (x, y) [m].

        Raises:
            GoalError: If the goal is outside the world, forbidden, or in another region; its text
                gives the nearest place that would do.
        """
        origin = np.array([self.truth.x_min, self.truth.y_min])
        region = self._regions[_cell_of(self.truth, np.array([start.x, start.y]))]
        low, high = origin, origin + self.truth.cell * np.array(self._regions.shape)
        place = np.array(goal, dtype=np.float64)
        if (place < low).any() or (place > high).any():
            (x0, y0), (x1, y1) = low, high
            wrong = f"a place outside x {x0:g} to {x1:g}, y {y0:g} to {y1:g}"
        elif self._regions[_cell_of(self.truth, place)] == region != 0:
            return
        elif self.truth.forbidden_at(*place):
            wrong = _WORDS[Reason(int(self.truth.reason_at(*place)))]
        elif self.truth.clearance_at(*place) < PATH_CLEARANCE:
            wrong = f"a place less than {PATH_CLEARANCE} m from forbidden ground"
        else:
            wrong = "a place that no safe path leads to"
        cells = np.argwhere((self._regions == region) & (self._regions > 0))
        hint = "there is none in this world"
        if len(cells):
            centres = origin + (cells + 0.5) * self.truth.cell
            near = centres[np.argmin(np.hypot(*(centres - place).T))]
            hint = f"the nearest that would do is {near[0]:.2f},{near[1]:.2f}"
        raise GoalError(
            f"goal: expected a place that a safe path leads to, got {wrong} at "
            f"{place[0]:g},{place[1]:g}; {hint}"
        )


def _cell_of(truth: TraversabilityMap, place: NDArray[np.float64]) -> tuple[int, int]:
    """Return the indices of the cell of a place [m]; beyond the border, those of the border."""
    index = (place - [truth.x_min, truth.y_min]) / truth.cell
    i, j = np.clip(index, 0, np.array(truth.reason.shape) - 1).astype(int)
    return int(i), int(j)


def task_to(truth: TraversabilityMap, start: Start, goals: Sequence[tuple[float, float]]) -> Task:
    """Return a task with given goals.

    Args:
        truth: True map of the world.
        start: Initial pose of the robot.
        goals: Map coordinates (x, y) of each goal [m], in order.

    Raises:
        GoalError: If no safe path leads to one of them.
    """
    space = FreeSpace(truth)
    for goal in goals:
        space.check(start, goal)
    return Task(start, tuple(goals))


def sample_task(
    space: FreeSpace,
    goals: int,
    reach: tuple[float, float],
    longest: float,
    rng: np.random.Generator,
    heading: float | None = None,
) -> Task | None:
    """Return a start and goals with a safe path from each to the next, or None.

    Args:
        space: Possible starts and goals.
        goals: Number of goals.
        reach: Straight distance from goal to goal, least and largest [m].
        longest: Largest length of the safe path from goal to goal [m], so that it can be driven
            within the time limit.
        rng: Source of randomness.
        heading: Start heading [rad]; None for the direction of the first goal plus up to 45 degrees
            to either side.
    """
    here = start = space.sample(rng)
    places: list[tuple[float, float]] = []
    for _ in range(goals):
        goal = space.sample_near(here, *reach, rng)
        path = None if goal is None else space.truth.shortest_path(here, goal, PATH_CLEARANCE)
        if goal is None or path is None or _length(path) > longest:
            return None
        places.append((float(goal[0]), float(goal[1])))
        here = goal
    if heading is None:
        to_goal = np.arctan2(places[0][1] - start[1], places[0][0] - start[0])
        heading = float(to_goal + rng.uniform(-np.pi / 4, np.pi / 4))
    return Task(Start(float(start[0]), float(start[1]), heading), tuple(places))


def _length(path: NDArray[np.float64]) -> float:
    """Return a path's length [m]."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def sample_tasks(
    truth: TraversabilityMap,
    count: int,
    goals: int,
    reach: tuple[float, float],
    longest: float,
    rng: np.random.Generator,
    heading: float | None = None,
) -> tuple[Task, ...]:
    """Return several tasks; see ``sample_task``.

    Args:
        truth: True map of the world.
        count: Number of tasks.
        goals: Number of goals of each task.
        reach: Straight distance from goal to goal, least and largest [m].
        longest: Largest length of the safe path from goal to goal [m].
        rng: Source of randomness.
        heading: Start heading [rad]; None for about the direction of the first goal.

    Raises:
        UnsolvableWorldError: If they are not found in 30 attempts per task.
    """
    space = FreeSpace(truth)
    tasks: list[Task] = []
    for _ in range(30 * count):
        task = sample_task(space, goals, reach, longest, rng, heading)
        if task is not None:
            tasks.append(task)
        if len(tasks) == count:
            return tuple(tasks)
    raise UnsolvableWorldError(
        f"world: expected {count} solvable tasks, got {len(tasks)}; lower the difficulty"
    )
