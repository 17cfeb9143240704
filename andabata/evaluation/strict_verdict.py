"""Strict verdict on a drive: did the body's outline keep off forbidden ground and solid objects.

The first verdict counts collisions as physics has them, and the ground below the body's middle.
This one looks at the whole outline, in each control step: a drive that brushes past a trunk, or has
two wheels on a slope that is too steep, is no strict success.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.machine.robot import RobotModel
from andabata.machine.sensor_readings import VehicleState
from andabata.machine.solid_contact import Solids, build_solids, find_near, meet_box
from andabata.machine.vectors import Axes, Vector, added, axes_of, dot
from terrain.classes import TRAITS
from terrain.kernel import borrowing_kernel
from worlds.traversability_map import Reason
from worlds.world import World

MAX_FORBIDDEN_TIME = 0.5
"""Longest time for which the outline may be on forbidden ground [s]."""

MIN_SOLID_DISTANCE = 0.05
"""Least distance of the body from solid objects [m]."""

SOLID_REACH = 0.5
"""Distance up to which solid objects are looked for [m]."""

_SPACING = 0.1
"""Largest distance between points of the outline [m]: a cell of the true map."""

_SKIRT = 0.05
"""Height above the wheels' ground from which on objects count [m]: a wheel climbs what is lower."""

_MOST_NEAR = 64
"""Largest number of objects near the body at once."""


@dataclass(frozen=True)
class StrictMeasures:
    """Measures of a drive to one goal that the strict verdict rests on.

    Attributes:
        forbidden_time: Time with a point of the outline on forbidden ground [s].
        solid_distance: Smallest distance of the body from a solid object [m], negative where they
            overlap; None if none was nearer than ``SOLID_REACH``.
    """

    forbidden_time: float = 0.0
    solid_distance: float | None = None

    @property
    def failure(self) -> str:
        """What failed; empty for nothing."""
        failures = []
        if self.forbidden_time > MAX_FORBIDDEN_TIME + 1e-9:
            failures.append("forbidden ground")
        if self.solid_distance is not None and self.solid_distance < MIN_SOLID_DISTANCE:
            failures.append("solid")
        return " and ".join(failures)


class Outline(NamedTuple):
    """The robot's rectangle in the true world, as compiled code takes it.

    Attributes:
        points: Points of the outline in ``base_footprint`` [m], shape (k, 2).
        half: Half of the edges of the body's box [m].
        bottom: Height of the box's bottom above ``base_footprint`` [m].
        reach: Distance along each axis at which objects are looked for [m].
        forbidden: 1 in each cell of the true map that is forbidden, uint8, shape (n, m).
        x_min: Least map x of the true map [m].
        y_min: Least map y of the true map [m].
        cell: Edge of its cells [m].
        solids: Solid objects.
    """

    points: NDArray[np.float64]
    half: Vector
    bottom: float
    reach: float
    forbidden: NDArray[np.uint8]
    x_min: float
    y_min: float
    cell: float
    solids: Solids


class StrictVerdict:
    """Watches the outline of one robot in one world, drive by drive."""

    def __init__(self, world: World, robot: RobotModel) -> None:
        """Prepare for a world.

        Args:
            world: World with its true map.
            robot: Size of the body.
        """
        self._outline = outline_of(world, robot)
        self._near = np.empty(_MOST_NEAR, dtype=np.int64)
        self.begin()

    def begin(self) -> None:
        """Begin with another drive."""
        self._forbidden_time, self._distance = 0.0, math.inf

    def update(self, state: VehicleState, time: float) -> None:
        """Take in a true state that lasts for a time [s]."""
        pose = state.pose
        is_forbidden, distance = look_around(
            pose.position, pose.quaternion, self._outline, self._near
        )
        self._forbidden_time += time * is_forbidden
        self._distance = min(self._distance, distance)

    @property
    def measures(self) -> StrictMeasures:
        """Measures of the drive so far."""
        is_far = self._distance > SOLID_REACH
        return StrictMeasures(self._forbidden_time, None if is_far else self._distance)


