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
"""Channels of the far crop, of the map's cells in each of its: the most of what blocks, shares of
free and unknown ones, the least clearance."""

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
    """Write the channels of the near crop: what the map says at the middle of each of its cells."""
    log_odds, clearance = around.log_odds, around.clearance
    n, m = len(log_odds), len(clearance)
    i0, j0 = around.centre[0], around.centre[1]
    x0, y0 = around.corner[0], around.corner[1]
    cell, lethal, most, wide = _scales(around)
    c, s = np.cos(yaw), np.sin(yaw)
    away, middle = np.hypot(goal[0], goal[1]), NEAR_CELLS * NEAR_CELL / 2.0
    for row in range(NEAR_CELLS):
        ahead = (row + 0.5) * NEAR_CELL - NEAR_BEHIND
        for column in range(NEAR_CELLS):
            aside = (column + 0.5) * NEAR_CELL - middle
            x, y = position[0] + c * ahead - s * aside, position[1] + s * ahead + c * aside
            i, j = int(np.floor(x / cell)), int(np.floor(y / cell))
            known = 0.0
            if max(abs(i - i0), abs(j - j0)) < n // 2:
                known = float(log_odds[i & (n - 1), j & (n - 1)])
            crop[0, row, column] = _share(0.5 * known / lethal)
            crop[1, row, column] = _share(-known / most)
            crop[2, row, column] = known == 0.0
            crop[3, row, column] = _share(-known / most - 1.0)
            i, j = int(np.floor((x - x0) / cell)), int(np.floor((y - y0) / cell))
            crop[4, row, column] = 1.0
            if 0 <= i < m and 0 <= j < m:
                crop[4, row, column] = _share(clearance[i, j] / wide)
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
    """Write the channels of the far crop: of all cells of the map whose middle is in one of its."""
    log_odds, clearance = around.log_odds, around.clearance
    n, m = len(log_odds), len(clearance)
    i0, j0 = around.centre[0], around.centre[1]
    x0, y0 = around.corner[0], around.corner[1]
    cell, lethal, _, wide = _scales(around)
    c, s = np.cos(yaw), np.sin(yaw)
    away, middle = np.hypot(goal[0], goal[1]), FAR_CELLS * FAR_CELL / 2.0
    counts = np.zeros((FAR_CELLS, FAR_CELLS), dtype=np.float32)
    crop[:3], crop[3] = 0.0, wide
    per_metre, limit = 1.0 / FAR_CELL, 2.0 * FAR_CELLS * FAR_CELL
    shift = int(np.floor(0.5 - y0 / cell))
    reach = int(np.hypot(2.0 * middle - FAR_BEHIND, middle) / cell) + 1
    # Beyond the map nothing is known, which needs no look at each cell.
    reach = min(reach, n // 2 - 1)
    for i in range(i0 - reach, i0 + reach + 1):
        u = (i + 0.5) * cell - position[0]
        k = int(np.floor(((i + 0.5) * cell - x0) / cell))
        is_covered = 0 <= k < m
        # Rows and columns of the crop along this line of the map, at v = 0.
        down, across = per_metre * (c * u + FAR_BEHIND), per_metre * (middle - s * u)
        low, high = _inside(down, per_metre * s, -limit, limit)
        low, high = _inside(across, per_metre * c, low, high)
        first = max(int(np.ceil((low + position[1]) / cell - 0.5)), j0 - reach)
        last = min(int(np.floor((high + position[1]) / cell - 0.5)), j0 + reach)
        for j in range(first, last + 1):
            v = per_metre * ((j + 0.5) * cell - position[1])
            row = min(max(int(down + s * v), 0), FAR_CELLS - 1)
            column = min(max(int(across + c * v), 0), FAR_CELLS - 1)
            counts[row, column] += 1.0
            known = log_odds[i & (n - 1), j & (n - 1)]
            if known > 0.0:
                crop[0, row, column] = max(crop[0, row, column], _share(0.5 * known / lethal))
            elif known < 0.0:
                crop[1, row, column] += 1.0
            else:
                crop[2, row, column] += 1.0
            q = j + shift
            if is_covered and 0 <= q < m:
                crop[3, row, column] = min(crop[3, row, column], clearance[k, q])
    for row in range(FAR_CELLS):
        ahead = (row + 0.5) * FAR_CELL - FAR_BEHIND
        for column in range(FAR_CELLS):
            aside = (column + 0.5) * FAR_CELL - middle
            count = counts[row, column]
            crop[1, row, column] = crop[1, row, column] / count if count > 0.0 else 0.0
            crop[2, row, column] = crop[2, row, column] / count if count > 0.0 else 1.0
            crop[3, row, column] = _share(crop[3, row, column] / wide)
            nearer = away - np.hypot(goal[0] - ahead, goal[1] - aside)
            crop[4, row, column] = min(max(nearer / (2.0 * _GRADE), -1.0), 1.0)


@kernel
def _inside(begin: float, slope: float, low: float, high: float) -> tuple[float, float]:
    """Return the part of a line from low to high where begin + slope * v is a row of the far crop.

    The part is empty, its end below its begin, where there is none.
    """
    if abs(slope) < 1e-9:
        return (low, high) if 0.0 <= begin < FAR_CELLS else (1.0, 0.0)
    one, other = -begin / slope, (FAR_CELLS - begin) / slope
    return max(low, min(one, other)), min(high, max(one, other))


@kernel
def _scales(around: RobotMap) -> tuple[float, float, float, float]:
    """Return cell, lethal and largest log odds, and clearance from which on more is all one.

    Arrays and numbers are taken out of the map once: it costs more to pass it than to look.
    """
    return around.cell, around.lethal_log_odds, around.max_log_odds, around.far_clearance


@kernel
def _share(value: float) -> float:
    """Return a value within 0 and 1."""
    return min(max(value, 0.0), 1.0)
