"""Rooms: walls, boxes and posts in the plane, for robots that drive by a planar laser."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, model_validator
from scipy.ndimage import label

from terrain.kernel import kernel
from worlds.rooms.edges import edge_clearances, outline_edges
from worlds.rooms.mover_motion import Solids
from worlds.rooms.movers import MoverPlan
from worlds.world import Start

_BORDER = 0.2
"""Thickness of the boundary walls, outside of the free space [m]."""

CELL = 0.05
"""Edge of the cells that free space is divided into [m]."""

_KEPT = 64
"""Number of rooms whose clearances are remembered."""

_KEPT_FREE = 1024
"""Number of rooms whose free cells are remembered: those of a pool to train in, 0.1 MB each."""

_DRAWS = 50
"""Number of draws after which a random task is taken as it comes."""


class RoomPlan(BaseModel):
    """A room as data.

    Attributes:
        about: One line for people.
        half: Half of the free space's extent in x and in y; the origin is its middle [m].
        boxes: Boxes: x_min, y_min, x_max, y_max [m].
        walls: Thin walls from x, y to x, y, along x or along y [m].
        wall_thickness: Thickness of thin walls [m].
        circles: Circles: x, y, radius [m].
        posts: Centres of posts [m].
        post_radius: Radius of posts [m] (assumption).
        outlines: Obstacles with slanted edges: corners of each, counter-clockwise [m]. What runs
            clockwise inside of another is a hole, what has two corners a wall without thickness.
        start: Start of the fixed tasks: x, y [m], yaw [rad].
        goals: Goals of the fixed tasks [m].
        tour: True if each goal starts where the last one was, False if all start at ``start``.
        scatter: Largest deviation of random starts from those of the fixed tasks, x, y [m] and yaw
            [rad]: random tasks are the fixed ones with such starts. None draws them anywhere.
        movers: Obstacles that move, or come and go.
        judges: True if the room is for judging alone: nothing is trained, chosen or tuned in it.
        origin: Place of the room's middle in the world that the room was made from [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    about: str
    half: tuple[float, float]
    boxes: tuple[tuple[float, float, float, float], ...] = ()
    walls: tuple[tuple[float, float, float, float], ...] = ()
    wall_thickness: float = Field(default=0.03, gt=0)
    circles: tuple[tuple[float, float, float], ...] = ()
    posts: tuple[tuple[float, float], ...] = ()
    post_radius: float = Field(default=0.1, gt=0)
    outlines: tuple[tuple[tuple[FiniteFloat, FiniteFloat], ...], ...] = ()
    start: tuple[float, float, float] = (0.0, 0.0, 0.0)
    goals: tuple[tuple[float, float], ...] = ()
    tour: bool = False
    scatter: tuple[float, float, float] | None = None
    movers: tuple[MoverPlan, ...] = ()
    judges: bool = False
    origin: tuple[float, float] = (0.0, 0.0)

    @model_validator(mode="after")
    def _check_scatter(self) -> Self:
        """Refuse starts around those of no task."""
        if self.scatter is not None and not self.goals:
            raise ValueError("goals: expected some where scatter is given, got none")
        return self


