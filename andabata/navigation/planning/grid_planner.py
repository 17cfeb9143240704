"""Shortest path over the occupancy grid: cost of every cell, cost to go, and a sub-goal on the way.

Costs follow the layered costmaps of mobile robots (inscribed and inflation radius). The cost to go
is exact around the robot, and the path is read off from there.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.navigation.planning.cost_to_go import queue_for, search
from terrain.kernel import kernel
from worlds.world import Geofence

_DETOUR = 1.05
"""Ratio of a straight line's cost to the path's (and a cell more) up to which both are as good."""

_GOAL_SHIFT = 1e-6
"""Shift of the goal, in cells: goals like to lie on the edges of cells, where rounding must not
choose."""


class CostConfig(BaseModel):
    """Costs of a metre; free ground costs one.

    Attributes:
        inscribed_radius: Distance from obstacles that the path keeps where it can [m].
        inflation_radius: Distance from obstacles at which a metre costs no more [m].
        inscribed_cost: Extra cost of a metre nearer to obstacles than ``inscribed_radius``.
        inflation_cost: Extra cost of a metre at ``inscribed_radius``, falling to none at
            ``inflation_radius``.
        unknown_cost: Extra cost of a metre where no scan has seen anything.
        uncertain_cost: Extra cost of a metre whose log odds are almost lethal.
        lethal_cost: Extra cost of a metre with as much log odds again: an obstacle that was seen
            from near is not tried twice.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    inscribed_radius: float = Field(default=0.5, ge=0)
    inflation_radius: float = Field(default=1.3, gt=0)
    inscribed_cost: float = Field(default=15.0, ge=0)
    inflation_cost: float = Field(default=2.0, ge=0)
    unknown_cost: float = Field(default=0.5, ge=0)
    uncertain_cost: float = Field(default=3.0, ge=0)
    lethal_cost: float = Field(default=50.0, ge=0)


class CostWeights(NamedTuple):
    """Numbers of ``CostConfig`` and of the occupancy grid that the compiled costs depend on.

    Attributes:
        lethal_log_odds: Log odds above which a cell is an obstacle.
        max_log_odds: Largest log odds.
        inscribed_radius: Distance from obstacles that the path keeps where it can [m].
        inflation_radius: Distance from obstacles at which a metre costs no more [m].
        inscribed_cost: Extra cost of a metre nearer than ``inscribed_radius``.
        inflation_cost: Extra cost of a metre at ``inscribed_radius``.
        unknown_cost: Extra cost of an unknown metre.
        uncertain_cost: Extra cost of an almost lethal metre.
        lethal_cost: Extra cost of a metre of twice the lethal log odds.
    """

    lethal_log_odds: float
    max_log_odds: float
    inscribed_radius: float
    inflation_radius: float
    inscribed_cost: float
    inflation_cost: float
    unknown_cost: float
    uncertain_cost: float
    lethal_cost: float

    @classmethod
    def of(cls, costs: CostConfig, lethal_log_odds: float, max_log_odds: float) -> "CostWeights":
        """Return the weights of a configuration."""
        return cls(
            lethal_log_odds=lethal_log_odds,
            max_log_odds=max_log_odds,
            inscribed_radius=costs.inscribed_radius,
            inflation_radius=costs.inflation_radius,
            inscribed_cost=costs.inscribed_cost,
            inflation_cost=costs.inflation_cost,
            unknown_cost=costs.unknown_cost,
            uncertain_cost=costs.uncertain_cost,
            lethal_cost=costs.lethal_cost,
        )

    @property
    def highest(self) -> float:
        """The highest cost of a cell's length."""
        sure = max(self.max_log_odds / self.lethal_log_odds - 1.0, 0.0)
        occupied = self.uncertain_cost + self.lethal_cost * sure
        around = 2.0 * self.inscribed_cost + self.inflation_cost
        return 1.0 + max(self.unknown_cost, occupied) + around


class Passage(NamedTuple):
    """Room that the robot has had where it drove, whatever stands beside its way.

    Attributes:
        clearance: Clearance where the middle of the robot has been [cells].
        driven_radius: Distance from the middle within which ground counts as driven [cells].
        behind: Distance beyond which a place is behind the robot's body [cells].
    """

    clearance: float
    driven_radius: float
    behind: float


