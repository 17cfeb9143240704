"""Shortest paths on a clearance map: Dijkstra's search, then shortcuts between corners."""

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra

_COARSE = 3
"""Edge of a node of the search [cells]."""

_MARGIN = 30.0
"""Distance beyond start and goal that the search covers [m]."""

_MOVES = ((1, 0), (0, 1), (1, 1), (1, -1))
"""Half of a node's eight neighbours; the graph is undirected."""


def shortest_path(
    clearance: NDArray[np.float32],
    cell: float,
    start: NDArray[np.float64],
    goal: NDArray[np.float64],
    min_clearance: float,
) -> NDArray[np.float64] | None:
    """Return the shortest path that keeps a clearance from forbidden cells.

    Args:
        clearance: Distance of each cell to the nearest forbidden one [m], shape (n, m).
        cell: Edge of a cell [m].
        start: Start [cells], shape (2,).
        goal: Goal [cells], shape (2,).
        min_clearance: Clearance to keep [m], at least a cell; if start or goal has less, the search
            begins or ends at the nearest node that has it, up to 1 m away.

    Returns:
        Corners [cells], float64, shape (k, 2), or None if there is no path.
    """
    low = np.maximum(np.minimum(start, goal) - _MARGIN / cell, 0).astype(int) // _COARSE
    high = ((np.maximum(start, goal) + _MARGIN / cell) / _COARSE).astype(int) + 1
    coarse = clearance[_COARSE // 2 :: _COARSE, _COARSE // 2 :: _COARSE]
    window = coarse[low[0] : high[0], low[1] : high[1]]
    free = window >= max(min_clearance, cell)  # Forbidden cells have a clearance of 0.
    ends = [
        _nearest_free(free, (end / _COARSE - low - 0.5), 1.0 / (cell * _COARSE))
        for end in (start, goal)
    ]
    if ends[0] is None or ends[1] is None:
        return None
    corners = _search(free, window, ends[0], ends[1])
    if corners is None:
        return None
    path = (corners + low + 0.5) * _COARSE
    path = np.concatenate([start[None], path[1:-1], goal[None]])
    # A start that is itself too close to an obstacle must not rule out every shortcut.
    kept = min(min_clearance, *_clearances(clearance, path[[0, -1]]))
    return _shortcut(path, clearance, kept)


def _nearest_free(
    free: NDArray[np.bool_], place: NDArray[np.float64], reach: float
) -> tuple[int, int] | None:
    """Return the free node nearest to a place, up to ``reach`` [nodes] away, or None."""
    cells = np.argwhere(free)
    if not len(cells):
        return None
    distances = np.hypot(*(cells - place).T)
    best = int(np.argmin(distances))
    return (
        (int(cells[best, 0]), int(cells[best, 1])) if distances[best] <= max(reach, 1.5) else None
    )


def _search(
    free: NDArray[np.bool_],
    window: NDArray[np.float32],
    start: tuple[int, int],
    goal: tuple[int, int],
) -> NDArray[np.float64] | None:
    """Return the cheapest path's nodes, shape (k, 2); small clearances cost a little more."""
    graph = _graph(free, 1.0 + 0.3 * np.clip(1.0 - window, 0.0, 1.0))
    number = np.arange(free.size).reshape(free.shape)
    first, last = number[start], number[goal]
    lengths, previous = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
    if not np.isfinite(lengths[last]):
        return None
    cells = [last]
    while cells[-1] != first:
        cells.append(previous[cells[-1]])
    return np.stack(np.unravel_index(np.array(cells[::-1]), free.shape), axis=1).astype(np.float64)


def _graph(free: NDArray[np.bool_], cost: NDArray[np.floating]) -> csr_matrix:
    """Return the free nodes as a graph; an edge costs its length times the mean of both nodes."""
    n, m = free.shape
    number = np.arange(n * m).reshape(n, m)
    rows, columns, weights = [], [], []
    for di, dj in _MOVES:
        here = (slice(0, n - di), slice(max(0, -dj), m - max(0, dj)))
        there = (slice(di, n), slice(max(0, dj), m - max(0, -dj)))
        open_both = free[here] & free[there]
        rows.append(number[here][open_both])
        columns.append(number[there][open_both])
        mean = (cost[here][open_both] + cost[there][open_both]) / 2
        weights.append(mean * np.hypot(di, dj))
    entries = (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns)))
    return coo_matrix(entries, shape=(n * m, n * m)).tocsr()


def _clearances(clearance: NDArray[np.float32], places: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return the clearance at places [cells], shape (k, 2)."""
    last = np.array(clearance.shape) - 1
    i, j = np.clip(places.astype(int), 0, last).T
    return clearance[i, j]


def _shortcut(
    path: NDArray[np.float64], clearance: NDArray[np.float32], min_clearance: float
) -> NDArray[np.float64]:
    """Return the path without corners that a straight line with the same clearance skips."""
    kept, here = [0], 0
    while here < len(path) - 1:
        # Doubling steps find how far the line is clear, then single steps back find its end.
        reach = 1
        while here + reach < len(path) and _is_clear(
            path[here], path[here + reach], clearance, min_clearance
        ):
            reach = min(2 * reach, len(path) - here) if here + 2 * reach < len(path) else reach + 1
        far = min(here + reach, len(path) - 1)
        while far > here + 1 and not _is_clear(path[here], path[far], clearance, min_clearance):
            far -= 1
        kept.append(far)
        here = far
    return path[kept]


def _is_clear(
    a: NDArray[np.float64],
    b: NDArray[np.float64],
    clearance: NDArray[np.float32],
    min_clearance: float,
) -> bool:
    """Return True if the straight line from a to b [cells] keeps the clearance, within 0.1 m."""
    steps = np.linspace(0.0, 1.0, max(2, int(np.hypot(*(b - a)))))[:, None]
    return bool((_clearances(clearance, a + steps * (b - a)) >= min_clearance - 0.1).all())
