"""Oracle of planar tasks: the fewest control steps from a pose to a goal, by A* over x, y, heading.

The oracle knows the room. It drives with speeds none, half and full, and five yaw rates, through
the same compiled motion and contact as the robots of ``RoomBatch``, so that its twists can be
driven as they are. Of the poses in one bin of 5 cm and 7.5 degrees the most promising is kept
(hybrid A*, Dolgov et al. 2010): the result is a real drive, one or two steps in a hundred above the
fewest.
"""

from dataclasses import dataclass
from functools import lru_cache
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.tasks.movers import Movers
from andabata.tasks.room_batch import DiscRobotConfig, room_arrays
from andabata.tasks.room_kernel import YAW, Rooms, V, W, X, Y, drive
from terrain.kernel import kernel
from worlds.geodesic import GeodesicField, geodesic_field, length_from
from worlds.rooms import Room, RoomTask

_CELL = 0.05
"""Edge of a bin [m]."""

_HEADINGS = 48
"""Number of bins of heading: 7.5 degrees each."""

_SLACK = 0.02
"""Length by which the way to the goal is taken as shorter [m]: a little more than that of a
geodesic's grid, so that rounding up to whole steps does not overestimate them."""


class UnreachableGoalError(ValueError):
    """Raised if a disc has no way from start to goal, or does not fit at the start."""


@dataclass(frozen=True)
class OracleDrive:
    """The drive of an oracle.

    Attributes:
        steps: Number of control steps until the robot is at the goal.
        length: Length of the shortest way of the disc to the goal [m], without heading or speed;
            it ends where the robot is at the goal.
        twists: Speed [m/s] and yaw rate [rad/s] of each step, shape (steps, 2).
        poses: x, y [m] and yaw [rad] before each step and at the end, shape (steps + 1, 3).
    """

    steps: int
    length: float
    twists: NDArray[np.float64]
    poses: NDArray[np.float64]


class _Robot(NamedTuple):
    """Numbers of the robot.

    Attributes:
        twists: Speeds and yaw rates to choose from, shape (a, 2).
        radius: Radius [m].
        period: Control period [s].
        substeps: Number of checks for contact in a period.
        stride: Longest way of a control step [m].
        goal_radius: Distance below which the goal is reached [m].
    """

    twists: NDArray[np.float64]
    radius: float
    period: float
    substeps: int
    stride: float
    goal_radius: float


class _Bins(NamedTuple):
    """What is known of each bin of x, y and heading.

    Attributes:
        corner: Begin of the first bin [m], shape (2,).
        columns: Number of bins along y.
        costs: Steps so far and to go of the best pose, infinite for none, shape (b,).
        poses: Its x, y [m], yaw [rad], shape (b, 3).
        steps: Number of its steps, shape (b,).
        parents: Bin that it was driven to from, -1 for the start, shape (b,).
        choices: Index of the twist that led there, shape (b,).
        closed: True once the pose was driven on from, shape (b,).
    """

    corner: NDArray[np.float64]
    columns: int
    costs: NDArray[np.float64]
    poses: NDArray[np.float64]
    steps: NDArray[np.int64]
    parents: NDArray[np.int64]
    choices: NDArray[np.int64]
    closed: NDArray[np.bool_]


def oracle_drive(
    room: Room,
    task: RoomTask,
    robot: DiscRobotConfig | None = None,
    goal_radius: float = 0.3,
) -> OracleDrive:
    """Return a drive to the goal in (almost) the fewest control steps.

    Args:
        room: Room; what appears or moves does not count.
        task: Start and goal.
        robot: Robot; None for SPN's.
        goal_radius: Distance below which the goal is reached, after a step [m].

    Raises:
        UnreachableGoalError: If the robot is in contact at the start, or there is no way.
    """
    robot = robot or DiscRobotConfig()
    start = np.array([task.start.x, task.start.y, task.start.yaw])
    length = shortest_length(room, task, robot.radius, goal_radius)
    numbers = _numbers(robot, goal_radius)
    bins = _make_bins(room)
    goal = np.array(task.goal, dtype=np.float64)
    field = _field(room, task.goal, robot.radius)
    last = _search(start, goal, field, room_arrays([room]), numbers, bins)
    if last < 0:
        raise _unreachable(room, task, robot.radius)
    trail = [last]
    while bins.parents[trail[-1]] >= 0:
        trail.append(int(bins.parents[trail[-1]]))
    trail.reverse()
    return OracleDrive(
        steps=len(trail) - 1,
        length=length,
        twists=numbers.twists[bins.choices[trail[1:]]],
        poses=bins.poses[trail],
    )


def shortest_length(room: Room, task: RoomTask, radius: float, goal_radius: float = 0.3) -> float:
    """Return the length of a disc's shortest way from the start to the goal's edge [m].

    Args:
        room: Room; what appears or moves does not count.
        task: Start and goal.
        radius: Radius of the disc [m].
        goal_radius: Distance from the goal at which the way ends [m].

    Raises:
        UnreachableGoalError: If the disc does not fit at the start, or there is no way.
    """
    place = np.array([[task.start.x, task.start.y]])
    whole = length_from(_field(room, task.goal, radius), *place[0])
    if room.clearance(place)[0] < radius or not np.isfinite(whole):
        raise _unreachable(room, task, radius)
    return max(float(whole) - goal_radius, 0.0)


