"""A plan over a local map: what a metre costs, and what the way to the goal costs from where."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

_DETOUR = 1.05
"""A straight line that costs this much more than the path is as good [and a cell more]."""

EVERYWHERE = np.array([1.0, 0.0, 0.0, 0.0, -np.inf, -np.inf, np.inf, np.inf])
"""A fence that keeps nobody in: turn and shift from ``odom`` to the map, and bounds there."""


class CostWeights(NamedTuple):
    """What the cost of a metre depends on; see ``LocalPlannerConfig``."""

    wall: float
    room: float
    shy: float
    tight: float
    crowd: float
    unseen: float
    doubt: float
    sure: float
    certain: float

    @property
    def most(self) -> float:
        """The highest cost of a cell's length."""
        walled = self.doubt + self.sure * max(self.certain / self.wall - 1.0, 0.0)
        return 1.0 + max(self.unseen, walled) + 2.0 * self.tight + self.crowd


class GridPlanner:
    """The way to the goal over the square of a local map.

    Attributes:
        prices: Of a metre.
        gaps: Distance from the nearest wall, in cells, shape (n, n).
        rooms: The same, and more where the robot came through, whatever stands beside its way: room
            to drive and not to turn on the spot. In cells, shape (n, n).
        costs: Of a cell's length in each cell, shape (n, n).
        onward: Cost of the way to the goal, in cells, around the robot; infinite where nobody
            looked, float32, shape (n, n).
        corner: Place of the first cell's corner, in ``odom`` [m], shape (2,).
        end: Goal in ``odom`` [m], shape (2,). Beyond the square the way to it is ground that nobody
            has seen, as the crow flies.
    """

    def __init__(
        self,
        cells: int,
        cell: float,
        prices: CostWeights,
        spans: tuple[float, float],
        around: float,
        passage: tuple[float, float, float],
    ) -> None:
        """Prepare for a square.

        Args:
            cells: Along its edge.
            cell: Edge of a cell [m].
            prices: Of a metre.
            spans: Nearest and farthest sub-goal [m].
            around: The way is known wherever it costs no more than the best one and this [m].
            passage: Room where the middle of the robot has been, how far from it ground counts as
                driven, and how far the robot is past a place that it has come through [m].
        """
        self._cell = cell
        self.prices = prices
        self._spans = (spans[0] / cell, spans[1] / cell)
        room, under, past = passage
        self._passage = (room / cell, under / cell, past / cell)
        self._around = around / cell
        self.gaps = np.zeros((cells, cells), dtype=np.float32)
        self.rooms = np.zeros((cells, cells), dtype=np.float32)
        self.onward = np.zeros((cells, cells), dtype=np.float32)
        self.costs = np.zeros((cells, cells), dtype=np.float32)
        # Neighbours in the queue before and after each cell, and the bucket that it waits in.
        self._links = np.zeros((3, cells * cells), dtype=np.int32)
        # A cell waits at most the dearest step behind the one that is taken, one of the square's
        # edge at most as far as the way along the edge and back to the robot.
        step = math.sqrt(2.0) * max(prices.most + 1.0, (2.0 + prices.unseen) * cells)
        self._buckets = np.zeros(1 << math.ceil(math.log2(step + 2.0)), dtype=np.int32)
        self.reset()

    def reset(self) -> None:
        """Forget where the square was."""
        self.corner: NDArray[np.float64] = np.zeros(2)
        self.end: NDArray[np.float64] = np.zeros(2)

    def make(
        self,
        evidence: NDArray[np.float32],
        centre: NDArray[np.int64],
        fence: NDArray[np.float64],
        here: NDArray[np.float64],
        goal: NDArray[np.float64],
    ) -> NDArray[np.float64] | None:
        """Return where to head for in ``odom`` [m]; None is the goal itself, straight and free.

        Args:
            evidence: For walls, shape (n, n), wrapped around.
            centre: The robot's cell, counted from the origin of ``odom``, shape (2,).
            fence: Turn and shift from ``odom`` to the map, and bounds there, shape (8,).
            here: Position of the robot in ``odom`` [m], shape (2,).
            goal: Goal in ``odom`` [m], shape (2,).
        """
        n, cell = len(self.costs), self._cell
        _keep_inside(centre, cell, fence, self.gaps)
        _price(evidence, centre, cell, self.prices, self.gaps, self.costs)
        _open(evidence, centre, self.prices.certain, self._passage, self.gaps, self.rooms)
        self.corner = np.asarray((centre - n / 2) * cell, dtype=np.float64)
        start = (here - self.corner) / cell
        self.end = np.asarray(goal, dtype=np.float64)
        # Goals like to lie on the edges of cells, where rounding must not choose.
        end = (goal - self.corner) / cell + 1e-6
        first = np.clip(start, 0, n - 1).astype(np.int64)
        last = np.floor(end).astype(np.int64)
        beyond = 1.0 + self.prices.unseen
        _spread(
            self.costs, self.onward, self._links, self._buckets, first, last, beyond, self._around
        )
        place = _farthest(self.costs, self.onward, start, first, last, self._spans)
        return None if place is None else self.corner + np.array(place) * cell