class GeofenceBounds(NamedTuple):
    """A geofence seen from ``odom``.

    Attributes:
        c: Cosine of the turn from ``odom`` to the map.
        s: Sine of that turn.
        x: Shift along x [m].
        y: Shift along y [m].
        x_min: Bound in the map [m].
        y_min: Bound in the map [m].
        x_max: Bound in the map [m].
        y_max: Bound in the map [m].
    """

    c: float
    s: float
    x: float
    y: float
    x_min: float
    y_min: float
    x_max: float
    y_max: float


EVERYWHERE = GeofenceBounds(1.0, 0.0, 0.0, 0.0, -math.inf, -math.inf, math.inf, math.inf)
"""Bounds of a geofence that holds everything."""


def geofence_in_odom(
    geofence: Geofence | None, turn: float = 0.0, shift: tuple[float, float] = (0.0, 0.0)
) -> GeofenceBounds:
    """Return a geofence of the map as it lies in ``odom``.

    Args:
        geofence: Bounds in the map [m]; None for none.
        turn: Yaw of the map's pose less that in ``odom`` [rad].
        shift: Origin of ``odom`` in the map [m].
    """
    if geofence is None:
        return EVERYWHERE
    return GeofenceBounds(math.cos(turn), math.sin(turn), *shift, *map(float, geofence))


