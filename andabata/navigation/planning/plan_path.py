"""Path of a plan: the places that the cost to go leads through, from the robot to the goal."""

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.planning.grid_planner import GridPlanner


def path_of(plan: GridPlanner, position: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the way to the goal that a plan prefers, with both its ends.

    It ends at the goal; where the goal is beyond the square, straight on from the square's edge, as
    the plan counts it.

    Args:
        plan: Plan of the occupancy grid around the robot.
        position: Position of the robot in ``odom`` [m], shape (2,).

    Returns:
        Places in ``odom`` [m], the robot's first, shape (k, 2); without rows where the plan does
        not know the robot's place.
    """
    middles = plan.way(position)
    if not len(middles):
        return middles
    return np.concatenate([position[None], middles[1:-1], plan.goal[None]])