@kernel
def _keep_inside(centre, cell, fence, gaps):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write 0 into the gaps of cells beyond the fence, 1 into the others."""
    n = len(gaps)
    c, s, x0, y0, x_min, y_min, x_max, y_max = fence
    for i in range(n):
        for j in range(n):
            x = (centre[0] - n // 2 + i + 0.5) * cell
            y = (centre[1] - n // 2 + j + 0.5) * cell
            inside = x_min < c * x - s * y + x0 < x_max and y_min < s * x + c * y + y0 < y_max
            gaps[i, j] = np.float32(inside)


@kernel
def _price(evidence, centre, cell, prices, gaps, costs):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the cost of a cell's length in each cell of the square, in its own order.

    Where ``gaps`` is zero there is a wall already. Where the robot has driven it can drive, however
    narrow it is there.
    """
    n = len(evidence)
    wall, room, shy, tight, crowd, unseen, doubt, sure, certain = prices
    driven = -np.float32(certain)
    far = np.float32(shy / cell)
    aslant = np.float32(np.sqrt(2.0))
    one = np.float32(1.0)
    low0, low1 = centre[0] - n // 2, centre[1] - n // 2
    for i in range(n):
        row = (low0 + i) & (n - 1)
        for j in range(n):
            gap = np.float32(0.0)
            if gaps[i, j] > 0 and not evidence[row, (low1 + j) & (n - 1)] > wall:
                gap = far
            if gap > 0:
                if j > 0:
                    gap = min(gap, gaps[i, j - 1] + one)
                if i > 0:
                    gap = min(gap, gaps[i - 1, j] + one)
                    if j > 0:
                        gap = min(gap, gaps[i - 1, j - 1] + aslant)
                    if j < n - 1:
                        gap = min(gap, gaps[i - 1, j + 1] + aslant)
            gaps[i, j] = gap
    for i in range(n - 1, -1, -1):
        for j in range(n - 1, -1, -1):
            gap = gaps[i, j]
            if gap > 0:
                if j < n - 1:
                    gap = min(gap, gaps[i, j + 1] + one)
                if i < n - 1:
                    gap = min(gap, gaps[i + 1, j] + one)
                    if j < n - 1:
                        gap = min(gap, gaps[i + 1, j + 1] + aslant)
                    if j > 0:
                        gap = min(gap, gaps[i + 1, j - 1] + aslant)
                gaps[i, j] = gap
            metres = gap * cell
            cost = 1.0
            known = evidence[(low0 + i) & (n - 1), (low1 + j) & (n - 1)]
            if known == 0.0:
                cost += unseen
            elif known > 0.0:
                cost += doubt * min(known / wall, 1.0) + sure * max(known / wall - 1.0, 0.0)
            if metres < room:
                cost += tight * (2.0 - metres / room)
            if metres < shy:
                cost += crowd * min(1.0, (shy - metres) / (shy - room))
            costs[i, j] = 1.0 if known <= driven else cost


