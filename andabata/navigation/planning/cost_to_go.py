"""Cost to go: exact cost of the way to the goal from the cells around the robot.

The search is A* from the goal to the robot with a bucket queue (Dial 1969). It knows no unit: with
costs of a metre it answers in metres, with costs of a second in seconds.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

_NOW, _USED, _WAITING = 0, 1, 2
"""Places of a queue's numbers."""


class Queue(NamedTuple):
    """Bucket queue of cells: a ring of linked lists of entries, a cell's length of cost each.

    A cell that gets cheaper while it waits gets another entry; the one before stays and is passed
    over. Entries are used one after the other, so that neighbours in time are neighbours in memory:
    lists that cells are taken out of are three times as slow.

    Attributes:
        heads: First entry of each bucket, -1 for none, int32, shape (a power of 2,).
        cells: Cell of each entry, int32, shape (m,).
        after: Entry after each entry in its bucket, -1 for none, int32, shape (m,).
        is_waiting: True for cells that wait to be taken, bool, shape (n * n,).
        numbers: Bucket that is taken from, number of entries used, number of those in buckets,
            int64, shape (3,).
    """

    heads: NDArray[np.int32]
    cells: NDArray[np.int32]
    after: NDArray[np.int32]
    is_waiting: NDArray[np.bool_]
    numbers: NDArray[np.int64]


def queue_for(cells: int, highest: float, unknown: float) -> Queue:
    """Return a queue for the searches of a square.

    Args:
        cells: Number of cells along its edge.
        highest: Highest cost of a cell's length.
        unknown: Cost of a cell's length beyond the square.
    """
    # A cell waits at most the dearest step behind the one that is taken, one of the square's edge
    # at most as far as the way along the edge and back to the robot.
    step = math.sqrt(2.0) * max(highest + 1.0, (1.0 + unknown) * cells)
    count = 1 << math.ceil(math.log2(step + 2.0))
    # Twice as many as cells are hardly ever used up; then those that are passed over go.
    entries = 2 * cells * cells
    return Queue(
        heads=np.zeros(count, dtype=np.int32),
        cells=np.zeros(entries, dtype=np.int32),
        after=np.zeros(entries, dtype=np.int32),
        is_waiting=np.zeros(cells * cells, dtype=np.bool_),
        numbers=np.zeros(3, dtype=np.int64),
    )


@kernel
def search(
    costs: NDArray[np.float32],
    cost_to_go: NDArray[np.float32],
    queue: Queue,
    first: NDArray[np.int64],
    last: NDArray[np.int64],
    unknown: float,
    margin: float,
) -> None:
    """Write the cost of the way to the last cell into those between it and the first, and around.

    Args:
        costs: Cost of a cell's length in each cell, at least 1, float32, shape (n, n).
        cost_to_go: Result, infinite where the search has not been, float32, shape (n, n).
        queue: Queue for such a square.
        first: Cell of the robot, shape (2,).
        last: Cell of the goal, shape (2,).
        unknown: Cost of a cell's length beyond the square.
        margin: Cost beyond the robot's up to which the costs are known.
    """
    _begin(cost_to_go, queue, first, last, unknown)
    _go_on(costs, cost_to_go, queue, first, margin)


@kernel
def _begin(
    cost_to_go: NDArray[np.float32],
    queue: Queue,
    first: NDArray[np.int64],
    last: NDArray[np.int64],
    unknown: float,
) -> None:
    """Let the last cell wait, or, if it is beyond the square, all cells of the edge.

    Each of these costs the straight way to the last one over unknown ground.
    """
    n = len(cost_to_go)
    cost_to_go[:] = np.inf
    queue.heads[:] = -1
    queue.is_waiting[:] = False
    inside = 0 <= last[0] < n and 0 <= last[1] < n
    count = 1 if inside else 4 * (n - 1)
    now = 1 << 30
    for k in range(count):
        i, j = (last[0], last[1]) if inside else _edge_cell(k, n)
        cost_to_go[i, j] = np.float32(unknown * np.hypot(last[0] - i, last[1] - j))
        bucket = int(cost_to_go[i, j] + _straight(i - first[0], j - first[1]))
        _put(queue, k, i * n + j, bucket)
        now = min(now, bucket)
    queue.numbers[_NOW], queue.numbers[_USED], queue.numbers[_WAITING] = now, count, count


