"""Rooms: walls, boxes and posts in the plane, for robots that drive by a planar laser."""

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, FiniteFloat
from scipy.ndimage import label

from worlds.room_edges import edge_clearances, outline_edges
from worlds.world import Start

_BORDER = 0.2
"""Thickness of the boundary walls, outside of the free space [m]."""

CELL = 0.05
"""Edge of the cells that free space is divided into [m]."""

_PAIRS = 1_000_000
"""Number of pairs of points and obstacles whose distances are found at once."""

_KEPT = 64
"""Number of rooms whose cells are remembered."""


class Appearance(BaseModel):
    """An obstacle that appears when the robot comes near.

    Attributes:
        when_within: Distance of the robot from the obstacle's edge at which it appears [m].
        circle: Centre and radius [m].
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    when_within: float = Field(gt=0)
    circle: tuple[float, float, float]

    def is_due(self, x: float, y: float) -> bool:
        """Return True if the obstacle appears for a robot at a place [m]."""
        return (
            math.hypot(x - self.circle[0], y - self.circle[1]) - self.circle[2] < self.when_within
        )


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
        appearances: Obstacles that appear.
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
    appearances: tuple[Appearance, ...] = ()
    judges: bool = False
    origin: tuple[float, float] = (0.0, 0.0)


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
        appearances: Obstacles that appear.
        judges: True if the room is for judging alone.
        edges: Slanted edges of closed outlines: x, y at the begin and at the end, what is solid to
            the left [m], float64, shape (e, 4).
    """

    name: str
    half: tuple[float, float]
    boxes: NDArray[np.float64]
    circles: NDArray[np.float64]
    tasks: tuple[RoomTask, ...] = ()
    appearances: tuple[Appearance, ...] = ()
    judges: bool = False
    edges: NDArray[np.float64] = field(default_factory=lambda: np.zeros((0, 4)))

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
            appearances=plan.appearances,
            judges=plan.judges,
            edges=outline_edges(plan.outlines),
        )

    def clearance(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distance of points to the nearest obstacle, negative inside [m], shape (k,).

        Args:
            points: Points in the room [m], shape (k, 2).
        """
        # In parts: all points of a large room beside all of its obstacles would be gigabytes.
        count = max(1, _PAIRS // max(len(self.boxes), len(self.circles)))
        parts = [self._clearance(points[k : k + count]) for k in range(0, len(points), count)]
        return np.concatenate([np.zeros(0), *parts])

    def _clearance(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the clearance of a few points [m], shape (k,)."""
        x, y = points[:, :1], points[:, 1:2]
        low, high = self.boxes[:, :2], self.boxes[:, 2:]
        out_x = np.maximum(low[:, 0] - x, x - high[:, 0])
        out_y = np.maximum(low[:, 1] - y, y - high[:, 1])
        outside = np.hypot(np.maximum(out_x, 0.0), np.maximum(out_y, 0.0))
        inside = np.minimum(np.maximum(out_x, out_y), 0.0)
        nearest = (outside + inside).min(axis=1)
        if len(self.circles):
            centres, radii = self.circles[:, :2], self.circles[:, 2]
            away = np.hypot(x - centres[:, 0], y - centres[:, 1]) - radii
            nearest = np.minimum(nearest, away.min(axis=1))
        if len(self.edges):
            edge_clearances(np.asarray(points, dtype=np.float64), self.edges, nearest)
        return nearest


def cell_middles(room: Room) -> NDArray[np.float64]:
    """Return the middle of each cell of a room's free space [m], shape (n, m, 2)."""
    edges = [np.arange(-half + CELL / 2, half, CELL) for half in room.half]
    return np.stack(np.meshgrid(*edges, indexing="ij"), axis=-1)


@lru_cache(maxsize=_KEPT)
def cell_clearances(room: Room) -> NDArray[np.float64]:
    """Return the clearance of the middle of each cell of a room [m], shape (n, m)."""
    middles = cell_middles(room)
    return room.clearance(middles.reshape(-1, 2)).reshape(middles.shape[:2])


@lru_cache(maxsize=_KEPT)
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
    places, distances = cell_middles(room), cell_clearances(room)
    regions, count = label(distances > radius)
    if not count:
        raise ValueError(f"room {room.name}: expected room for a disc of {radius} m, got none")
    largest = np.bincount(regions.ravel())[1:].argmax() + 1
    found = places[(regions == largest) & (distances > max(clearance, radius))]
    if not len(found):
        raise ValueError(f"room {room.name}: expected places {clearance} m clear, got none")
    return found


def random_task(
    room: Room,
    rng: np.random.Generator,
    radius: float,
    clearance: float = 0.3,
    min_distance: float = 1.0,
) -> RoomTask:
    """Return a random start and goal that a disc can reach from there.

    Args:
        room: Room.
        rng: Source of randomness.
        radius: Radius of the disc [m].
        clearance: Smallest distance of start and goal from obstacles [m].
        min_distance: Smallest distance from start to goal [m]; where no place is as far, the goal
            is the farthest of all.
    """
    places = free_places(room, radius, clearance)
    start = places[rng.integers(len(places))]
    yaw = float(rng.uniform(-np.pi, np.pi))
    # Most draws are far enough; few are needed in any room.
    for _ in range(50):
        goal = places[rng.integers(len(places))]
        if np.hypot(*(goal - start)) >= min_distance:
            break
    else:
        goal = places[np.hypot(*(places - start).T).argmax()]
    return RoomTask(Start(float(start[0]), float(start[1]), yaw), (float(goal[0]), float(goal[1])))


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
    half, found = plan.wall_thickness / 2, []
    for x0, y0, x1, y1 in plan.walls:
        if x0 != x1 and y0 != y1:
            raise ValueError(
                f"room {name}: expected walls along x or y, got ({x0}, {y0}) to ({x1}, {y1})"
            )
        wide, high = (half, 0.0) if x0 == x1 else (0.0, half)
        x_low, x_high, y_low, y_high = min(x0, x1), max(x0, x1), min(y0, y1), max(y0, y1)
        found.append((x_low - wide, y_low - high, x_high + wide, y_high + high))
    return found


def _tasks(plan: RoomPlan) -> tuple[RoomTask, ...]:
    """Return the fixed tasks of a plan."""
    found, start = [], Start(*plan.start)
    for goal in plan.goals:
        found.append(RoomTask(start, goal))
        if plan.tour:
            x, y = start.x, start.y
            start = Start(*goal, float(np.arctan2(goal[1] - y, goal[0] - x)))
    return tuple(found)
