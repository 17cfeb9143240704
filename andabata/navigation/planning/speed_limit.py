"""Where a robot may drive faster than usual: over ground that is known to be free all along."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.planning.rollout_inputs import Place
from terrain.kernel import kernel


class SpeedLimit(NamedTuple):
    """Condition of a speed above the robot's usual one.

    Attributes:
        clearance: Least clearance all along the arc [cells].
        inscribed_radius: Inscribed radius of the plan [cells].
        inflation_radius: Inflation radius of the plan [cells].
        inflation_cost: Inflation cost of the plan.
    """

    clearance: float
    inscribed_radius: float
    inflation_radius: float
    inflation_cost: float


@kernel
def is_free(
    costs: NDArray[np.float32],
    clearance: NDArray[np.float32],
    speed: SpeedLimit,
    place: Place,
    turn: float,
    stride: float,
    points: int,
) -> bool:
    """Return True if all along an arc nothing but obstacles at some distance adds to the cost.

    Args:
        costs: Cost of a cell's length, float32, shape (n, n).
        clearance: Distance from the nearest obstacle [cells], float32, shape (n, n).
        speed: Condition of the speed.
        place: Pose at the begin of the arc.
        turn: Turn between two points [rad].
        stride: Distance between them [cells].
        points: Number of points.
    """
    x, y, yaw = place
    limit = len(costs) - 1
    span = speed.inflation_radius - speed.inscribed_radius
    for _ in range(points):
        x, y = x + stride * np.cos(yaw + turn / 2), y + stride * np.sin(yaw + turn / 2)
        yaw += turn
        i, j = min(max(int(x), 0), limit), min(max(int(y), 0), limit)
        if costs[i, j] <= 1.0:
            continue
        falling = min(max((speed.inflation_radius - clearance[i, j]) / span, 0.0), 1.0)
        inflation = speed.inflation_cost * falling
        if clearance[i, j] < speed.clearance or costs[i, j] > 1.0 + inflation + 1e-3:
            return False
    return True