class GridPlanner:
    """Plans the way to the goal over the square of an occupancy grid.

    Attributes:
        weights: Costs of a metre.
        clearance: Distance from the nearest obstacle, in cells, float32, shape (n, n).
        traversed_clearance: Clearance, raised where the robot came through: enough to drive there,
            not to turn on the spot. In cells, float32, shape (n, n).
        costs: Cost of a cell's length in each cell, float32, shape (n, n).
        cost_to_go: Cost of the way to the goal, in cells, around the robot; infinite where the
            search has not been, float32, shape (n, n).
        corner: Place of the first cell's corner, in ``odom`` [m], shape (2,).
        goal: Goal in ``odom`` [m], shape (2,). Beyond the square the way to it counts as unknown
            ground in a straight line.
    """

    def __init__(
        self,
        cells: int,
        cell: float,
        weights: CostWeights,
        lookahead: tuple[float, float],
        margin: float,
        passage: Passage,
    ) -> None:
        """Prepare for a square.

        Args:
            cells: Number of cells along its edge.
            cell: Edge of a cell [m].
            weights: Costs of a metre.
            lookahead: Nearest and farthest sub-goal [m].
            margin: The cost to go is known wherever it is no more than the robot's and this [m].
            passage: Clearance where the robot has driven [m].
        """
        self._cell = cell
        self.weights = weights
        self._lookahead = (lookahead[0] / cell, lookahead[1] / cell)
        self._passage = Passage(*(length / cell for length in passage))
        self._margin = margin / cell
        self.clearance = np.zeros((cells, cells), dtype=np.float32)
        self.traversed_clearance = np.zeros((cells, cells), dtype=np.float32)
        self.cost_to_go = np.zeros((cells, cells), dtype=np.float32)
        self.costs = np.zeros((cells, cells), dtype=np.float32)
        self._queue = queue_for(cells, weights.highest, 1.0 + weights.unknown_cost)
        self.reset()

    def reset(self) -> None:
        """Forget where the square was."""
        self.corner: NDArray[np.float64] = np.zeros(2)
        self.goal: NDArray[np.float64] = np.zeros(2)

    def plan(
        self,
        log_odds: NDArray[np.float32],
        centre: NDArray[np.int64],
        bounds: GeofenceBounds,
        position: NDArray[np.float64],
        goal: NDArray[np.float64],
        hits: NDArray[np.float32] | None = None,
    ) -> NDArray[np.float64] | None:
        """Return the sub-goal in ``odom`` [m]; None is the goal itself, straight and free.

        Args:
            log_odds: Occupancy, wrapped around, float32, shape (n, n).
            centre: Cell of the robot, counted from the origin of ``odom``, shape (2,).
            bounds: Bounds of the geofence.
            position: Position of the robot in ``odom`` [m], shape (2,).
            goal: Goal in ``odom`` [m], shape (2,).
            hits: Place of the obstacle in each cell, from the cell's corner, in cells, wrapped
                around, float32, shape (n, n, 2). Clearances are then the distances from these
                places; None takes the middles of cells and the chamfer transform.
        """
        n, cell, weights = len(self.costs), self._cell, self.weights
        # What a metre costs where.
        _apply_geofence(centre, cell, bounds, self.clearance)
        if hits is None:
            _inflate(log_odds, centre, cell, weights, self.clearance, self.costs)
        else:
            _inflate_hits(log_odds, hits, centre, cell, weights, self.clearance, self.costs)
        _widen_where_driven(
            *(log_odds, centre, weights.max_log_odds, self._passage),
            *(self.clearance, self.traversed_clearance),
        )
        # What the rest of the way costs from where.
        self.corner = np.asarray((centre - n / 2) * cell, dtype=np.float64)
        self.goal = np.asarray(goal, dtype=np.float64)
        start = (position - self.corner) / cell
        first = np.clip(start, 0, n - 1).astype(np.int64)
        last = np.floor((goal - self.corner) / cell + _GOAL_SHIFT).astype(np.int64)
        unknown = 1.0 + weights.unknown_cost
        search(self.costs, self.cost_to_go, self._queue, first, last, unknown, self._margin)
        # The farthest place of that way that is as good to head for in a straight line.
        place = _subgoal(self.costs, self.cost_to_go, start, first, last, self._lookahead)
        return None if place is None else self.corner + np.array(place) * cell

    def way(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the places of the last plan's path, from a place on, in ``odom`` [m].

        Args:
            position: Place in ``odom`` [m], shape (2,).

        Returns:
            Middles of cells up to the goal, or to the edge of the square, float64, shape (k, 2);
            empty before the first plan, and where its search has not been.
        """
        start = np.floor((position - self.corner) / self._cell).astype(np.int64)
        last = np.floor((self.goal - self.corner) / self._cell + _GOAL_SHIFT).astype(np.int64)
        n = len(self.costs)
        if (start < 0).any() or (start >= n).any():
            return np.empty((0, 2))
        # Before the first plan, too, so that a robot can have it compiled before it drives.
        cells = _way(self.costs, self.cost_to_go, start, last, 4 * n)
        if not self.costs.any():
            return np.empty((0, 2))
        return np.asarray(self.corner + (cells + 0.5) * self._cell)


@kernel
def _apply_geofence(
    centre: NDArray[np.int64], cell: float, bounds: GeofenceBounds, clearance: NDArray[np.float32]
) -> None:
    """Write 0 into the clearance of cells outside the geofence, 1 into the others."""
    n = len(clearance)
    for i in range(n):
        for j in range(n):
            # Middle of the cell in odom, then in the map, where the geofence is straight.
            x = (centre[0] - n // 2 + i + 0.5) * cell
            y = (centre[1] - n // 2 + j + 0.5) * cell
            map_x = bounds.c * x - bounds.s * y + bounds.x
            map_y = bounds.s * x + bounds.c * y + bounds.y
            inside = bounds.x_min < map_x < bounds.x_max and bounds.y_min < map_y < bounds.y_max
            clearance[i, j] = np.float32(inside)


@kernel
def _inflate(
    log_odds: NDArray[np.float32],
    centre: NDArray[np.int64],
    cell: float,
    weights: CostWeights,
    clearance: NDArray[np.float32],
    costs: NDArray[np.float32],
) -> None:
    """Write clearance and cost of each cell of the square, in its own order.

    Where ``clearance`` is zero there is an obstacle already, the geofence. Clearances are those of
    the chamfer transform (Borgefors 1986): two sweeps, each from the neighbours it has passed.
    """
    n = len(log_odds)
    straight = np.float32(1.0)
    diagonal = np.float32(np.sqrt(2.0))
    far = np.float32(weights.inflation_radius / cell)
    # Odom's cells are wrapped around: the square's own order begins at its corner.
    low0, low1 = centre[0] - n // 2, centre[1] - n // 2
    for i in range(n):
        row = (low0 + i) & (n - 1)
        for j in range(n):
            near = np.float32(0.0)
            known = log_odds[row, (low1 + j) & (n - 1)]
            # Not a NaN-safe "<=": what is no number is an obstacle's opposite.
            if clearance[i, j] > 0 and not known > weights.lethal_log_odds:
                near = far
            if near > 0:
                if j > 0:
                    near = min(near, clearance[i, j - 1] + straight)
                if i > 0:
                    near = min(near, clearance[i - 1, j] + straight)
                    if j > 0:
                        near = min(near, clearance[i - 1, j - 1] + diagonal)
                    if j < n - 1:
                        near = min(near, clearance[i - 1, j + 1] + diagonal)
            clearance[i, j] = near
    for i in range(n - 1, -1, -1):
        for j in range(n - 1, -1, -1):
            near = clearance[i, j]
            if near > 0:
                if j < n - 1:
                    near = min(near, clearance[i, j + 1] + straight)
                if i < n - 1:
                    near = min(near, clearance[i + 1, j] + straight)
                    if j < n - 1:
                        near = min(near, clearance[i + 1, j + 1] + diagonal)
                    if j > 0:
                        near = min(near, clearance[i + 1, j - 1] + diagonal)
                clearance[i, j] = near
            known = log_odds[(low0 + i) & (n - 1), (low1 + j) & (n - 1)]
            costs[i, j] = _cost(known, float(near * cell), weights)


@kernel
def _inflate_hits(
    log_odds: NDArray[np.float32],
    hits: NDArray[np.float32],
    centre: NDArray[np.int64],
    cell: float,
    weights: CostWeights,
    clearance: NDArray[np.float32],
    costs: NDArray[np.float32],
) -> None:
    """Write clearance and cost of each cell like ``_inflate``, from places within cells.

    A laser's hits are few: each lowers the clearances around it. The geofence's cells count by
    their middles.
    """
    n = len(log_odds)
    far = np.float32(weights.inflation_radius / cell)
    low0, low1 = centre[0] - n // 2, centre[1] - n // 2
    # Zero is outside of the geofence until the costs are written.
    for i in range(n):
        for j in range(n):
            clearance[i, j] *= far
    for i in range(n):
        row = (low0 + i) & (n - 1)
        for j in range(n):
            column = (low1 + j) & (n - 1)
            if log_odds[row, column] > weights.lethal_log_odds:
                _lower(clearance, i + hits[row, column, 0], j + hits[row, column, 1], float(far))
            elif clearance[i, j] == 0.0 and _is_edge(clearance, i, j):
                _lower(clearance, i + 0.5, j + 0.5, float(far))
    for i in range(n):
        for j in range(n):
            known = log_odds[(low0 + i) & (n - 1), (low1 + j) & (n - 1)]
            costs[i, j] = _cost(known, float(clearance[i, j] * cell), weights)


@kernel
def _lower(clearance: NDArray[np.float32], x: float, y: float, far: float) -> None:
    """Lower clearances to the distance from an obstacle at a place, all in cells."""
    n = len(clearance)
    for i in range(max(int(x - far), 0), min(int(x + far) + 1, n)):
        for j in range(max(int(y - far), 0), min(int(y + far) + 1, n)):
            away = np.sqrt((i + 0.5 - x) ** 2 + (j + 0.5 - y) ** 2)
            clearance[i, j] = min(clearance[i, j], np.float32(away))


@kernel
def _is_edge(clearance: NDArray[np.float32], i: int, j: int) -> bool:
    """Return True if a neighbour has a clearance."""
    for p in range(max(i - 1, 0), min(i + 2, len(clearance))):
        for q in range(max(j - 1, 0), min(j + 2, len(clearance))):
            if clearance[p, q] > 0.0:
                return True
    return False


@kernel
def _cost(log_odds: float, clearance: float, weights: CostWeights) -> float:
    """Return the cost of a metre at a clearance [m] with some log odds."""
    # Where the robot has driven it can drive, however narrow it is there.
    if log_odds <= -np.float32(weights.max_log_odds):
        return 1.0
    cost = 1.0
    if log_odds == 0.0:
        cost += weights.unknown_cost
    elif log_odds > 0.0:
        share = log_odds / weights.lethal_log_odds
        sure = weights.lethal_cost * max(share - 1.0, 0.0)
        cost += weights.uncertain_cost * min(share, 1.0) + sure
    inscribed, inflation = weights.inscribed_radius, weights.inflation_radius
    if clearance < inscribed:
        cost += weights.inscribed_cost * (2.0 - clearance / inscribed)
    if clearance < inflation:
        falling = (inflation - clearance) / (inflation - inscribed)
        cost += weights.inflation_cost * min(1.0, falling)
    return cost


@kernel
def _widen_where_driven(
    log_odds: NDArray[np.float32],
    centre: NDArray[np.int64],
    max_log_odds: float,
    passage: Passage,
    clearance: NDArray[np.float32],
    traversed: NDArray[np.float32],
) -> None:
    """Write the clearance, raised where the robot has driven and its body is gone.

    Log odds there are -1 to -2 times the largest, the more the nearer the robot's middle was.
    """
    n = len(clearance)
    low0, low1 = centre[0] - n // 2, centre[1] - n // 2
    for i in range(n):
        for j in range(n):
            known = log_odds[(low0 + i) & (n - 1), (low1 + j) & (n - 1)]
            traversed[i, j] = clearance[i, j]
            # Few cells are driven on: the distance is computed for them alone.
            if not (known <= -max_log_odds and clearance[i, j] > 0):
                continue
            if np.hypot(i - n // 2, j - n // 2) > passage.behind:
                off = (2.0 + known / max_log_odds) * passage.driven_radius
                traversed[i, j] = max(clearance[i, j], np.float32(passage.clearance - off))


@kernel
def _subgoal(
    costs: NDArray[np.float32],
    cost_to_go: NDArray[np.float32],
    start: NDArray[np.float64],
    first: NDArray[np.int64],
    last: NDArray[np.int64],
    lookahead: tuple[float, float],
) -> tuple[float, float] | None:
    """Return the farthest place of the best path that can be headed for, None for its end.

    A place can be headed for when the straight line to it costs hardly more than the path.
    """
    n = len(costs)
    near, reach = lookahead
    i, j = first
    whole = cost_to_go[i, j]
    goal = (last[0] + 0.5, last[1] + 0.5)
    inside = 0 <= last[0] < n and 0 <= last[1] < n
    if inside and _straight_cost(costs, start, goal) <= _DETOUR * whole + 1.0:
        return None
    best = (start[0], start[1])
    while (i != last[0] or j != last[1]) and (inside or (0 < i < n - 1 and 0 < j < n - 1)):
        i, j = _next_cell(costs, cost_to_go, i, j)
        place = (i + 0.5, j + 0.5)
        far = np.hypot(place[0] - start[0], place[1] - start[1])
        if far > reach:
            return best
        spent = whole - cost_to_go[i, j]
        # What lies within the turning circle cannot be headed for: nearer places count anyway.
        if far < near or _straight_cost(costs, start, place) <= _DETOUR * spent + 1.0:
            best = place
    return None if best == goal else best


@kernel
def _next_cell(
    costs: NDArray[np.float32], cost_to_go: NDArray[np.float32], i: int, j: int
) -> tuple[int, int]:
    """Return the next cell of the best path, from which the rest and the step there cost least."""
    n = len(costs)
    least, to = np.inf, (i, j)
    for p in range(max(i - 1, 0), min(i + 2, n)):
        for q in range(max(j - 1, 0), min(j + 2, n)):
            step = np.hypot(np.float64(p - i), np.float64(q - j))
            cost = cost_to_go[p, q] + step * 0.5 * (costs[i, j] + costs[p, q])
            if step > 0 and cost < least:
                least, to = cost, (p, q)
    return to


@kernel
def _way(
    costs: NDArray[np.float32],
    cost_to_go: NDArray[np.float32],
    first: NDArray[np.int64],
    last: NDArray[np.int64],
    most: int,
) -> NDArray[np.int64]:
    """Return the cells of the best path from one cell to another, shape (k, 2), k up to ``most``.

    It ends at the edge of the square, and where it would turn back: costs may be of a moment ago.
    """
    n = len(costs)
    found = np.empty((most, 2), dtype=np.int64)
    i, j = first
    count = 0
    while count < most and np.isfinite(cost_to_go[i, j]):
        found[count, 0], found[count, 1] = i, j
        count += 1
        at_edge = not (0 < i < n - 1 and 0 < j < n - 1)
        if (i == last[0] and j == last[1]) or at_edge:
            break
        p, q = _next_cell(costs, cost_to_go, i, j)
        if not cost_to_go[p, q] < cost_to_go[i, j]:
            break
        i, j = p, q
    return found[:count]


@kernel
def _straight_cost(
    costs: NDArray[np.float32],
    start: NDArray[np.float64],
    place: tuple[float, float],
) -> float:
    """Return the cost of the straight line between two places."""
    far = np.hypot(place[0] - start[0], place[1] - start[1])
    steps = int(2 * far) + 1  # Two samples a cell.
    total = 0.0
    for k in range(steps):
        share = (k + 0.5) / steps
        x = start[0] + share * (place[0] - start[0])
        y = start[1] + share * (place[1] - start[1])
        total += costs[int(x), int(y)]
    return total * far / steps
