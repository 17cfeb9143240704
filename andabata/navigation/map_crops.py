"""Crops of the robot's map, turned with the robot: what a policy sees of what the robot knows.

Channels are shares from 0 to 1 but for the last one of each crop, which tells how much nearer to
the goal a cell is than the robot, from -1 to 1.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

NEAR_CELLS, NEAR_CELL, NEAR_BEHIND = 48, 0.2, 3.0
"""Cells along the edge of the near crop, their edge [m], and its reach behind the robot [m]."""

FAR_CELLS, FAR_CELL, FAR_BEHIND = 32, 0.8, 9.6
"""The same of the far crop."""

NEAR_CHANNELS = ("blocked", "free", "unknown", "driven", "clearance", "nearer")
"""Channels of the near crop; unknown ground has never been seen, driven ground was under the body,
longer ago the less."""

FAR_CHANNELS = ("blocked", "free", "unknown", "clearance", "nearer")
"""Channels of the far crop: the most of what blocks in each of its cells, shares of free and
unknown cells, the least clearance."""

_PARTS = 5
"""Places of the map along each edge of a far cell: an obstacle of two cells is never missed."""

_GRADE = 8.0
"""Distance to or from the goal that counts as entirely nearer or farther [m]."""


class RobotMap(NamedTuple):
    """The planner's map around the robot in ``odom``, valid until its next scan.

    Attributes:
        log_odds: Log odds of each cell, wrapped around, float32, shape (n, n).
        centre: Cell of the robot, counted from the origin of ``odom``, shape (2,).
        clearance: Distance from the nearest obstacle [cells], float32, shape (n, n), in the order
            of the square of the last plan.
        corner: Place of that square's first cell's corner in ``odom`` [m], shape (2,).
        cell: Edge of a cell [m].
        lethal_log_odds: Log odds above which a cell is an obstacle.
        max_log_odds: Largest log odds; driven ground has less than minus that.
        far_clearance: Clearance from which on more does not matter [cells].
        target: Sub-goal of the last plan, or the goal, in ``odom`` [m], shape (2,).
    """

    log_odds: NDArray[np.float32]
    centre: NDArray[np.int64]
    clearance: NDArray[np.float32]
    corner: NDArray[np.float64]
    cell: float
    lethal_log_odds: float
    max_log_odds: float
    far_clearance: float
    target: NDArray[np.float64]


def near_crop(
    around: RobotMap, position: NDArray[np.float64], yaw: float, goal: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return the near crop, float32, shape (channels, 48, 48): rows ahead, columns to the left.

    Args:
        around: Map.
        position: Position of the robot in ``odom`` [m], shape (2,).
        yaw: Heading there [rad].
        goal: Goal in the robot's frame [m], shape (2,).
    """
    crop = np.empty((len(NEAR_CHANNELS), NEAR_CELLS, NEAR_CELLS), dtype=np.float32)
    _write_near(around, position, yaw, goal, crop)
    return crop


def far_crop(
    around: RobotMap, position: NDArray[np.float64], yaw: float, goal: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return the far crop, float32, shape (channels, 32, 32), like ``near_crop``."""
    crop = np.empty((len(FAR_CHANNELS), FAR_CELLS, FAR_CELLS), dtype=np.float32)
    _write_far(around, position, yaw, goal, crop)
    return crop


@kernel
def _write_near(
    around: RobotMap,
    position: NDArray[np.float64],
    yaw: float,
    goal: NDArray[np.float64],
    crop: NDArray[np.float32],
) -> None:
    """Write the channels of the near crop."""
    c, s = np.cos(yaw), np.sin(yaw)
    away, half = np.hypot(goal[0], goal[1]), NEAR_CELLS * NEAR_CELL / 2.0
    for row in range(NEAR_CELLS):
        ahead = (row + 0.5) * NEAR_CELL - NEAR_BEHIND
        for column in range(NEAR_CELLS):
            aside = (column + 0.5) * NEAR_CELL - half
            x, y = position[0] + c * ahead - s * aside, position[1] + s * ahead + c * aside
            known = _log_odds_at(around, x, y)
            crop[0, row, column] = _blocked(around, known)
            crop[1, row, column] = min(max(-known / around.max_log_odds, 0.0), 1.0)
            crop[2, row, column] = known == 0.0
            crop[3, row, column] = min(max(-known / around.max_log_odds - 1.0, 0.0), 1.0)
            crop[4, row, column] = _clearance_at(around, x, y)
            nearer = away - np.hypot(goal[0] - ahead, goal[1] - aside)
            crop[5, row, column] = min(max(nearer / _GRADE, -1.0), 1.0)


@kernel
def _write_far(
    around: RobotMap,
    position: NDArray[np.float64],
    yaw: float,
    goal: NDArray[np.float64],
    crop: NDArray[np.float32],
) -> None:
    """Write the channels of the far crop, each cell of nine places."""
    c, s = np.cos(yaw), np.sin(yaw)
    away, half = np.hypot(goal[0], goal[1]), FAR_CELLS * FAR_CELL / 2.0
    for row in range(FAR_CELLS):
        for column in range(FAR_CELLS):
            blocked, free, unknown, clearance = 0.0, 0.0, 0.0, 1.0
            for part in range(_PARTS * _PARTS):
                ahead = (row + (part // _PARTS + 0.5) / _PARTS) * FAR_CELL - FAR_BEHIND
                aside = (column + (part % _PARTS + 0.5) / _PARTS) * FAR_CELL - half
                x, y = position[0] + c * ahead - s * aside, position[1] + s * ahead + c * aside
                known = _log_odds_at(around, x, y)
                blocked = max(blocked, _blocked(around, known))
                free += known < 0.0
                unknown += known == 0.0
                clearance = min(clearance, _clearance_at(around, x, y))
            crop[0, row, column] = blocked
            crop[1, row, column] = free / (_PARTS * _PARTS)
            crop[2, row, column] = unknown / (_PARTS * _PARTS)
            crop[3, row, column] = clearance
            ahead, aside = (row + 0.5) * FAR_CELL - FAR_BEHIND, (column + 0.5) * FAR_CELL - half
            nearer = away - np.hypot(goal[0] - ahead, goal[1] - aside)
            crop[4, row, column] = min(max(nearer / (2.0 * _GRADE), -1.0), 1.0)


@kernel
def _blocked(around: RobotMap, log_odds: float) -> float:
    """Return the share of an obstacle in log odds: a half is lethal."""
    return min(max(0.5 * log_odds / around.lethal_log_odds, 0.0), 1.0)


@kernel
def _log_odds_at(around: RobotMap, x: float, y: float) -> float:
    """Return the log odds of a place in ``odom``, 0 beyond the square."""
    n, centre = len(around.log_odds), around.centre
    i, j = int(np.floor(x / around.cell)), int(np.floor(y / around.cell))
    half = n // 2 - 1
    if abs(i - centre[0]) > half or abs(j - centre[1]) > half:
        return 0.0
    return float(around.log_odds[i & (n - 1), j & (n - 1)])


@kernel
def _clearance_at(around: RobotMap, x: float, y: float) -> float:
    """Return the clearance of a place in ``odom`` as a share of the most, 1 beyond the square."""
    n = len(around.clearance)
    i = int(np.floor((x - around.corner[0]) / around.cell))
    j = int(np.floor((y - around.corner[1]) / around.cell))
    if not (0 <= i < n and 0 <= j < n):
        return 1.0
    return min(float(around.clearance[i, j]) / around.far_clearance, 1.0)
