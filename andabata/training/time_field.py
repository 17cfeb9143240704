"""Time to a goal from everywhere in a world, over its true map: what a teacher knows."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from terrain.kernel import kernel
from worlds.traversability_map import Reason, TraversabilityMap

_COARSE = 3
"""Edge of a node of the search [cells]."""

_MOVES = ((1, 0), (0, 1), (1, 1), (1, -1))
"""Half of a node's eight neighbours; the graph is undirected."""

_AHEAD = 4
"""Number of nodes along the way over which its direction is taken."""


class TimeFieldConfig(BaseModel):
    """Settings of the times.

    Attributes:
        speed: Speed in the open [m/s].
        open_clearance: Clearance from which on it is driven [m].
        slow_clearance: Clearance at which half of it is driven [m].
        inscribed_clearance: Clearance below which the body hardly fits [m].
        inscribed_factor: Time of a metre there, as a multiple of that in the open.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    speed: float = Field(default=0.6, gt=0)
    open_clearance: float = Field(default=0.9, gt=0)
    slow_clearance: float = Field(default=0.45, gt=0)
    inscribed_clearance: float = Field(default=0.4, gt=0)
    inscribed_factor: float = Field(default=20.0, ge=2)


class TimeField(NamedTuple):
    """Times to a goal on the nodes of a square grid.

    Node ``[i, j]`` is centred at ``corner + (i + 0.5, j + 0.5) * edge``.

    Attributes:
        times: Time to the goal [s], infinite where no way leads on, float32, shape (n, m).
        directions: Direction of the way there in the map [rad], float32, shape (n, m).
        corner: Corner of the first node in the map [m], shape (2,).
        edge: Edge of a node [m].
    """

    times: NDArray[np.float32]
    directions: NDArray[np.float32]
    corner: NDArray[np.float64]
    edge: float


def time_field(
    truth: TraversabilityMap, goal: NDArray[np.float64], config: TimeFieldConfig
) -> TimeField:
    """Return the times to a goal over a true map (Dijkstra).

    Args:
        truth: True map.
        goal: Goal in the map [m], shape (2,).
        config: Settings.
    """
    middle, edge = _COARSE // 2, truth.cell * _COARSE
    free = truth.reason[middle::_COARSE, middle::_COARSE] == Reason.FREE
    clearance = np.where(free, truth.clearance[middle::_COARSE, middle::_COARSE], 0.0)
    seconds = slowness(clearance, config) * edge
    corner = np.array([truth.x_min, truth.y_min])
    start = np.clip(((goal - corner) / edge).astype(int), 0, np.array(free.shape) - 1)
    node = int(start[0]) * free.shape[1] + int(start[1])
    times = dijkstra(_graph(seconds), directed=False, indices=node)
    times = times.reshape(free.shape).astype(np.float32)
    directions = np.empty_like(times)
    _write_directions(times, (goal - corner) / edge, directions)
    return TimeField(times, directions, corner, edge)


def slowness(clearance: NDArray[np.floating], config: TimeFieldConfig) -> NDArray[np.float64]:
    """Return the time of a metre at clearances [s/m], infinite on forbidden ground.

    It is constant in the open, twice that at ``slow_clearance``, and rises to
    ``inscribed_factor`` times it where the body hardly fits.
    """
    places = (0.0, config.inscribed_clearance, config.slow_clearance, config.open_clearance)
    factors = (2.0 * config.inscribed_factor, config.inscribed_factor, 2.0, 1.0)
    factor = np.interp(clearance, places, factors)
    return np.where(clearance > 0.0, factor, np.inf) / config.speed


def _graph(seconds: NDArray[np.float64]) -> coo_matrix:
    """Return the graph of the nodes that can be driven on; an edge costs the mean of both."""
    n, m = seconds.shape
    numbers = np.arange(n * m).reshape(n, m)
    rows, columns, costs = [], [], []
    for di, dj in _MOVES:
        low, high = max(-dj, 0), m - max(dj, 0)
        near = (slice(0, n - di), slice(low, high))
        far = (slice(di, n), slice(low + dj, high + dj))
        cost = 0.5 * (seconds[near] + seconds[far]) * np.hypot(di, dj)
        passable = np.isfinite(cost)
        rows.append(numbers[near][passable])
        columns.append(numbers[far][passable])
        costs.append(cost[passable])
    parts = (np.concatenate(each) for each in (costs, rows, columns))
    values, first, second = parts
    return coo_matrix((values, (first, second)), shape=(n * m, n * m)).tocsr()


@kernel
def _write_directions(
    times: NDArray[np.float32], goal: NDArray[np.float64], directions: NDArray[np.float32]
) -> None:
    """Write where the way leads from each node; near the goal, straight to it."""
    n, m = times.shape
    for i in range(n):
        for j in range(m):
            p, q = i, j
            for _ in range(_AHEAD):
                p, q = _next_node(times, p, q)
            x, y = float(p - i), float(q - j)
            if times[p, q] == 0.0 or (x == 0.0 and y == 0.0):
                x, y = goal[0] - i - 0.5, goal[1] - j - 0.5
            directions[i, j] = np.arctan2(y, x)


@kernel
def _next_node(times: NDArray[np.float32], i: int, j: int) -> tuple[int, int]:
    """Return the neighbour from which the goal is nearest in time."""
    n, m = times.shape
    best_i, best_j = i, j
    for di in range(-1, 2):
        for dj in range(-1, 2):
            p, q = i + di, j + dj
            if 0 <= p < n and 0 <= q < m and times[p, q] < times[best_i, best_j]:
                best_i, best_j = p, q
    return best_i, best_j
