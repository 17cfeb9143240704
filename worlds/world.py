"""A world: ground, objects, tasks, and the true map of where a robot may drive."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from terrain.heightfield import Heightfield
from terrain.objects import SceneObject
from worlds.rooms.movers import Mover
from worlds.traversability_map import TraversabilityMap

Geofence = tuple[float, float, float, float]
"""Rectangle that a robot must not leave: ``x_min, y_min, x_max, y_max`` in the map [m]."""


@dataclass(frozen=True)
class Start:
    """The initial pose of a robot.

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
    """A start and the goals to reach in order.

    Attributes:
        start: Initial pose of the robot.
        goals: Map coordinates (x, y) of each goal [m].
    """

    start: Start
    goals: tuple[tuple[float, float], ...]


class MapDatum(BaseModel):
    """Place on Earth of the origin of the map, whose axes point east, north and up there.

    Attributes:
        latitude_deg: Latitude, WGS 84, north positive.
        longitude_deg: Longitude, WGS 84, east positive.
        altitude: Altitude of the map's z = 0 [m], in the vertical datum of the elevation model.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    latitude_deg: float = Field(ge=-90, le=90)
    longitude_deg: float = Field(ge=-180, le=180)
    altitude: float


@dataclass(frozen=True)
class World:
    """A complete world, made from a preset and a seed; equal inputs give equal bytes.

    Attributes:
        name: Name of the preset.
        seed: Seed within the preset's own family.
        difficulty: Difficulty from 0 to 1.
        ground: The heightfield.
        surface: ``SemanticClass`` of each grid cell (GROUND, PATH or WATER), uint8, shape
            (nx - 1, ny - 1).
        objects: Objects on the ground.
        tasks: Starts and goals, each with a safe path that was found when the world was made.
        truth: True map of where the robot may drive; walkers are not in it.
        movers: Walkers, as they are when a robot is put down.
        base: The ground without roughness that wheels roll over, of which the true map is built;
            None if it has none.
        cover: Height of the low plants and leaves on each grid cell, in which beams stop and which
            wheels do not feel [cm], uint8, shape (nx - 1, ny - 1); None for bare ground.
        datum: Place of the origin on Earth; None where the world is nowhere on it.
        wind: Share of the cells of leaves that wind moves, see ``worlds.rays.wind``.
    """

    name: str
    seed: int
    difficulty: float
    ground: Heightfield
    surface: NDArray[np.uint8]
    objects: tuple[SceneObject, ...]
    tasks: tuple[Task, ...]
    truth: TraversabilityMap
    movers: tuple[Mover, ...] = ()
    base: Heightfield | None = None
    cover: NDArray[np.uint8] | None = None
    datum: MapDatum | None = None
    wind: float = 0.0


def choose_task(tasks: tuple[Task, ...], number: int | np.random.Generator) -> Task:
    """Return one of a world's tasks.

    Args:
        tasks: Tasks of the world.
        number: Index of the task, or a source of randomness to draw it from.

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


def jittered(
    start: Start, rng: np.random.Generator, shift: float = 0.2, turn: float = 0.3
) -> Start:
    """Return a start with a uniformly distributed offset.

    Args:
        start: Start without offset.
        rng: Source of randomness.
        shift: Largest offset of x and of y [m].
        turn: Largest offset of the heading [rad].
    """
    dx, dy, angle = rng.uniform(-1, 1, 3)
    return Start(start.x + shift * dx, start.y + shift * dy, start.yaw + turn * angle)
