"""Cost to go: exact cost of the way to the goal from the cells around the robot.

The search is A* from the goal to the robot with a bucket queue (Dial 1969). It knows no unit: with
costs of a metre it answers in metres, with costs of a second in seconds. It can go on later, for
single cells that somebody asks for.

All ways over unknown ground that turn off sooner or later cost the same, and so do their bounds. A
bucket is therefore emptied in the order in which it was filled, step by step from the goal: then a
cell is taken after all those before it, and seldom twice.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.planning.cost_bound import SIDES, bound_of, least_cost, surround
from terrain.kernel import kernel

_NOW, _USED, _WAITING = 0, 1, 2
"""Places of a queue's numbers."""


_ROWS, _COLUMNS = (-1, -1, -1, 0, 0, 1, 1, 1), (-1, 0, 1, -1, 1, -1, 0, 1)
"""Rows and columns of a cell's neighbours, counted from the cell."""

_HALF_STEPS = tuple(
    np.float32(0.5 * math.hypot(row, column)) for row, column in zip(_ROWS, _COLUMNS, strict=True)
)
"""Half of the length of the steps to them: a step costs the mean of both cells."""


class Queue(NamedTuple):
    """Bucket queue of cells: a ring of linked lists of entries, one for each unit of cost.

    A cell that gets cheaper while it waits gets another entry; the one before stays and is passed
    over. Entries are used one after the other, so that neighbours in time are neighbours in memory:
    lists that cells are taken out of are three times as slow.

    Attributes:
        heads: First entry of each bucket, -1 for none, int32, shape (a power of 2,).
        tails: Last entry of each bucket that has one, int32, as many.
        cells: Cell of each entry, int32, shape (m,).
        after: Entry after each entry in its bucket, -1 for none, int32, shape (m,).
        is_waiting: True for cells that wait to be taken, bool, shape (n * n,).
        numbers: Bucket that is taken from, number of entries used, number of those in buckets,
            int64, shape (3,).
    """

    heads: NDArray[np.int32]
    tails: NDArray[np.int32]
    cells: NDArray[np.int32]
    after: NDArray[np.int32]
    is_waiting: NDArray[np.bool_]
    numbers: NDArray[np.int64]


def queue_for(cells: int, highest: float, beyond: float) -> Queue:
    """Return a queue for the searches of a square.

    Args:
        cells: Number of cells along its edge.
        highest: Highest cost of a cell's length.
        beyond: Highest cost of a cell's length beyond the square.
    """
    # A cell waits at most the dearest step behind the one that is taken, one of the square's edge
    # at most as far as the way along the edge and back to the robot.
    step = math.sqrt(2.0) * max(highest + beyond, 2.0 * beyond * cells)
    count = 1 << math.ceil(math.log2(step + 2.0))
    # Twice as many as cells are hardly ever used up; then those that are passed over go.
    entries = 2 * cells * cells
    return Queue(
        heads=np.zeros(count, dtype=np.int32),
        tails=np.zeros(count, dtype=np.int32),
        cells=np.zeros(entries, dtype=np.int32),
        after=np.zeros(entries, dtype=np.int32),
        is_waiting=np.zeros(cells * cells, dtype=np.bool_),
        numbers=np.zeros(3, dtype=np.int64),
    )


class Search(NamedTuple):
    """A search and its result.

    Attributes:
        costs: Cost of a cell's length in each cell, at least 1, float32, shape (n, n).
        cost_to_go: Cost of the way to the goal, infinite where the search has not been, float32,
            shape (n, n).
        queue: Queue for such a square.
        first: Cell of the robot, int64, shape (2,).
        octagon: Octagon around what costs less than unknown ground, int64, shape (8,).
        unknown: Least cost of a cell's length on unknown ground and beyond the square.
        beyond: Cost of the way from each cell of the edge to a goal beyond the square, in the order
            of ``edge_cells``; NaN is the straight way over unknown ground, float32, shape
            (4 (n - 1),).
    """

    costs: NDArray[np.float32]
    cost_to_go: NDArray[np.float32]
    queue: Queue
    first: NDArray[np.int64]
    octagon: NDArray[np.int64]
    unknown: float
    beyond: NDArray[np.float32]


def search_for(
    costs: NDArray[np.float32],
    cost_to_go: NDArray[np.float32],
    highest: float,
    unknown: float,
    prior: float = 0.0,
) -> Search:
    """Return a search over some costs, before its begin.

    Args:
        costs: Cost of a cell's length in each cell, at least 1, float32, shape (n, n).
        cost_to_go: Memory of the result, float32, shape (n, n).
        highest: Highest cost of a cell's length.
        unknown: Least cost of a cell's length on unknown ground and beyond the square.
        prior: Highest extra cost of a cell's length there.
    """
    n = len(costs)
    queue = queue_for(n, highest + prior, unknown + prior)
    first, octagon = np.zeros(2, dtype=np.int64), np.zeros(SIDES, dtype=np.int64)
    straight = np.full(4 * (n - 1), np.nan, dtype=np.float32)
    return Search(costs, cost_to_go, queue, first, octagon, unknown, straight)


def edge_cells(n: int) -> NDArray[np.int64]:
    """Return rows and columns of the cells of a square's edge, shape (4 (n - 1), 2)."""
    return np.array([_edge_cell(k, n) for k in range(4 * (n - 1))], dtype=np.int64)


