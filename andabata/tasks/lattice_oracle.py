"""Fewest steps to a goal in a room: a search over (x, y, heading) with the room known.

A* over control steps (Hart, Nilsson, Raphael 1968) with one exact pose kept in each bin of position
and heading (hybrid-state A*, Dolgov et al. 2008). What remains is bounded from below by the length
of the shortest way of a disc at full speed. Times and path lengths of drives are compared with
these bounds.
"""

from functools import cache, lru_cache
from heapq import heappop, heappush
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.tasks.movers import Movers
from andabata.tasks.room_batch import DiscRobotConfig, room_arrays
from andabata.tasks.room_kernel import YAW, Rooms, V, X, clearance, drive
from terrain.kernel import kernel
from worlds.rooms import Room, RoomTask

CELL = 0.05
"""Edge of the bins of position [m]."""

HEADINGS = 48
"""Number of bins of heading: 7.5 degrees each."""

SPEEDS = (0.0, 0.5, 1.0)
"""Speeds of the moves, as shares of the largest. Full speed is last: it is looked at first."""

RATES = (-1.0, 1.0, -0.5, 0.5, 0.0)
"""Yaw rates of the moves, as shares of the largest."""

_CORNER = CELL * np.sqrt(0.5)
"""Largest distance of a pose from the middle of its bin [m]."""

_MARGIN = 1e-9
"""Distance by which plans keep out of contact and come into the goal [m], against rounding."""

_LONGEST = 10_000
"""Number of steps beyond which no plan is looked for."""

_TURN = 2 * np.pi


class _Grid(NamedTuple):
    """Clearance of a room's cells, and the shortest ways from them to a goal.

    Attributes:
        low: x and y of the first cell's outer corner [m], shape (2,).
        clearances: Distance of each cell's middle to the nearest obstacle [m], shape (n, m).
        corners: Next corner of the way from each cell to the goal: x, y and the length of the way
            from there on [m], shape (n, m, 3); infinite without a way.
    """

    low: NDArray[np.float64]
    clearances: NDArray[np.float64]
    corners: NDArray[np.float64]


class _Moves(NamedTuple):
    """Moves of one control period.

    Attributes:
        twists: Speed [m/s] and yaw rate [rad/s] of each, shape (a, 2).
        places: x and y after each check for contact, from the pose before [m], shape (a, s, 2).
        turns: Change of heading of each [rad], shape (a,).
    """

    twists: NDArray[np.float64]
    places: NDArray[np.float64]
    turns: NDArray[np.float64]


def oracle_steps(room: Room, task: RoomTask, robot: DiscRobotConfig, goal_radius: float) -> int:
    """Return the fewest control steps from a start to a goal, 1 to 2 % above the optimum at most.

    Args:
        room: Room, without obstacles that appear.
        task: Start and goal.
        robot: Body and its limits.
        goal_radius: Distance from the goal within which it counts as reached [m].

    Raises:
        ValueError: If the goal cannot be reached.
    """
    return len(oracle_plan(room, task, robot, goal_radius))


def oracle_plan(
    room: Room, task: RoomTask, robot: DiscRobotConfig, goal_radius: float
) -> NDArray[np.float64]:
    """Return the twists of ``oracle_steps``: speed [m/s] and yaw rate [rad/s], shape (t, 2).

    Driven one after the other they reach the goal without contact.
    """
    if room.clearance(_position(task))[0] < robot.radius:
        raise _unreachable(room, task, "start is in contact")
    # A way through cells that a disc can touch without contact is never longer than its own way.
    grid = _grid(room, task.goal, goal_radius, robot.radius - _CORNER)
    start = np.array([task.start.x, task.start.y, task.start.yaw])
    moves = _moves(robot)
    found = _search(
        start,
        np.array(task.goal),
        goal_radius,
        robot.radius,
        robot.max_speed * robot.period,
        moves,
        grid,
        _obstacles(room),
        Movers.none(1),
    )
    if len(found) and found[0] < 0:
        raise _unreachable(room, task, "there is no way")
    return moves.twists[found]


def geodesic_length(room: Room, task: RoomTask, radius: float, goal_radius: float) -> float:
    """Return the length of the shortest way of a disc to a goal, whatever its heading [m].

    It is the shortest path length that SPL (Anderson et al. 2018) compares with, to within 1 %.

    Args:
        room: Room, without obstacles that appear.
        task: Start and goal.
        radius: Radius of the disc [m].
        goal_radius: Distance from the goal within which it counts as reached [m].

    Raises:
        ValueError: If the goal cannot be reached.
    """
    grid = _grid(room, task.goal, goal_radius, radius)
    length = float(_remaining(task.start.x, task.start.y, grid))
    if not np.isfinite(length):
        raise _unreachable(room, task, "there is no way")
    return max(length - goal_radius, 0.0)


def _position(task: RoomTask) -> NDArray[np.float64]:
    """Return where a task starts [m], shape (1, 2)."""
    return np.array([[task.start.x, task.start.y]])