@lru_cache(maxsize=8)
def _field(room: Room, goal: tuple[float, float], radius: float) -> GeodesicField:
    """Return the lengths of the ways to a goal; tasks often share theirs."""
    return geodesic_field(room, goal, radius)


def _unreachable(room: Room, task: RoomTask, radius: float) -> UnreachableGoalError:
    """Return the error of a task that cannot be driven."""
    return UnreachableGoalError(
        f"room {room.name}: expected a way for a disc of {radius} m from ({task.start.x:.2f}, "
        f"{task.start.y:.2f}) to ({task.goal[0]:.2f}, {task.goal[1]:.2f}), got none; move them "
        f"apart from obstacles, or take a smaller disc"
    )


def _numbers(robot: DiscRobotConfig, goal_radius: float) -> _Robot:
    """Return the numbers of a robot."""
    speeds = robot.max_speed * np.array([1.0, 0.5, 0.0])
    rates = robot.max_yaw_rate * np.array([0.0, -0.5, 0.5, -1.0, 1.0])
    twists = [(v, w) for v in speeds for w in rates if v or w]
    return _Robot(
        twists=np.array(twists),
        radius=robot.radius,
        period=robot.period,
        substeps=robot.substeps,
        stride=robot.max_speed * robot.period,
        goal_radius=goal_radius,
    )


def _make_bins(room: Room) -> _Bins:
    """Return empty bins over a room."""
    rows, columns = (int(np.ceil(2 * half / _CELL)) + 1 for half in room.half)
    count = rows * columns * _HEADINGS
    # Pages that are never written to are never allocated: most bins are not seen.
    return _Bins(
        corner=-np.array(room.half),
        columns=columns,
        costs=np.full(count, np.inf),
        poses=np.empty((count, 3)),
        steps=np.empty(count, dtype=np.int64),
        parents=np.empty(count, dtype=np.int64),
        choices=np.empty(count, dtype=np.int64),
        closed=np.zeros(count, dtype=np.bool_),
    )


@kernel
def _bin_of(bins: _Bins, x: float, y: float, yaw: float) -> int:
    """Return the bin of a pose; headings are centred on multiples of their width."""
    i = int((x - bins.corner[0]) / _CELL)
    j = int((y - bins.corner[1]) / _CELL)
    h = int(np.rint(yaw * (_HEADINGS / (2 * np.pi)))) % _HEADINGS
    return (i * bins.columns + j) * _HEADINGS + h


@kernel
def _steps_to_go(field: GeodesicField, robot: _Robot, x: float, y: float) -> float:
    """Return the fewest steps that the way to the goal can take, whatever the heading."""
    length = length_from(field, x, y) - robot.goal_radius - _SLACK
    return max(np.ceil(length / robot.stride), 0.0)


@kernel
def _search(
    start: NDArray[np.float64],
    goal: NDArray[np.float64],
    field: GeodesicField,
    rooms: Rooms,
    robot: _Robot,
    bins: _Bins,
) -> int:
    """Return the bin of a pose at the goal, -1 if there is none."""
    count = len(robot.twists)
    chosen, places = np.ones(count, dtype=np.bool_), np.zeros(count, dtype=np.int64)
    nobody = Movers(np.zeros((count, 0, 2)), np.zeros((count, 0, 2)), np.zeros((count, 0)))
    fan, contacts = np.empty((count, 5)), np.zeros(count, dtype=np.bool_)
    begin = _bin_of(bins, start[0], start[1], start[2])
    bins.poses[begin], bins.steps[begin], bins.parents[begin] = start, 0, -1
    bins.costs[begin] = _steps_to_go(field, robot, start[0], start[1])
    # Of equal sums of steps the pose nearest to the goal goes first.
    queue = [(bins.costs[begin], length_from(field, start[0], start[1]), begin)]
    while len(queue):
        cost, _, here = heappop(queue)
        if bins.closed[here] or cost > bins.costs[here]:
            continue
        bins.closed[here] = True
        pose = bins.poses[here]
        if np.hypot(goal[0] - pose[0], goal[1] - pose[1]) < robot.goal_radius:
            return here
        for a in range(count):
            fan[a, X], fan[a, Y], fan[a, YAW] = pose
            fan[a, V], fan[a, W] = robot.twists[a]
        # All twists are driven from here, by the motion and contact of the simulator itself.
        drive(
            fan,
            chosen,
            places,
            rooms,
            nobody,
            robot.radius,
            robot.period,
            robot.substeps,
            contacts,
        )
        for a in range(count):
            if contacts[a]:
                continue
            there = _bin_of(bins, fan[a, X], fan[a, Y], fan[a, YAW])
            if bins.closed[there]:
                continue
            steps = bins.steps[here] + 1
            cost = steps + _steps_to_go(field, robot, fan[a, X], fan[a, Y])
            if cost < bins.costs[there]:
                bins.costs[there], bins.steps[there] = cost, steps
                bins.poses[there] = fan[a, :V]
                bins.parents[there], bins.choices[there] = here, a
                length = length_from(field, fan[a, X], fan[a, Y])
                heappush(queue, (cost, length, there))
    return -1