@kernel
def search(around: Search, last: NDArray[np.int64], margin: float) -> None:
    """Write the cost of the way to the last cell into those between it and the first, and around.

    Args:
        around: Search, whose costs to go are written.
        last: Cell of the goal, shape (2,).
        margin: Cost beyond the robot's up to which the costs are known.
    """
    surround(around.costs, around.unknown, around.first, around.octagon)
    _begin(around, last)
    _go_on(around, around.first[0], around.first[1], margin, np.inf)


@kernel
def is_settled(around: Search, cell: tuple[int, int], limit: float, margin: float) -> bool:
    """Return True if ``settle`` has nothing to do for a cell."""
    numbers, first, cost_to_go = around.queue.numbers, around.first, around.cost_to_go
    i, j = cell
    rest = least_cost(bound_of(first, around.octagon, around.unknown), i, j)
    most = min(limit + rest, cost_to_go[first[0], first[1]] + margin)
    return numbers[_WAITING] == 0 or numbers[_NOW] > min(cost_to_go[i, j] + rest, most)


@kernel
def settle(around: Search, cell: tuple[int, int], limit: float, margin: float) -> None:
    """Go on with a search until the cost to go of a cell is exact.

    Args:
        around: Search.
        cell: Row and column of the cell.
        limit: Cost above which it need not be exact: it stays above.
        margin: Cost beyond the robot's above which it need not be exact either.
    """
    (i, j), first = cell, around.first
    most = limit + least_cost(bound_of(first, around.octagon, around.unknown), i, j)
    _go_on(around, i, j, 0.0, min(most, around.cost_to_go[first[0], first[1]] + margin))


@kernel
def _begin(around: Search, last: NDArray[np.int64]) -> None:
    """Let the last cell wait, or, if it is beyond the square, all cells of the edge.

    Each of these costs the way from there, or the straight one over unknown ground.
    """
    cost_to_go, queue, unknown = around.cost_to_go, around.queue, around.unknown
    bound = bound_of(around.first, around.octagon, unknown)
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
        if not inside and not np.isnan(around.beyond[k]):
            cost_to_go[i, j] = around.beyond[k]
        bucket = int(cost_to_go[i, j] + least_cost(bound, i, j))
        _put(queue, k, i * n + j, bucket)
        now = min(now, bucket)
    queue.numbers[_NOW], queue.numbers[_USED], queue.numbers[_WAITING] = now, count, count


@kernel
def _go_on(around: Search, row: int, column: int, margin: float, most: float) -> None:
    """Take cells until the cost of one, and of all up to a margin beyond it, is exact.

    A cell that gets cheaper after it was taken is taken again.

    Args:
        around: Search.
        row: Row of the cell.
        column: Column of the cell.
        margin: Cost beyond that of the way from the goal over the cell to the robot.
        most: Cost of such a way at which to stop in any case.
    """
    costs, cost_to_go, queue = around.costs, around.cost_to_go, around.queue
    bound = bound_of(around.first, around.octagon, around.unknown)
    n, ring = len(costs), len(queue.heads) - 1
    flat, price = cost_to_go.ravel(), costs.ravel()
    target, beyond = row * n + column, np.float32(least_cost(bound, row, column) + margin)
    now, used, waiting = queue.numbers
    while waiting:
        while queue.heads[now & ring] < 0:
            now += 1
        if now > flat[target] + beyond or now > most:
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
            used = waiting = _fill_again(around, now)
        i, j = cell // n, cell % n
        here, own = flat[cell], price[cell]
        inside = 0 < i < n - 1 and 0 < j < n - 1
        before = used
        for k in range(8):
            p, q = i + _ROWS[k], j + _COLUMNS[k]
            # Only few cells are at the edge of the square: for the others one test is enough.
            if not inside and not (0 <= p < n and 0 <= q < n):
                continue
            other = cell + _ROWS[k] * n + _COLUMNS[k]
            length = here + _HALF_STEPS[k] * (own + price[other])
            if length < flat[other]:
                flat[other] = length
                # A*: the bound of the rest never exceeds its cost.
                _put(queue, used, other, max(now, int(length + least_cost(bound, p, q))))
                used += 1
        waiting += used - before
    queue.numbers[_NOW], queue.numbers[_USED], queue.numbers[_WAITING] = now, used, waiting


@kernel
def _fill_again(around: Search, now: int) -> int:
    """Drop the entries that are passed over, and return the number of those that stay."""
    cost_to_go, queue = around.cost_to_go, around.queue
    bound = bound_of(around.first, around.octagon, around.unknown)
    n, used = len(cost_to_go), 0
    queue.heads[:] = -1
    for i in range(n):
        for j in range(n):
            if queue.is_waiting[i * n + j]:
                bucket = int(cost_to_go[i, j] + least_cost(bound, i, j))
                _put(queue, used, i * n + j, max(now, bucket))
                used += 1
    return used


@kernel
def _put(queue: Queue, entry: int, cell: int, bucket: int) -> None:
    """Put a cell at the end of a bucket with an entry that is not in use."""
    slot = bucket & (len(queue.heads) - 1)
    queue.cells[entry], queue.after[entry] = cell, -1
    if queue.heads[slot] < 0:
        queue.heads[slot] = entry
    else:
        queue.after[queue.tails[slot]] = entry
    queue.tails[slot] = entry
    queue.is_waiting[cell] = True


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