@kernel
def _go_on(
    costs: NDArray[np.float32],
    cost_to_go: NDArray[np.float32],
    queue: Queue,
    first: NDArray[np.int64],
    margin: float,
) -> None:
    """Take cells until the robot's cost, and all up to a margin beyond it, are exact.

    A cell that gets cheaper after it was taken is taken again.
    """
    n, ring = len(costs), len(queue.heads) - 1
    flat, price = cost_to_go.ravel(), costs.ravel()
    a0, a1 = first
    robot = a0 * n + a1
    half_steps = (np.float32(0.5), np.float32(0.5 * np.sqrt(2.0)))
    now, used, waiting = queue.numbers
    while waiting:
        while queue.heads[now & ring] < 0:
            now += 1
        if now > flat[robot] + np.float32(margin):
            break
        entry = queue.heads[now & ring]
        queue.heads[now & ring] = queue.after[entry]
        waiting -= 1
        cell = queue.cells[entry]
        # It got cheaper since this entry, and was taken by another.
        if not queue.is_waiting[cell]:
            continue
        queue.is_waiting[cell] = False
        if used + 8 > len(queue.cells):
            used = waiting = _fill_again(queue, cost_to_go, first, now)
        i, j = cell // n, cell % n
        here, own = flat[cell], price[cell]
        for p in range(max(i - 1, 0), min(i + 2, n)):
            for q in range(max(j - 1, 0), min(j + 2, n)):
                other = p * n + q
                length = here + half_steps[int(p != i and q != j)] * (own + price[other])
                if length < flat[other]:
                    flat[other] = length
                    # A*: the straight line to the robot, at the least cost of a cell, never
                    # overestimates.
                    bucket = int(length + _straight(p - a0, q - a1))
                    _put(queue, used, other, max(now, bucket))
                    used += 1
                    waiting += 1
    queue.numbers[_NOW], queue.numbers[_USED], queue.numbers[_WAITING] = now, used, waiting


@kernel
def _fill_again(
    queue: Queue, cost_to_go: NDArray[np.float32], first: NDArray[np.int64], now: int
) -> int:
    """Drop the entries that are passed over, and return the number of those that stay."""
    n, used = len(cost_to_go), 0
    queue.heads[:] = -1
    for i in range(n):
        for j in range(n):
            if queue.is_waiting[i * n + j]:
                bucket = int(cost_to_go[i, j] + _straight(i - first[0], j - first[1]))
                _put(queue, used, i * n + j, max(now, bucket))
                used += 1
    return used


@kernel
def _put(queue: Queue, entry: int, cell: int, bucket: int) -> None:
    """Put a cell into a bucket with an entry that is not in use."""
    slot = bucket & (len(queue.heads) - 1)
    queue.cells[entry], queue.after[entry] = cell, queue.heads[slot]
    queue.heads[slot] = entry
    queue.is_waiting[cell] = True


@kernel
def _straight(rows: int, columns: int) -> float:
    """Return the length of the straight way over a number of rows and columns [cells]."""
    return np.sqrt(np.float32(rows * rows + columns * columns))


@kernel
def _edge_cell(k: int, n: int) -> tuple[int, int]:
    """Return the k-th cell of the way around the square."""
    side, along = k // (n - 1), k % (n - 1)
    if side == 0:
        return 0, along
    if side == 1:
        return along, n - 1
    if side == 2:
        return n - 1, n - 1 - along
    return n - 1 - along, 0
