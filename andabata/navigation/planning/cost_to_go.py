"""Cost to go: exact cost of the way to the goal from the cells around the robot.

The search is A* from the goal to the robot with a bucket queue (Dial 1969). It knows no unit: with
costs of a metre it answers in metres, with costs of a second in seconds.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import inlined_kernel, kernel


class Queue(NamedTuple):
    """Bucket queue of cells: a ring of doubly linked lists, a cell's length of cost each.

    Attributes:
        heads: First cell of each bucket, -1 for none, int32, shape (a power of 2,).
        before: Cell before each cell in its bucket, int32, shape (n * n,).
        after: Cell after each cell in its bucket, int32, shape (n * n,).
        bucket: Bucket of each cell, -1 for none, int32, shape (n * n,).
    """

    heads: NDArray[np.int32]
    before: NDArray[np.int32]
    after: NDArray[np.int32]
    bucket: NDArray[np.int32]


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
    links = np.zeros((3, cells * cells), dtype=np.int32)
    return Queue(np.zeros(count, dtype=np.int32), *links)


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

    A last cell beyond the square is reached from every cell of its edge, at the cost of unknown
    ground. A cell that gets cheaper while it waits moves to another bucket, and one that gets
    cheaper after it was taken is taken again: the costs are exact.

    Args:
        costs: Cost of a cell's length in each cell, at least 1, float32, shape (n, n).
        cost_to_go: Result, infinite where the search has not been, float32, shape (n, n).
        queue: Queue for such a square.
        first: Cell of the robot, shape (2,).
        last: Cell of the goal, shape (2,).
        unknown: Cost of a cell's length beyond the square.
        margin: Cost beyond the robot's up to which the costs are known.
    """
    n, ring = len(costs), len(queue.heads) - 1
    flat, price = cost_to_go.ravel(), costs.ravel()
    flat[:] = np.inf
    queue.heads[:] = -1
    queue.bucket[:] = -1
    a0, a1 = first
    inside = 0 <= last[0] < n and 0 <= last[1] < n
    waiting = 1 if inside else 4 * (n - 1)
    now = 1 << 30
    for k in range(waiting):
        i, j = (last[0], last[1]) if inside else _edge_cell(k, n)
        cell = i * n + j
        flat[cell] = np.float32(unknown * np.hypot(last[0] - i, last[1] - j))
        # A*: the straight line to the robot, at the least cost of a cell, never overestimates.
        slot = int(flat[cell] + np.hypot(np.float32(i - a0), np.float32(j - a1)))
        _push(queue, cell, slot & ring)
        now = min(now, slot)
    most = np.float32(np.inf)
    half_steps = (np.float32(0.5), np.float32(0.5 * np.sqrt(2.0)))
    while waiting:
        while queue.heads[now & ring] < 0:
            now += 1
        if now > most:
            break
        cell = queue.heads[now & ring]
        _remove(queue, cell)
        waiting -= 1
        i, j = cell // n, cell % n
        here, own = flat[cell], price[cell]
        if i == a0 and j == a1:
            # The robot's cost is known: go on for the margin that rollouts look up.
            most = here + np.float32(margin)
        for p in range(max(i - 1, 0), min(i + 2, n)):
            for q in range(max(j - 1, 0), min(j + 2, n)):
                other = p * n + q
                length = here + half_steps[int(p != i and q != j)] * (own + price[other])
                if not length < flat[other]:
                    continue
                flat[other] = length
                if queue.bucket[other] >= 0:
                    _remove(queue, other)
                    waiting -= 1
                rest = np.sqrt(np.float32((p - a0) * (p - a0) + (q - a1) * (q - a1)))
                _push(queue, other, max(now, int(length + rest)) & ring)
                waiting += 1


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


@inlined_kernel
def _push(queue: Queue, cell: int, slot: int) -> None:
    """Put a cell at the head of a bucket."""
    head = queue.heads[slot]
    queue.before[cell], queue.after[cell], queue.bucket[cell] = -1, head, slot
    if head >= 0:
        queue.before[head] = cell
    queue.heads[slot] = cell


@inlined_kernel
def _remove(queue: Queue, cell: int) -> None:
    """Take a cell out of its bucket."""
    left, right = queue.before[cell], queue.after[cell]
    if left >= 0:
        queue.after[left] = right
    else:
        queue.heads[queue.bucket[cell]] = right
    if right >= 0:
        queue.before[right] = left
    queue.bucket[cell] = -1