def outline_of(world: World, robot: RobotModel) -> Outline:
    """Return the rectangle of a robot in a world.

    The strip along the border is not forbidden here: nothing tells a robot where it begins, and who
    leaves the world has failed anyway.
    """
    truth = world.truth
    forbidden = (truth.reason != Reason.FREE) & (truth.reason != Reason.BORDER)
    objects = tuple(each for each in world.objects if not TRAITS[each.semantic].traversable)
    half = robot.length / 2, robot.width / 2, (robot.height - _SKIRT) / 2
    return Outline(
        points=_rectangle(robot.length, robot.width),
        half=half,
        bottom=_SKIRT,
        reach=math.hypot(*half) + SOLID_REACH,
        forbidden=forbidden.astype(np.uint8),
        x_min=truth.x_min,
        y_min=truth.y_min,
        cell=truth.cell,
        solids=build_solids(replace(world, objects=objects)),
    )


def _rectangle(length: float, width: float) -> NDArray[np.float64]:
    """Return points all along a rectangle around the origin [m], shape (k, 2)."""
    x, y = (
        np.linspace(-size / 2, size / 2, math.ceil(size / _SPACING) + 1) for size in (length, width)
    )
    sides = [(a, b) for a in x for b in (y[0], y[-1])]
    ends = [(a, b) for a in (x[0], x[-1]) for b in y[1:-1]]
    return np.array(sides + ends)


@borrowing_kernel
def look_around(
    position: NDArray[np.float64],
    quaternion: NDArray[np.float64],
    outline: Outline,
    near: NDArray[np.int64],
) -> tuple[bool, float]:
    """Return whether the outline is on forbidden ground, and how near the body is to a solid.

    Args:
        position: Position of ``base_footprint`` in the map [m], shape (3,).
        quaternion: Orientation x, y, z, w, shape (4,).
        outline: The robot's rectangle and the world.
        near: Memory for indices of objects, written in place.

    Returns:
        True if a point of the outline is on forbidden ground, and the distance of the nearest
        object [m]: a lower bound, infinite for none near.
    """
    axes = axes_of(quaternion)
    n, m = outline.forbidden.shape
    is_forbidden = False
    for k in range(len(outline.points)):
        ahead, left = outline.points[k, 0], outline.points[k, 1]
        x = position[0] + ahead * axes.forward[0] + left * axes.left[0]
        y = position[1] + ahead * axes.forward[1] + left * axes.left[1]
        i = int(np.floor((x - outline.x_min) / outline.cell))
        j = int(np.floor((y - outline.y_min) / outline.cell))
        if 0 <= i < n and 0 <= j < m and outline.forbidden[i, j] > 0:
            is_forbidden = True
            break
    foot = position[0], position[1], position[2]
    centre = added(foot, axes.up, outline.bottom + outline.half[2])
    distance, solids = np.inf, outline.solids
    for k in range(find_near(centre, outline.reach, solids, near)):
        # What a wheel climbs, and what is above the robot, is as near as it likes.
        if is_beside(centre, axes, outline.half[2], solids, near[k]):
            gap = meet_box(centre, axes, outline.half, solids, near[k]).gap
            distance = min(distance, gap)
    return is_forbidden, distance


@borrowing_kernel
def is_beside(centre: Vector, axes: Axes, half_height: float, solids: Solids, k: int) -> bool:
    """Return True if an object is neither below nor above a box, by the box's own axis.

    Args:
        centre: Middle of the box in the map [m].
        axes: Axes of the box.
        half_height: Half of its height [m].
        solids: Solid objects.
        k: Index of the object.
    """
    low, high = np.inf, -np.inf
    for v in range(solids.starts[k], solids.starts[k + 1]):
        vertex = solids.vertices[v, 0], solids.vertices[v, 1], solids.vertices[v, 2]
        height = dot(added(vertex, centre, -1.0), axes.up)
        low, high = min(low, height), max(high, height)
    return high > -half_height and low < half_height