def _unreachable(room: Room, task: RoomTask, reason: str) -> ValueError:
    """Return the error of a task that cannot be done."""
    start = (task.start.x, task.start.y)
    return ValueError(
        f"room {room.name}: expected a goal that can be reached from {start}, got {task.goal}: "
        f"{reason}; take a task of random_task"
    )


@cache
def _obstacles(room: Room) -> Rooms:
    """Return a room as the compiled pass takes it."""
    return room_arrays([room])


@cache
def _clearances(room: Room) -> NDArray[np.float64]:
    """Return the clearance of the middle of each of a room's cells [m], shape (n, m)."""
    edges = [np.arange(-half + CELL / 2, half, CELL) for half in room.half]
    places = np.stack(np.meshgrid(*edges, indexing="ij"), axis=-1)
    return room.clearance(places.reshape(-1, 2)).reshape(places.shape[:2])


@lru_cache(maxsize=64)
def _grid(room: Room, goal: tuple[float, float], goal_radius: float, radius: float) -> _Grid:
    """Return the ways of a disc to a goal from every cell of a room."""
    low, clearances = -np.array(room.half), _clearances(room)
    corners = _ways(clearances, low, np.array(goal), goal_radius, radius)
    return _Grid(low, clearances, corners)


@cache
def _moves(robot: DiscRobotConfig) -> _Moves:
    """Return the moves of a robot, driven as the simulator drives them."""
    shares = [(v, w) for v in SPEEDS for w in RATES if v or w]
    twists = np.array(shares) * (robot.max_speed, robot.max_yaw_rate)
    count = len(twists)
    motions = np.concatenate([np.zeros((count, YAW + 1)), twists], axis=1)
    nowhere = Rooms(np.zeros((1, 1, 4)), np.zeros(1, int), np.zeros((1, 1, 3)), np.zeros(1, int))
    places = np.empty((count, robot.substeps, 2))
    for s in range(robot.substeps):
        drive(
            motions,
            np.ones(count, dtype=np.bool_),
            np.zeros(count, dtype=np.int64),
            nowhere,
            Movers.none(count),
            robot.radius,
            robot.period / robot.substeps,
            1,
            np.zeros(count, dtype=np.bool_),
        )
        places[:, s] = motions[:, X:YAW]
    return _Moves(twists, places, motions[:, YAW].copy())


@kernel
def _ways(
    clearances: NDArray[np.float64],
    low: NDArray[np.float64],
    goal: NDArray[np.float64],
    goal_radius: float,
    radius: float,
) -> NDArray[np.float64]:
    """Return the next corner of the shortest way of a disc from each cell, as ``_Grid`` has it.

    Dijkstra's search over eight neighbours from the goal. A cell that sees the next corner of its
    neighbour's way goes there straight (Theta*, Nash et al. 2007), so that lengths are not those of
    ways along the grid.
    """
    n, m = clearances.shape
    best = np.full((n, m), np.inf)
    corners = np.full((n, m, 3), np.inf)
    waiting = [(0.0, 0, 0)]
    waiting.pop()
    for i in range(n):
        for j in range(m):
            x, y = low[0] + (i + 0.5) * CELL, low[1] + (j + 0.5) * CELL
            away = np.hypot(x - goal[0], y - goal[1])
            if away < goal_radius + _CORNER and clearances[i, j] >= radius:
                best[i, j] = away
                corners[i, j] = goal[0], goal[1], 0.0
                heappush(waiting, (away, i, j))
    while len(waiting):
        length, i, j = heappop(waiting)
        if length > best[i, j]:
            continue
        here_x, here_y = low[0] + (i + 0.5) * CELL, low[1] + (j + 0.5) * CELL
        corner_x, corner_y, onward = corners[i, j]
        for a in range(max(i - 1, 0), min(i + 2, n)):
            for b in range(max(j - 1, 0), min(j + 2, m)):
                if clearances[a, b] < radius:
                    continue
                x, y = low[0] + (a + 0.5) * CELL, low[1] + (b + 0.5) * CELL
                straight = onward + np.hypot(x - corner_x, y - corner_y)
                stepped = length + np.hypot(x - here_x, y - here_y)
                # The straight way is never longer: where it isn't shorter, neither is needed.
                if straight >= best[a, b]:
                    continue
                if _sees(clearances, low, radius, x, y, corner_x, corner_y):
                    best[a, b] = straight
                    corners[a, b] = corner_x, corner_y, onward
                elif stepped < best[a, b]:
                    best[a, b] = stepped
                    corners[a, b] = here_x, here_y, length
                else:
                    continue
                heappush(waiting, (best[a, b], a, b))
    return corners


@kernel
def _sees(
    clearances: NDArray[np.float64],
    low: NDArray[np.float64],
    radius: float,
    x: float,
    y: float,
    to_x: float,
    to_y: float,
) -> bool:
    """Return True if a disc can drive straight from (x, y) to another place [m]."""
    length = np.hypot(to_x - x, to_y - y)
    gone = 0.0
    while gone < length:
        share = gone / length
        i = int((x + share * (to_x - x) - low[0]) / CELL)
        j = int((y + share * (to_y - y) - low[1]) / CELL)
        spare = clearances[i, j] - radius
        if spare < 0.0:
            return False
        # As far as the clearance reaches nothing can be in the way.
        gone += max(spare - _CORNER, 0.5 * CELL)
    return True


