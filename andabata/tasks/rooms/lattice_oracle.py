"""Fewest steps to a goal in a room: a search over (x, y, heading) with the room known.

A* over control steps (Hart, Nilsson, Raphael 1968) with one exact pose kept in each bin of position
and heading (hybrid-state A*, Dolgov et al. 2008). A disc's shortest way at full speed bounds what
remains from below. Durations and lengths of drives are compared with these.
"""

import math
from functools import cache, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.tasks.rooms.batch import DiscRobotConfig, room_arrays
from andabata.tasks.rooms.kernel import YAW, Rooms, X, clearance, drive
from terrain.kernel import inlined_kernel, kernel
from worlds.rooms.geodesics import HALF_DIAGONAL, Ways, remaining, ways_to
from worlds.rooms.mover_motion import Movers
from worlds.rooms.room import CELL, Room, RoomTask

_WIDTH = np.radians(7.5)
"""Largest width of a bin of heading [rad]; the largest edge of one of position is a room's cell."""

_SPEEDS = (0.0, 0.5, 1.0)
"""Speeds of the moves, as shares of the largest; the last is tried first."""

_RATES = (-1.0, 1.0, -0.5, 0.5, 0.0)
"""Yaw rates of the moves, as shares of the largest; the last is tried first."""

_MARGIN = 1e-9
"""Distance by which plans keep out of contact and come into the goal [m], against rounding."""

_LONGEST = 10_000
"""Number of steps beyond which no plan is looked for."""

_GAIN = 0.2
"""Steps that a pose must save to take a bin from another: 0 finds plans 1 % shorter, but takes nine
times as long."""

_TURN = 2 * np.pi


class _Moves(NamedTuple):
    """Moves of one control period.

    Attributes:
        twists: Speed [m/s] and yaw rate [rad/s] of each, shape (a, 2).
        places: x and y at each check for contact, in the frame of the pose before [m], shape
            (a, s, 2).
        turns: Change of heading of each [rad], shape (a,).
        edge: Edge of the bins of position [m].
        headings: Number of bins of heading.
    """

    twists: NDArray[np.float64]
    places: NDArray[np.float64]
    turns: NDArray[np.float64]
    edge: float
    headings: int


class _Query(NamedTuple):
    """What is looked for, and where.

    Attributes:
        goal: Goal [m], shape (2,).
        goal_radius: Distance from the goal within which it counts as reached [m].
        radius: Radius of the robot [m].
        stride: Longest way of a step [m].
        moves: Moves.
        ways: Shortest ways to the goal.
        rooms: The room.
        movers: No moving obstacles, as ``clearance`` takes them.
    """

    goal: NDArray[np.float64]
    goal_radius: float
    radius: float
    stride: float
    moves: _Moves
    ways: Ways
    rooms: Rooms
    movers: Movers


def oracle_steps(room: Room, task: RoomTask, robot: DiscRobotConfig, goal_radius: float) -> int:
    """Return the fewest control steps from a start to a goal, about 1 % above the optimum.

    Args:
        room: Room, without obstacles that appear.
        task: Start and goal.
        robot: Body and its limits.
        goal_radius: Distance from the goal below which it is reached [m].

    Raises:
        ValueError: If the start is in contact, or no way leads to the goal.
    """
    return len(oracle_plan(room, task, robot, goal_radius))


def oracle_plan(
    room: Room, task: RoomTask, robot: DiscRobotConfig, goal_radius: float
) -> NDArray[np.float64]:
    """Return the twists that ``oracle_steps`` counts.

    Driven in ``RoomBatch`` one after the other, they reach the goal without contact.

    Args:
        room: Room, without obstacles that appear.
        task: Start and goal.
        robot: Body and its limits.
        goal_radius: Distance from the goal below which it is reached [m].

    Returns:
        Speed [m/s] and yaw rate [rad/s] of each step, shape (t, 2).

    Raises:
        ValueError: If the start is in contact, or no way leads to the goal.
    """
    _remaining_length(room, task, robot.radius, goal_radius)
    query = _Query(
        goal=np.array(task.goal),
        goal_radius=goal_radius,
        radius=robot.radius,
        stride=robot.max_speed * robot.period,
        moves=_moves(robot),
        ways=ways_to(room, task.goal, goal_radius, robot.radius),
        rooms=_arrays(room),
        movers=Movers.none(1),
    )
    is_found, plan = _search(np.array([task.start.x, task.start.y, task.start.yaw]), query)
    if not is_found:
        raise _unreachable(room, task, "no way leads there")
    return query.moves.twists[plan]


