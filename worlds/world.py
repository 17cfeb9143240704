"""A world: ground, objects, tasks to solve in it, and the truth about where the robot may go."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from worlds.truth import TraversabilityMap


@dataclass(frozen=True)
class Start:
    """Where a robot is put down.

    Attributes:
        x: Map x [m].
        y: Map y [m].
        yaw: Heading [rad], 0 = east, counter-clockwise.
    """

    x: float
    y: float
    yaw: float


@dataclass(frozen=True)
class Task:
    """One start and the goals to visit in order.

    Attributes:
        start: Where the robot is put down.
        goals: Map coordinates (x, y) [m], one pair a goal.
    """

    start: Start
    goals: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class World:
    """A complete scene, made from a preset and a seed; equal inputs give equal bytes.

    Attributes:
        name: Preset's name.
        seed: Seed within the preset's own family.
        difficulty: From 0 to 1.
        ground: The heightfield.
        surface: ``SemanticClass`` value (GROUND or PATH) of each grid square, uint8, shape (nx - 1,
            ny - 1).
        objects: What stands on it.
        tasks: Starts and goals; each has a safe path, proven when the world was made.
        truth: Where the robot may go.
    """

    name: str
    seed: int
    difficulty: float
    ground: Heightfield
    surface: NDArray[np.uint8]
    objects: tuple[SceneObject, ...]
    tasks: tuple[Task, ...]
    truth: TraversabilityMap


def choose_task(tasks: tuple[Task, ...], number: int | np.random.Generator) -> Task:
    """Return one of a world's tasks by its number, or a random one.

    Raises:
        ValueError: If there is no such task, or it has no goal.
    """
    if isinstance(number, np.random.Generator):
        number = int(number.integers(max(len(tasks), 1)))
    if not 0 <= number < len(tasks) or not tasks[number].goals:
        raise ValueError(
            f"world: expected task {number} with a goal, got {len(tasks)} tasks; add goals"
        )
    return tasks[number]


Geofence = tuple[float, float, float, float]
"""``x_min, y_min, x_max, y_max`` in the map [m]."""


def jittered(
    start: Start, rng: np.random.Generator, shift: float = 0.2, turn: float = 0.3
) -> Start:
    """Return a start moved by up to ``shift`` [m] in x and y and turned by up to ``turn`` [rad]."""
    dx, dy, angle = rng.uniform(-1, 1, 3)
    return Start(start.x + shift * dx, start.y + shift * dy, start.yaw + turn * angle)