@kernel
def _remaining(x: float, y: float, grid: _Grid) -> float:
    """Return the length of the shortest way from a place to the goal's middle [m]."""
    i, j = int((x - grid.low[0]) / CELL), int((y - grid.low[1]) / CELL)
    corner = grid.corners[i, j]
    return corner[2] + np.hypot(x - corner[0], y - corner[1])


@kernel
def _search(
    start: NDArray[np.float64],
    goal: NDArray[np.float64],
    goal_radius: float,
    radius: float,
    stride: float,
    moves: _Moves,
    grid: _Grid,
    rooms: Rooms,
    movers: Movers,
) -> NDArray[np.int64]:
    """Return the indices of the moves of the plan with the fewest steps, shape (t,), or [-1].

    Args:
        start: x, y [m] and yaw [rad], shape (3,).
        goal: Goal [m], shape (2,).
        goal_radius: Distance from the goal within which it counts as reached [m].
        radius: Radius of the robot [m].
        stride: Largest way of a step [m].
        moves: Moves.
        grid: Ways to the goal.
        rooms: The room.
        movers: No moving obstacles.
    """
    n, m = grid.clearances.shape
    bins = np.full((n, m, HEADINGS), -1, dtype=np.int32)
    size = 1 << 14
    poses, links = np.empty((size, 3)), np.empty((size, 4), dtype=np.int64)
    # Estimates are whole steps: nodes of the same estimate are a chain, the newest first, which
    # looks deep before it looks wide.
    heads = np.full(_LONGEST, -1)
    poses[0] = start
    links[0] = -1, -1, 0, -1
    count, estimate = 1, 0
    remaining = _remaining(start[0], start[1], grid)
    if remaining < np.inf:
        heads[0] = 0
    while estimate < _LONGEST:
        node = heads[estimate]
        if node < 0:
            estimate += 1
            continue
        heads[estimate] = links[node, 3]
        x, y, yaw = poses[node]
        if np.hypot(x - goal[0], y - goal[1]) < goal_radius - _MARGIN:
            return _traced(links, node)
        if node > 0 and bins[_bin(x, y, yaw, grid)] != node:
            continue
        steps = links[node, 2] + 1
        c, s = np.cos(yaw), np.sin(yaw)
        for a in range(len(moves.turns)):
            new_x, new_y = x, y
            hit = False
            for place in moves.places[a]:
                new_x, new_y = x + c * place[0] - s * place[1], y + s * place[0] + c * place[1]
                if _touches(new_x, new_y, radius, grid, rooms, movers):
                    hit = True
                    break
            if hit:
                continue
            new_yaw = yaw + moves.turns[a]
            key = _bin(new_x, new_y, new_yaw, grid)
            old = bins[key]
            if old >= 0 and links[old, 2] <= steps:
                continue
            rest = _remaining(new_x, new_y, grid) - goal_radius
            total = steps + max(int(np.ceil(rest / stride - _MARGIN)), 0)
            if total >= _LONGEST:
                continue
            if count == len(poses):
                poses = np.concatenate((poses, np.empty_like(poses)))
                links = np.concatenate((links, np.empty_like(links)))
            poses[count] = new_x, new_y, new_yaw
            links[count] = node, a, steps, heads[total]
            heads[total] = count
            bins[key] = count
            count += 1
            estimate = min(estimate, total)
    return np.full(1, -1)


@kernel
def _bin(x: float, y: float, yaw: float, grid: _Grid) -> tuple[int, int, int]:
    """Return the bin of a pose."""
    i, j = int((x - grid.low[0]) / CELL), int((y - grid.low[1]) / CELL)
    return i, j, int(yaw % _TURN * (HEADINGS / _TURN)) % HEADINGS


@kernel
def _touches(
    x: float, y: float, radius: float, grid: _Grid, rooms: Rooms, movers: Movers
) -> bool:
    """Return True if a robot would be in contact."""
    i, j = int(np.floor((x - grid.low[0]) / CELL)), int(np.floor((y - grid.low[1]) / CELL))
    if not (0 <= i < grid.clearances.shape[0] and 0 <= j < grid.clearances.shape[1]):
        return True
    # The cell's clearance decides most; what is near the limit is measured.
    spare = grid.clearances[i, j] - radius
    if abs(spare) > _CORNER + _MARGIN:
        return spare < 0.0
    return clearance(x, y, 0, rooms, 0, movers) < radius + _MARGIN


@kernel
def _traced(links: NDArray[np.int64], node: int) -> NDArray[np.int64]:
    """Return the moves that lead to a node, shape (t,)."""
    found = np.empty(links[node, 2], dtype=np.int64)
    for k in range(len(found) - 1, -1, -1):
        found[k] = links[node, 1]
        node = links[node, 0]
    return found