@dataclass(frozen=True)
class RoomTask:
    """A start and a goal.

    Attributes:
        start: Pose at the start.
        goal: Goal in the room [m].
    """

    start: Start
    goal: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Room:
    """A room as arrays.

    Attributes:
        name: Name.
        half: Half of the free space's extent in x and in y [m].
        boxes: x_min, y_min, x_max, y_max of each box, the four boundary walls first [m], float64,
            shape (n, 4).
        circles: x, y and radius of each circle [m], float64, shape (m, 3).
        tasks: Fixed tasks.
        scatter: Largest deviation of random starts from those of the fixed tasks, or None.
        movers: Obstacles that move, or come and go.
        judges: True if the room is for judging alone.
        edges: Slanted edges of closed outlines: x, y at the begin and at the end, what is solid to
            the left [m], float64, shape (e, 4).
    """

    name: str
    half: tuple[float, float]
    boxes: NDArray[np.float64]
    circles: NDArray[np.float64]
    tasks: tuple[RoomTask, ...] = ()
    scatter: tuple[float, float, float] | None = None
    movers: tuple[MoverPlan, ...] = ()
    judges: bool = False
    edges: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 4)))

    @property
    def appearances(self) -> tuple[MoverPlan, ...]:
        """Obstacles that appear when the robot comes near."""
        return tuple(one for one in self.movers if one.when_within is not None)

    @property
    def solids(self) -> Solids:
        """What stands, as movers meet it."""
        return Solids(self.boxes, self.circles, self.edges)

    @property
    def has_people(self) -> bool:
        """True if some of its movers are people."""
        return any(plan.is_person for plan in self.movers)

    @classmethod
    def of(cls, name: str, plan: RoomPlan) -> "Room":
        """Return the room of a plan.

        Raises:
            ValueError: If a thin wall runs neither along x nor along y, or an outline is none.
        """
        boxes = [*_boundary(plan.half), *plan.boxes, *_thin_walls(name, plan)]
        posts = [(x, y, plan.post_radius) for x, y in plan.posts]
        circles = np.array([*plan.circles, *posts], dtype=np.float64).reshape(-1, 3)
        return cls(
            name=name,
            half=plan.half,
            boxes=np.array(boxes, dtype=np.float64),
            circles=circles,
            tasks=_tasks(plan),
            scatter=plan.scatter,
            movers=plan.movers,
            judges=plan.judges,
            edges=outline_edges(plan.outlines),
        )

    def clearance(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distance of points to the nearest obstacle, negative inside [m], shape (k,).

        Args:
            points: Points in the room [m], shape (k, 2).
        """
        places = np.ascontiguousarray(points, dtype=np.float64)
        distances = _clearances(places, self.boxes, self.circles)
        if len(self.edges):
            edge_clearances(places, self.edges, distances)
        return distances


@kernel
def _clearances(
    points: NDArray[np.float64], boxes: NDArray[np.float64], circles: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the distance of points to the nearest box or circle, negative inside [m], (k,)."""
    distances = np.full(len(points), np.inf)
    for k in range(len(points)):
        x, y = points[k]
        for b in range(len(boxes)):
            out_x = max(boxes[b, 0] - x, x - boxes[b, 2])
            out_y = max(boxes[b, 1] - y, y - boxes[b, 3])
            # Beside a box one of both is the distance; off a corner both are; inside the larger.
            if out_x > 0.0 and out_y > 0.0:
                distances[k] = min(distances[k], np.hypot(out_x, out_y))
            else:
                distances[k] = min(distances[k], max(out_x, out_y))
        for c in range(len(circles)):
            away = np.hypot(x - circles[c, 0], y - circles[c, 1]) - circles[c, 2]
            distances[k] = min(distances[k], away)
    return distances


def cell_edges(room: Room) -> list[NDArray[np.float64]]:
    """Return x of the middles of a room's columns of cells and y of those of its rows [m]."""
    return [np.arange(-half + CELL / 2, half, CELL) for half in room.half]


def cell_middles(room: Room) -> NDArray[np.float64]:
    """Return the middle of each cell of a room's free space [m], shape (n, m, 2)."""
    return np.stack(np.meshgrid(*cell_edges(room), indexing="ij"), axis=-1)


@lru_cache(maxsize=_KEPT)
def cell_clearances(room: Room) -> NDArray[np.float64]:
    """Return the clearance of the middle of each cell of a room [m], shape (n, m)."""
    middles = cell_middles(room)
    return room.clearance(middles.reshape(-1, 2)).reshape(middles.shape[:2])


@lru_cache(maxsize=_KEPT_FREE)
def _free_cells(room: Room, radius: float, clearance: float) -> NDArray[np.int16]:
    """Return the indices of the cells of ``free_places``, int16, shape (k, 2)."""
    distances = cell_clearances(room)
    regions, count = label(distances > radius)
    if not count:
        raise ValueError(f"room {room.name}: expected room for a disc of {radius} m, got none")
    largest = np.bincount(regions.ravel())[1:].argmax() + 1
    cells = np.argwhere((regions == largest) & (distances > max(clearance, radius)))
    if not len(cells):
        raise ValueError(f"room {room.name}: expected places {clearance} m clear, got none")
    return cells.astype(np.int16)


def free_places(room: Room, radius: float, clearance: float) -> NDArray[np.float64]:
    """Return places of the largest region in which a disc can drive from any to any.

    Args:
        room: Room.
        radius: Radius of the disc [m].
        clearance: Smallest distance of the places themselves from obstacles [m].

    Returns:
        Centres of cells of 5 cm [m], float64, shape (k, 2).

    Raises:
        ValueError: If there is none.
    """
    cells = _free_cells(room, radius, clearance)
    return np.stack(
        [edges[index] for edges, index in zip(cell_edges(room), cells.T, strict=True)], 1
    )


def random_place(
    room: Room, rng: np.random.Generator, radius: float, clearance: float
) -> tuple[float, float]:
    """Return one of ``free_places``, whose arguments it takes, at random [m]."""
    cells = _free_cells(room, radius, clearance)
    i, j = cells[rng.integers(len(cells))]
    columns, rows = cell_edges(room)
    return float(columns[i]), float(rows[j])


def random_task(
    room: Room,
    rng: np.random.Generator,
    radius: float,
    clearance: float = 0.3,
    min_distance: float = 1.0,
) -> RoomTask:
    """Return a random start and goal that a disc can reach from there.

    A room with a scatter has its fixed tasks alone, each with a random start around its own.

    Args:
        room: Room.
        rng: Source of randomness.
        radius: Radius of the disc [m].
        clearance: Smallest distance of start and goal from obstacles [m].
        min_distance: Smallest distance from start to goal [m]; where no place is as far, the goal
            is the farthest of all.
    """
    if room.scatter is not None:
        return _scattered_task(room, rng, max(clearance, radius), room.scatter)
    x, y = random_place(room, rng, radius, clearance)
    yaw = float(rng.uniform(-np.pi, np.pi))
    # Most draws are far enough; few are needed in any room.
    for _ in range(_DRAWS):
        goal = random_place(room, rng, radius, clearance)
        if np.hypot(goal[0] - x, goal[1] - y) >= min_distance:
            break
    else:
        places = free_places(room, radius, clearance)
        far = places[np.hypot(*(places - (x, y)).T).argmax()]
        goal = (float(far[0]), float(far[1]))
    return RoomTask(Start(x, y, yaw), goal)


def _scattered_task(
    room: Room, rng: np.random.Generator, clearance: float, scatter: tuple[float, float, float]
) -> RoomTask:
    """Return a fixed task of a room with a random start around its own, as clear as asked for."""
    task = room.tasks[rng.integers(len(room.tasks))]
    middle = np.array([task.start.x, task.start.y, task.start.yaw])
    for _ in range(_DRAWS):
        x, y, yaw = (middle + rng.uniform(-1.0, 1.0, 3) * scatter).tolist()
        if room.clearance(np.array([[x, y]]))[0] > clearance:
            return RoomTask(Start(x, y, yaw), task.goal)
    return task


def _boundary(half: tuple[float, float]) -> list[tuple[float, float, float, float]]:
    """Return the four walls around a free space."""
    x, y = half
    return [
        (-x - _BORDER, -y - _BORDER, -x, y + _BORDER),
        (x, -y - _BORDER, x + _BORDER, y + _BORDER),
        (-x, -y - _BORDER, x, -y),
        (-x, y, x, y + _BORDER),
    ]


def _thin_walls(name: str, plan: RoomPlan) -> list[tuple[float, float, float, float]]:
    """Return thin walls as boxes."""
    half, boxes = plan.wall_thickness / 2, []
    for x0, y0, x1, y1 in plan.walls:
        if x0 != x1 and y0 != y1:
            raise ValueError(
                f"room {name}: expected walls along x or y, got ({x0}, {y0}) to ({x1}, {y1})"
            )
        wide, high = (half, 0.0) if x0 == x1 else (0.0, half)
        x_low, x_high, y_low, y_high = min(x0, x1), max(x0, x1), min(y0, y1), max(y0, y1)
        boxes.append((x_low - wide, y_low - high, x_high + wide, y_high + high))
    return boxes


def _tasks(plan: RoomPlan) -> tuple[RoomTask, ...]:
    """Return the fixed tasks of a plan."""
    tasks, start = [], Start(*plan.start)
    for goal in plan.goals:
        tasks.append(RoomTask(start, goal))
        if plan.tour:
            x, y = start.x, start.y
            start = Start(*goal, float(np.arctan2(goal[1] - y, goal[0] - x)))
    return tuple(tasks)
