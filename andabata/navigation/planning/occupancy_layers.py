"""Updates of an occupancy grid by what is surer than a scan: ground, driving, low obstacles."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import kernel

_FREE_SHARE = 0.7
"""Share of the largest log odds that seen ground can have against an obstacle; driven ground has
all of it."""


@kernel
def take_ground(
    log_odds: NDArray[np.float32],
    ground: NDArray[np.float32],
    scale: float,
    max_log_odds: float,
    fading: float,
) -> None:
    """Let driven ground fade, and write the ground layer over what is not driven.

    Ground cells are finer than polar cells and know the clouds themselves.

    Args:
        log_odds: Log odds, wrapped around, changed in place, shape (n, n).
        ground: Log odds of the ground layer, wrapped around, 0 where it knows nothing, shape
            (n, n).
        scale: Log odds for each of the ground layer's.
        max_log_odds: Largest log odds; driven ground has as much or more against an obstacle.
        fading: Log odds by which driven ground comes nearer to ground like any other.
    """
    n = len(log_odds)
    least = -_FREE_SHARE * max_log_odds
    for i in range(n):
        for j in range(n):
            known, shown = log_odds[i, j], ground[i, j]
            known = np.float32(known + fading) if known <= -max_log_odds else known
            is_shown = shown != 0.0 and known > -max_log_odds
            shown = np.float32(min(max(scale * shown, least), max_log_odds))
            log_odds[i, j] = shown if is_shown else known


class Stance(NamedTuple):
    """Place of the robot in the grid.

    Attributes:
        x: Position in ``odom`` [cells].
        y: Position in ``odom`` [cells].
        radius: Distance from the middle within which ground counts as driven [cells].
    """

    x: float
    y: float
    radius: float


@kernel
def drive_over(
    log_odds: NDArray[np.float32],
    centre: NDArray[np.int64],
    stance: Stance,
    max_log_odds: float,
) -> None:
    """Lower the log odds under the robot: it stands there."""
    n, beside = len(log_odds), int(stance.radius) + 1
    for i in range(centre[0] - beside, centre[0] + beside + 1):
        for j in range(centre[1] - beside, centre[1] + beside + 1):
            far = np.hypot(i + 0.5 - stance.x, j + 0.5 - stance.y)
            if far < stance.radius:
                # The nearer the robot's middle was, the more clearance the body had.
                driven = -max_log_odds * (2.0 - far / stance.radius)
                u, v = i & (n - 1), j & (n - 1)
                log_odds[u, v] = min(log_odds[u, v], driven)


@kernel
def vacate(
    log_odds: NDArray[np.float32],
    centre: NDArray[np.int64],
    places: NDArray[np.float64],
    cell: float,
) -> None:
    """Take obstacles out of the cells of what moves, or has left.

    Args:
        log_odds: Log odds, wrapped around, changed in place, shape (n, n).
        centre: Cell of the robot, shape (2,).
        places: Places of these cells, in ``odom`` [m], shape (k, 2).
        cell: Edge of a cell [m].
    """
    n = len(log_odds)
    for k in range(len(places)):
        i, j = int(np.floor(places[k, 0] / cell)), int(np.floor(places[k, 1] / cell))
        if max(abs(i - centre[0]), abs(j - centre[1])) < n // 2:
            u, v = i & (n - 1), j & (n - 1)
            log_odds[u, v] = min(log_odds[u, v], np.float32(0.0))


class LowObstacles(NamedTuple):
    """Low obstacles for the compiled update.

    Attributes:
        heights: Heights, in cells of half the size, wrapped around [m], float32, shape (m, m).
        centre: Cell of the robot at the last cloud, shape (2,).
        ground: Log odds of the ground layer, wrapped around, float32, shape (n, n).
        half: Number of cells to either side of the robot that are looked at.
        gain: Log odds for each metre of height [1/m].
        free_log_odds: Log odds of the ground layer below minus this that overrule.
    """

    heights: NDArray[np.float32]
    centre: NDArray[np.int64]
    ground: NDArray[np.float32]
    half: int
    gain: float
    free_log_odds: float


@kernel
def add_low_obstacles(
    log_odds: NDArray[np.float32],
    centre: NDArray[np.int64],
    low: LowObstacles,
    max_log_odds: float,
) -> None:
    """Raise the log odds where low obstacles stand, or beside them.

    Beside them, because obstacles and the gaps between them are known by the middles of cells.
    Driven ground and ground cells that are surely free have no low obstacles.
    """
    n, m = len(log_odds), len(low.heights)
    half = min(low.half, m // 4 - 1)
    # Obstacles are few: each raises the cells that it lies in or beside, instead of each cell
    # looking at the four half cells inside and one more around.
    for u in range(2 * (centre[0] - half) - 1, 2 * (centre[0] + half) + 3):
        row = low.heights[u & (m - 1)]
        if not _has_any(row):
            continue
        for v in range(2 * (centre[1] - half) - 1, 2 * (centre[1] + half) + 3):
            height = row[v & (m - 1)]
            if not height > 0 or max(abs(u - low.centre[0]), abs(v - low.centre[1])) >= m // 2:
                continue
            raised = min(low.gain * height, max_log_odds)
            for a in range(u // 2 - 1 + u % 2, u // 2 + 1 + u % 2):
                for b in range(v // 2 - 1 + v % 2, v // 2 + 1 + v % 2):
                    if max(abs(a - centre[0]), abs(b - centre[1])) > half:
                        continue
                    i, j = a & (n - 1), b & (n - 1)
                    is_free = low.ground[i, j] < -low.free_log_odds
                    if log_odds[i, j] > -max_log_odds and not is_free:
                        log_odds[i, j] = max(log_odds[i, j], raised)


@kernel
def _has_any(values: NDArray[np.float32]) -> bool:
    """Return True if one of the values is above 0."""
    count = 0
    for k in range(len(values)):
        count += values[k] > 0
    return count > 0
