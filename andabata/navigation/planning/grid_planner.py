"""Shortest path over the occupancy grid: cost to go, and a sub-goal on the way.

The cost to go is exact around the robot, and the path is read off from there.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.planning.cost_map import CostMap, CostWeights, Passage
from andabata.navigation.planning.cost_to_go import edge_cells, search, search_for
from andabata.navigation.planning.geofence_bounds import GeofenceBounds
from andabata.navigation.planning.map_transform import MapTransform
from andabata.navigation.planning.prior_map import PriorMap
from terrain.kernel import kernel

_DETOUR = 1.05
"""Ratio of a straight line's cost to the path's (and a cell more) up to which both are as good."""

_GOAL_SHIFT = 1e-6
"""Shift of the goal, in cells: goals like to lie on the edges of cells, where rounding must not
choose."""


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
        search: Search of the cost to go, which can go on.
        map_of_odom: Transform from ``odom`` to the map, in which the prior map lies.
    """

    def __init__(
        self,
        cells: int,
        cell: float,
        weights: CostWeights,
        lookahead: tuple[float, float],
        margin: float,
        passage: Passage,
        prior: PriorMap | None = None,
    ) -> None:
        """Prepare for a square.

        Args:
            cells: Number of cells along its edge.
            cell: Edge of a cell [m].
            weights: Costs of a metre.
            lookahead: Nearest and farthest sub-goal [m].
            margin: The cost to go is known wherever it is no more than the robot's and this [m].
            passage: Clearance where the robot has driven [m].
            prior: Costs of the ground that were known beforehand; None for none.
        """
        self._cell = cell
        self.weights = weights
        self._lookahead = (lookahead[0] / cell, lookahead[1] / cell)
        self._margin = margin / cell
        self._map = CostMap(cells, cell, weights, passage)
        self.clearance = self._map.clearance
        self.traversed_clearance = self._map.traversed_clearance
        self.costs = self._map.costs
        self.cost_to_go = np.zeros((cells, cells), dtype=np.float32)
        self._prior, self._edge = prior, edge_cells(cells)
        steepest = 0.0 if prior is None else prior.highest
        unknown = 1.0 + weights.unknown_cost
        self.search = search_for(self.costs, self.cost_to_go, weights.highest, unknown, steepest)
        self.reset()

    def reset(self) -> None:
        """Forget where the square was."""
        self.corner: NDArray[np.float64] = np.zeros(2)
        self.goal: NDArray[np.float64] = np.zeros(2)
        self.map_of_odom = MapTransform()

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
        corner = np.asarray((centre - len(self.costs) / 2) * self._cell, dtype=np.float64)
        if self._prior is not None:
            self._prior.price_square(corner, self._cell, self.map_of_odom, self._map.prior)
        # What a metre costs where.
        self._map.update(log_odds, centre, bounds, hits)
        return self._head_for(corner, position, goal)

    def plan_known(
        self,
        log_odds: NDArray[np.float32],
        clearance: NDArray[np.float32],
        corner: NDArray[np.float64],
        position: NDArray[np.float64],
        goal: NDArray[np.float64],
    ) -> NDArray[np.float64] | None:
        """Return the sub-goal over ground whose clearances are known, like ``plan``.

        Args:
            log_odds: Occupancy in the square's own order, float32, shape (n, n).
            clearance: Distance from the nearest obstacle [m], float32, shape (n, n).
            corner: Place of the first cell's corner [m], shape (2,).
            position: Position of the robot [m], shape (2,).
            goal: Goal [m], shape (2,).
        """
        self._map.take(log_odds, clearance)
        return self._head_for(np.array(corner, dtype=np.float64), position, goal)

    def subgoal(self, position: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Return the sub-goal of a place by the last plan [m], like ``plan``.

        Args:
            position: Place to which the last search came [m], shape (2,).
        """
        cell, costs, first = self._cell, self.costs, self._cell_within(position)
        start, last = (position - self.corner) / cell, self._last_cell()
        # The farthest place of that way that is as good to head for in a straight line.
        place = _subgoal(costs, self.cost_to_go, start, first, last, self._lookahead)
        return None if place is None else self.corner + np.array(place) * cell

    def _head_for(
        self,
        corner: NDArray[np.float64],
        position: NDArray[np.float64],
        goal: NDArray[np.float64],
    ) -> NDArray[np.float64] | None:
        """Search the way to a goal and return the sub-goal."""
        self.corner, self.goal = corner, np.asarray(goal, dtype=np.float64)
        # What the rest of the way costs from where.
        self.search.first[:] = self._cell_within(position)
        if self._prior is not None:
            self.search.beyond[:] = self._costs_beyond(self._prior)
        search(self.search, self._last_cell(), self._margin)
        return self.subgoal(position)

    def _costs_beyond(self, prior: PriorMap) -> NDArray[np.float64]:
        """Return the costs of the ways from the square's edge to the goal by the prior map."""
        places = self.corner + (self._edge + 0.5) * self._cell
        costs = prior.costs_to(self.goal, places, self.map_of_odom) / self._cell
        unknown = self.search.unknown
        straight = (unknown + prior.outside) * np.hypot(*(self._last_cell() - self._edge).T)
        costs = np.where(np.isnan(costs), straight, costs)
        # Above that no cell of the edge is on the way, and the queue ends.
        return np.minimum(costs, costs.min() + 2 * unknown * len(self.costs))

    def _cell_within(self, position: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the cell of a place, the nearest of the square for places beyond it."""
        most, start = len(self.costs) - 1.0, (position - self.corner) / self._cell
        return np.array([int(min(max(value, 0.0), most)) for value in start.tolist()])

    def _last_cell(self) -> NDArray[np.int64]:
        """Return the cell of the goal, which may lie beyond the square."""
        return np.floor((self.goal - self.corner) / self._cell + _GOAL_SHIFT).astype(np.int64)

    def way(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the places of the last plan's path, from a place on, in ``odom`` [m].

        Args:
            position: Place in ``odom`` [m], shape (2,).

        Returns:
            Middles of cells up to the goal, or to the edge of the square, float64, shape (k, 2);
            empty before the first plan, and where its search has not been.
        """
        start = np.floor((position - self.corner) / self._cell).astype(np.int64)
        last, n = self._last_cell(), len(self.costs)
        if (start < 0).any() or (start >= n).any():
            return np.empty((0, 2))
        # Before the first plan, too, so that a robot can have it compiled before it drives.
        cells = _way(self.costs, self.cost_to_go, start, last, 4 * n)
        if not self.costs.any():
            return np.empty((0, 2))
        return np.asarray(self.corner + (cells + 0.5) * self._cell)


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
    path = np.empty((most, 2), dtype=np.int64)
    i, j = first
    count = 0
    while count < most and np.isfinite(cost_to_go[i, j]):
        path[count, 0], path[count, 1] = i, j
        count += 1
        at_edge = not (0 < i < n - 1 and 0 < j < n - 1)
        if (i == last[0] and j == last[1]) or at_edge:
            break
        p, q = _next_cell(costs, cost_to_go, i, j)
        if not cost_to_go[p, q] < cost_to_go[i, j]:
            break
        i, j = p, q
    return path[:count]


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