def geodesic_length(room: Room, task: RoomTask, radius: float, goal_radius: float) -> float:
    """Return the length of a disc's shortest way to a goal, whatever its heading [m].

    It is mostly below the exact length, around corners by up to 3 %.

    It is the length that SPL compares paths with (Anderson et al., arXiv 1807.06757).

    Args:
        room: Room, without obstacles that appear.
        task: Start and goal.
        radius: Radius of the disc [m].
        goal_radius: Distance from the goal below which it is reached [m].

    Raises:
        ValueError: If the start is in contact, or no way leads to the goal.
    """
    return max(_remaining_length(room, task, radius, goal_radius) - goal_radius, 0.0)


def _remaining_length(room: Room, task: RoomTask, radius: float, goal_radius: float) -> float:
    """Return the length of the shortest way from a start to the goal's middle [m].

    Raises:
        ValueError: If the start is in contact, or no way leads to the goal.
    """
    start = np.array([task.start.x, task.start.y])
    if (np.abs(start) >= room.half).any() or room.clearance(start[None])[0] < radius:
        raise _unreachable(room, task, "the start is in contact")
    ways = ways_to(room, task.goal, goal_radius, radius)
    length = float(remaining(task.start.x, task.start.y, ways))
    if not np.isfinite(length):
        raise _unreachable(room, task, "no way leads there")
    return length


def _unreachable(room: Room, task: RoomTask, reason: str) -> ValueError:
    """Return the error of a task that cannot be done."""
    start = (task.start.x, task.start.y)
    return ValueError(
        f"room {room.name}: expected a goal that can be reached from {start}, got {task.goal}: "
        f"{reason}; random_task draws goals that can"
    )


@lru_cache(maxsize=64)
def _arrays(room: Room) -> Rooms:
    """Return a room as the compiled pass takes it."""
    return room_arrays([room])


@cache
def _moves(robot: DiscRobotConfig) -> _Moves:
    """Return the moves of a robot, as the simulator drives them where nothing stands."""
    shares = [(v, w) for v in _SPEEDS for w in _RATES if v or w]
    twists = np.array(shares) * (robot.max_speed, robot.max_yaw_rate)
    count = len(twists)
    motions = np.concatenate([np.zeros((count, YAW + 1)), twists], axis=1)
    none = np.zeros(1, dtype=np.int64)
    flat = np.zeros((1, 1, 4))
    empty = Rooms(flat, none, np.zeros((1, 1, 3)), none, flat, none, np.zeros((1, 2)))
    places = np.empty((count, robot.substeps, 2))
    for s in range(robot.substeps):
        drive(
            motions,
            np.ones(count, dtype=np.bool_),
            np.zeros(count, dtype=np.int64),
            empty,
            Movers.none(count),
            robot.radius,
            robot.period / robot.substeps,
            1,
            np.zeros(count, dtype=np.int64),
        )
        places[:, s] = motions[:, X:YAW]
    # A bin that the sharpest turn or the longest way cannot leave would hold a robot in it.
    edge = min(CELL, 0.5 * robot.max_speed * robot.period)
    width = min(_WIDTH, 0.625 * robot.max_yaw_rate * robot.period)
    turns = motions[:, YAW].copy()
    return _Moves(twists, places, turns, edge, math.ceil(_TURN / width - _MARGIN))


