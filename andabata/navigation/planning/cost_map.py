"""Cost map: clearance from obstacles, and what a metre costs, in each cell of an occupancy grid.

Costs follow the layered costmaps of mobile robots (inscribed and inflation radius).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field

from andabata.navigation.planning.chamfer import inflate
from andabata.navigation.planning.geofence_bounds import GeofenceBounds, clear_outside
from terrain.kernel import kernel


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


class CostMap:
    """Clearances and costs of the cells of a square around the robot, in the square's own order.

    Attributes:
        weights: Costs of a metre.
        clearance: Distance from the nearest obstacle, in cells, float32, shape (n, n).
        traversed_clearance: Clearance, raised where the robot came through: enough to drive there,
            not to turn on the spot. In cells, float32, shape (n, n).
        costs: Cost of a cell's length in each cell, float32, shape (n, n).
        prior: Extra cost of a cell's length where it is unknown, from what was known beforehand;
            zero unless somebody writes it, float32, shape (n, n).
    """

    def __init__(self, cells: int, cell: float, weights: CostWeights, passage: Passage) -> None:
        """Allocate memory for a square.

        Args:
            cells: Number of cells along its edge.
            cell: Edge of a cell [m].
            weights: Costs of a metre.
            passage: Clearance where the robot has driven [m].
        """
        self._cell = cell
        self.weights = weights
        self._passage = Passage(*(length / cell for length in passage))
        shape = (cells, cells)
        self.clearance = np.zeros(shape, dtype=np.float32)
        self.traversed_clearance = np.zeros(shape, dtype=np.float32)
        self.costs = np.zeros(shape, dtype=np.float32)
        self.prior = np.zeros(shape, dtype=np.float32)
        self._log_odds = np.zeros(shape, dtype=np.float32)

    def update(
        self,
        log_odds: NDArray[np.float32],
        centre: NDArray[np.int64],
        bounds: GeofenceBounds,
        hits: NDArray[np.float32] | None = None,
    ) -> None:
        """Compute clearances and costs.

        Args:
            log_odds: Occupancy, wrapped around, float32, shape (n, n).
            centre: Cell of the robot, counted from the origin of ``odom``, shape (2,).
            bounds: Bounds of the geofence, outside of which all is obstacles.
            hits: Place of the obstacle in each cell, from the cell's corner, in cells, wrapped
                around, float32, shape (n, n, 2). Clearances are then the distances from these
                places; None takes the middles of cells and the chamfer transform.
        """
        cell, weights, known = self._cell, self.weights, self._log_odds
        far = float(np.float32(weights.inflation_radius / cell))
        _unwrap(log_odds, centre, known)
        lethal = weights.lethal_log_odds
        _mark(known, lethal if hits is None else np.inf, far, self.clearance)
        clear_outside(self.clearance, centre, cell, bounds)
        if hits is None:
            is_near = inflate(self.clearance, far)
        else:
            _inflate_hits(known, hits, centre, lethal, far, self.clearance)
            is_near = np.ones(len(known), dtype=np.bool_)
        _price(known, self.prior, self.clearance, is_near, cell, weights, self.costs)
        _widen_where_driven(
            *(known, weights.max_log_odds, self._passage),
            *(self.clearance, self.traversed_clearance),
        )

    def take(self, log_odds: NDArray[np.float32], clearance: NDArray[np.float32]) -> None:
        """Take clearances that are known, and compute costs.

        Args:
            log_odds: Occupancy in the square's own order, float32, shape (n, n).
            clearance: Distance from the nearest obstacle [m], float32, shape (n, n).
        """
        # In cells, as ``update`` has it: what is rounded must not count as near.
        far = np.float32(self.weights.inflation_radius / self._cell)
        self.clearance[:] = np.minimum(clearance / np.float32(self._cell), far)
        self.traversed_clearance[:] = self.clearance
        is_near = np.ones(len(clearance), dtype=np.bool_)
        prior, cell = self.prior, self._cell
        _price(log_odds, prior, self.clearance, is_near, cell, self.weights, self.costs)


@kernel
def _unwrap(
    log_odds: NDArray[np.float32], centre: NDArray[np.int64], unwrapped: NDArray[np.float32]
) -> None:
    """Write log odds in the square's own order, which begins at its corner."""
    n = len(log_odds)
    low0, low1 = (centre[0] - n // 2) & (n - 1), (centre[1] - n // 2) & (n - 1)
    for i in range(n):
        row = (low0 + i) & (n - 1)
        # Two loops over neighbours in memory are five times as fast as one that wraps around.
        for j in range(n - low1):
            unwrapped[i, j] = log_odds[row, low1 + j]
        for j in range(low1):
            unwrapped[i, n - low1 + j] = log_odds[row, j]


@kernel
def _mark(
    log_odds: NDArray[np.float32], lethal: float, far: float, clearance: NDArray[np.float32]
) -> None:
    """Write 0 into the clearance of obstacles, and the largest into that of all else."""
    for i in range(len(log_odds)):
        for j in range(len(log_odds)):
            # What is no number is no obstacle.
            clearance[i, j] = 0.0 if log_odds[i, j] > lethal else far


@kernel
def _is_edge(clearance: NDArray[np.float32], i: int, j: int) -> bool:
    """Return True if one of the four next cells has a clearance."""
    n = len(clearance)
    return (
        (i > 0 and clearance[i - 1, j] > 0.0)
        or (i < n - 1 and clearance[i + 1, j] > 0.0)
        or (j > 0 and clearance[i, j - 1] > 0.0)
        or (j < n - 1 and clearance[i, j + 1] > 0.0)
    )


@kernel
def _inflate_hits(
    log_odds: NDArray[np.float32],
    hits: NDArray[np.float32],
    centre: NDArray[np.int64],
    lethal: float,
    far: float,
    clearance: NDArray[np.float32],
) -> None:
    """Lower clearances like ``inflate``, from places within cells.

    A laser's hits are few: each lowers the clearances around it. The geofence's cells count by
    their middles.
    """
    n = len(log_odds)
    low0, low1 = centre[0] - n // 2, centre[1] - n // 2
    for i in range(n):
        for j in range(n):
            if log_odds[i, j] > lethal:
                row, column = (low0 + i) & (n - 1), (low1 + j) & (n - 1)
                _lower(clearance, i + hits[row, column, 0], j + hits[row, column, 1], far)
            elif clearance[i, j] == 0.0 and _is_edge(clearance, i, j):
                _lower(clearance, i + 0.5, j + 0.5, far)


@kernel
def _lower(clearance: NDArray[np.float32], x: float, y: float, far: float) -> None:
    """Lower clearances to the distance from an obstacle at a place, all in cells."""
    n = len(clearance)
    for i in range(max(int(x - far), 0), min(int(x + far) + 1, n)):
        for j in range(max(int(y - far), 0), min(int(y + far) + 1, n)):
            away = np.sqrt((i + 0.5 - x) ** 2 + (j + 0.5 - y) ** 2)
            clearance[i, j] = min(clearance[i, j], np.float32(away))


@kernel
def _price(
    log_odds: NDArray[np.float32],
    prior: NDArray[np.float32],
    clearance: NDArray[np.float32],
    is_near: NDArray[np.bool_],
    cell: float,
    weights: CostWeights,
    costs: NDArray[np.float32],
) -> None:
    """Write the cost of each cell; rows that are not near any obstacle need fewer divisions."""
    for i in range(len(costs)):
        if is_near[i]:
            for j in range(len(costs)):
                known, near = log_odds[i, j], float(clearance[i, j] * cell)
                costs[i, j] = _cost(known, prior[i, j], near, weights)
        else:
            for j in range(len(costs)):
                costs[i, j] = _cost_in_the_open(log_odds[i, j], prior[i, j], weights)


@kernel
def _cost(log_odds: float, prior: float, clearance: float, weights: CostWeights) -> float:
    """Return the cost of a metre at a clearance [m] with some log odds."""
    cost = _cost_in_the_open(log_odds, prior, weights)
    # Where the robot has driven it can drive, however narrow it is there.
    if log_odds <= -np.float32(weights.max_log_odds):
        return cost
    inscribed, inflation = weights.inscribed_radius, weights.inflation_radius
    if clearance < inscribed:
        cost += weights.inscribed_cost * (2.0 - clearance / inscribed)
    if clearance < inflation:
        falling = (inflation - clearance) / (inflation - inscribed)
        cost += weights.inflation_cost * min(1.0, falling)
    return cost


@kernel
def _cost_in_the_open(log_odds: float, prior: float, weights: CostWeights) -> float:
    """Return the cost of a metre far from all obstacles."""
    cost = 1.0
    if log_odds == 0.0:
        cost += weights.unknown_cost + prior
    elif log_odds > 0.0:
        share = log_odds / weights.lethal_log_odds
        sure = weights.lethal_cost * max(share - 1.0, 0.0)
        cost += weights.uncertain_cost * min(share, 1.0) + sure
    return cost


@kernel
def _widen_where_driven(
    log_odds: NDArray[np.float32],
    max_log_odds: float,
    passage: Passage,
    clearance: NDArray[np.float32],
    traversed: NDArray[np.float32],
) -> None:
    """Write the clearance, raised where the robot has driven and its body is gone.

    Log odds there are -1 to -2 times the largest, the more the nearer the robot's middle was.
    """
    n = len(clearance)
    for i in range(n):
        driven = 0
        for j in range(n):
            traversed[i, j] = clearance[i, j]
            driven += log_odds[i, j] <= -max_log_odds
        # Few cells are driven on, in few rows: only these are looked at one by one.
        for j in range(n if driven else 0):
            known = log_odds[i, j]
            if not (known <= -max_log_odds and clearance[i, j] > 0):
                continue
            if np.hypot(i - n // 2, j - n // 2) > passage.behind:
                off = (2.0 + known / max_log_odds) * passage.driven_radius
                traversed[i, j] = max(clearance[i, j], np.float32(passage.clearance - off))