@kernel
def _open(evidence, centre, certain, passage, gaps, rooms):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write the rooms: gaps, raised where the robot has driven.

    Log odds there is -1 to -2 times certainty, the more the nearer the middle of the robot was.
    """
    n = len(gaps)
    room, under, past = passage
    low0, low1 = centre[0] - n // 2, centre[1] - n // 2
    for i in range(n):
        for j in range(n):
            known = evidence[(low0 + i) & (n - 1), (low1 + j) & (n - 1)]
            rooms[i, j] = gaps[i, j]
            if known <= -certain and gaps[i, j] > 0 and np.hypot(i - n // 2, j - n // 2) > past:
                off = (2.0 + known / certain) * under
                rooms[i, j] = max(gaps[i, j], np.float32(room - off))


@kernel
def _spread(costs, onward, links, buckets, first, last, beyond, around):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Write what the way to the last cell costs into those between it and the first, and around.

    A last cell beyond the square is reached from every cell of its edge, at the price of ground
    that nobody has seen. The search is A*, from the goal to the robot, so that the path is read off
    from the robot on. Its queue is a ring of buckets a cell's length wide (Dial 1969), each a list
    linked both ways, from which a cell that gets cheaper moves without a trace. A cell that gets
    cheaper after it was taken is taken again: the costs are exact.
    """
    n, ring = len(costs), len(buckets) - 1
    before, after, bucket = links
    flat, price = onward.ravel(), costs.ravel()
    flat[:] = np.inf
    buckets[:] = -1
    bucket[:] = -1
    a0, a1 = first
    inside = 0 <= last[0] < n and 0 <= last[1] < n
    waiting = 1 if inside else 4 * (n - 1)
    now = 1 << 30
    for k in range(waiting):
        i, j = (last[0], last[1]) if inside else _at_the_edge(k, n)
        cell = i * n + j
        flat[cell] = np.float32(beyond * np.hypot(last[0] - i, last[1] - j))
        slot = int(flat[cell] + np.hypot(np.float32(i - a0), np.float32(j - a1)))
        _enter(buckets, before, after, bucket, cell, slot & ring)
        now = min(now, slot)
    most = np.float32(np.inf)
    steps = (np.float32(0.5), np.float32(0.5 * np.sqrt(2.0)))
    while waiting:
        while buckets[now & ring] < 0:
            now += 1
        if now > most:
            break
        cell = buckets[now & ring]
        _leave(buckets, before, after, bucket, cell)
        waiting -= 1
        i, j = cell // n, cell % n
        here, own = flat[cell], price[cell]
        if i == a0 and j == a1:
            most = here + np.float32(around)
        for p in range(max(i - 1, 0), min(i + 2, n)):
            for q in range(max(j - 1, 0), min(j + 2, n)):
                other = p * n + q
                length = here + steps[int(p != i and q != j)] * (own + price[other])
                if not length < flat[other]:
                    continue
                flat[other] = length
                if bucket[other] >= 0:
                    _leave(buckets, before, after, bucket, other)
                    waiting -= 1
                rest = np.sqrt(np.float32((p - a0) * (p - a0) + (q - a1) * (q - a1)))
                slot = max(now, int(length + rest)) & ring
                _enter(buckets, before, after, bucket, other, slot)
                waiting += 1


@kernel
def _at_the_edge(k, n):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the k-th cell of the way around the square."""
    side, along = k // (n - 1), k % (n - 1)
    if side == 0:
        return 0, along
    if side == 1:
        return along, n - 1
    if side == 2:
        return n - 1, n - 1 - along
    return n - 1 - along, 0


@kernel
def _enter(buckets, before, after, bucket, cell, slot):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Put a cell at the head of a bucket."""
    head = buckets[slot]
    before[cell], after[cell], bucket[cell] = -1, head, slot
    if head >= 0:
        before[head] = cell
    buckets[slot] = cell


@kernel
def _leave(buckets, before, after, bucket, cell):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Take a cell out of its bucket."""
    left, right = before[cell], after[cell]
    if left >= 0:
        after[left] = right
    else:
        buckets[bucket[cell]] = right
    if right >= 0:
        before[right] = left
    bucket[cell] = -1


@kernel
def _farthest(costs, onward, start, first, last, spans):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the farthest place of the best path that can be headed for, None for its end."""
    n = len(costs)
    near, reach = spans
    i, j = first
    whole = onward[i, j]
    goal = (last[0] + 0.5, last[1] + 0.5)
    inside = 0 <= last[0] < n and 0 <= last[1] < n
    if inside and _straight(costs, start, goal) <= _DETOUR * whole + 1.0:
        return None
    best = (start[0], start[1])
    while (i != last[0] or j != last[1]) and (inside or (0 < i < n - 1 and 0 < j < n - 1)):
        # The next cell of the path is the one from which the rest, and the step to it, cost least.
        least, to = np.inf, (i, j)
        for p in range(max(i - 1, 0), min(i + 2, n)):
            for q in range(max(j - 1, 0), min(j + 2, n)):
                step = np.hypot(np.float64(p - i), np.float64(q - j))
                cost = onward[p, q] + step * 0.5 * (costs[i, j] + costs[p, q])
                if step > 0 and cost < least:
                    least, to = cost, (p, q)
        i, j = to
        place = (i + 0.5, j + 0.5)
        far = np.hypot(place[0] - start[0], place[1] - start[1])
        if far > reach:
            return best
        spent = whole - onward[i, j]
        if far < near or _straight(costs, start, place) <= _DETOUR * spent + 1.0:
            best = place
    return None if best == goal else best


@kernel
def _straight(costs, start, place):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    """Return the cost of the straight line between two places."""
    far = np.hypot(place[0] - start[0], place[1] - start[1])
    steps = int(2 * far) + 1
    total = 0.0
    for k in range(steps):
        share = (k + 0.5) / steps
        x = start[0] + share * (place[0] - start[0])
        y = start[1] + share * (place[1] - start[1])
        total += costs[int(x), int(y)]
    return total * far / steps