@kernel
def _search(start: NDArray[np.float64], query: _Query) -> tuple[bool, NDArray[np.int64]]:
    """Return whether there is a plan, and the index of each of its moves, shape (t,).

    Args:
        start: x, y [m] and yaw [rad], shape (3,).
        query: Goal, room and moves of the search.
    """
    low, edge, headings = query.ways.low, query.moves.edge, query.moves.headings
    n, m = int(np.ceil(-2 * low[0] / edge)), int(np.ceil(-2 * low[1] / edge))
    bins = np.full((n, m, headings), -1, dtype=np.int32)
    # Nodes: pose and estimated steps of the whole way; node before, move, steps so far, next node
    # with the same estimate. Estimates are whole numbers, so that nodes wait in a chain for each,
    # the newest first: the search looks deep before it looks wide.
    poses, links = np.empty((1 << 14, 4)), np.empty((1 << 14, 4), dtype=np.int64)
    chains = np.full(_LONGEST, -1)
    poses[0] = start[0], start[1], start[2], 0.0
    links[0] = -1, -1, 0, -1
    chains[0], count, estimate = 0, 1, 0
    while estimate < _LONGEST:
        node = chains[estimate]
        if node < 0:
            estimate += 1
            continue
        chains[estimate] = links[node, 3]
        x, y, yaw = poses[node, :3]
        if np.hypot(x - query.goal[0], y - query.goal[1]) < query.goal_radius - _MARGIN:
            return True, _traced(links, node)
        if node > 0 and bins[_bin(x, y, yaw, low, edge, headings)] != node:
            continue  # A better pose took its bin.
        steps, c, s = links[node, 2] + 1, np.cos(yaw), np.sin(yaw)
        for move in range(len(query.moves.turns)):
            is_free, new_x, new_y = _moved(x, y, c, s, query.moves.places[move], query)
            if not is_free:
                continue
            rest = (remaining(new_x, new_y, query.ways) - query.goal_radius) / query.stride
            cost = steps + max(rest, 0.0)
            if not cost < _LONGEST:
                continue
            new_yaw = yaw + query.moves.turns[move]
            key = _bin(new_x, new_y, new_yaw, low, edge, headings)
            old = bins[key]
            if old >= 0 and cost > poses[old, 3] - _GAIN:
                continue
            if count == len(poses):
                poses = np.concatenate((poses, np.empty_like(poses)))
                links = np.concatenate((links, np.empty_like(links)))
            total = int(np.ceil(cost - _MARGIN))
            poses[count] = new_x, new_y, new_yaw, cost
            links[count] = node, move, steps, chains[total]
            chains[total] = bins[key] = count
            estimate = min(estimate, total)
            count += 1
    return False, np.empty(0, dtype=np.int64)


@inlined_kernel
def _moved(
    x: float, y: float, c: float, s: float, places: NDArray[np.float64], query: _Query
) -> tuple[bool, float, float]:
    """Return whether a move touches nothing, and where it ends [m].

    Args:
        x: Position [m].
        y: Position [m].
        c: Cosine of the heading.
        s: Sine of the heading.
        places: Places of the move, shape (s, 2).
        query: Goal, room and moves of the search.
    """
    new_x, new_y = x, y
    for offset in places:
        new_x, new_y = x + c * offset[0] - s * offset[1], y + s * offset[0] + c * offset[1]
        if _touches(new_x, new_y, query):
            return False, new_x, new_y
    return True, new_x, new_y


@inlined_kernel
def _touches(x: float, y: float, query: _Query) -> bool:
    """Return True if a robot at a place would be in contact."""
    low, clearances = query.ways.low, query.ways.clearances
    i, j = int(np.floor((x - low[0]) / CELL)), int(np.floor((y - low[1]) / CELL))
    if not (0 <= i < clearances.shape[0] and 0 <= j < clearances.shape[1]):
        return True
    # The cell's clearance decides nearly always; what is close to the limit is measured.
    spare = clearances[i, j] - query.radius
    if abs(spare) > HALF_DIAGONAL + _MARGIN:
        return spare < 0.0
    return clearance(x, y, 0, query.rooms, 0, query.movers) < query.radius + _MARGIN


@inlined_kernel
def _bin(
    x: float, y: float, yaw: float, low: NDArray[np.float64], edge: float, headings: int
) -> tuple[int, int, int]:
    """Return the bin of a pose in the room."""
    i, j = int((x - low[0]) / edge), int((y - low[1]) / edge)
    return i, j, int(yaw % _TURN * (headings / _TURN)) % headings


@kernel
def _traced(links: NDArray[np.int64], node: int) -> NDArray[np.int64]:
    """Return the moves that lead to a node, shape (t,)."""
    moves = np.empty(links[node, 2], dtype=np.int64)
    for k in range(len(moves) - 1, -1, -1):
        moves[k] = links[node, 1]
        node = links[node, 0]
    return moves
