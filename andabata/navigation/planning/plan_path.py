"""Path of a plan: the cells that the cost to go leads through, from the robot to the goal."""

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.planning.grid_planner import GridPlanner
from terrain.kernel import kernel


def path_of(plan: GridPlanner, cell: float, position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the way to the goal that a plan prefers.

    It ends at the goal; where the goal is beyond the square, straight on from the square's edge, as
    the plan counts it.

    Args:
        plan: Plan of the occupancy grid around the robot.
        cell: Edge of a cell [m].
        position: Position of the robot in ``odom`` [m], shape (2,).

    Returns:
        Places in ``odom`` [m], the robot's first, shape (k, 2); without rows where the plan does
        not know the robot's place.
    """
    n = len(plan.costs)
    start = np.floor((position - plan.corner) / cell).astype(np.int64)
    if (start < 0).any() or (start >= n).any():
        return np.empty((0, 2))  # A plan of another place.
    last = np.floor((plan.goal - plan.corner) / cell).astype(np.int64)
    cells = _downhill(plan.costs, plan.cost_to_go, start, last)
    if not plan.costs[start[0], start[1]] > 0.0:
        return np.empty((0, 2))  # No plan yet: all costs are zero.
    middles = plan.corner + (cells[1:-1] + 0.5) * cell
    return np.concatenate([position[None], middles, plan.goal[None]])


@kernel
def _downhill(
    costs: NDArray[np.float32],
    cost_to_go: NDArray[np.float32],
    start: NDArray[np.int64],
    last: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Return the cells from a start to the goal's or to the edge, shape (k, 2).

    As in the planner's own search for a sub-goal, the next cell is the one from which the rest, and
    the step to it, cost least.
    """
    n = len(costs)
    cells = np.empty((n * n, 2), dtype=np.int64)
    i, j = start
    cells[0] = start
    count = 1
    while i != last[0] or j != last[1]:
        least, p_next, q_next = np.inf, i, j
        for p in range(max(i - 1, 0), min(i + 2, n)):
            for q in range(max(j - 1, 0), min(j + 2, n)):
                step = np.hypot(np.float64(p - i), np.float64(q - j))
                cost = cost_to_go[p, q] + step * 0.5 * (costs[i, j] + costs[p, q])
                if step > 0 and cost < least:
                    least, p_next, q_next = cost, p, q
        # Costs to go fall along the way; where they do not, the search has not been there.
        if not cost_to_go[p_next, q_next] < cost_to_go[i, j] or count == n * n:
            break
        i, j = p_next, q_next
        cells[count, 0], cells[count, 1] = i, j
        count += 1
        if i == 0 or j == 0 or i == n - 1 or j == n - 1:
            break
    return cells[:count]
