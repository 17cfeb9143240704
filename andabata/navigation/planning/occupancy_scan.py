"""Update of an occupancy grid by a scan: what polar cells show of the cells around the robot."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.navigation.planning.occupancy_config import OccupancyGridConfig
from terrain.kernel import kernel
from traversability.grid import PolarGrid

_OUTSIDE = -1
"""Ring of what lies beyond the polar grid."""


class PolarCells(NamedTuple):
    """Polar cells of a scan at the middle and the corners of each grid cell around the robot.

    Attributes:
        rings: Ring of the middle, -1 outside, int16, shape (m, m).
        bearings: Bearing of the middle from the robot [rad], float32, shape (m, m).
        weights: Weight of a scan, float64, shape (m, m).
        is_empty_known: True within ``unknown_range``, shape (m, m).
        is_blocked_known: True within ``blocked_range``, shape (m, m).
        corner_rings: Rings of the four corners, like ``rings``, shape (m, m, 4).
        corner_bearings: Bearings of the four corners, like ``bearings``, shape (m, m, 4).
    """

    rings: NDArray[np.int16]
    bearings: NDArray[np.float32]
    weights: NDArray[np.float64]
    is_empty_known: NDArray[np.bool_]
    is_blocked_known: NDArray[np.bool_]
    corner_rings: NDArray[np.int16]
    corner_bearings: NDArray[np.float32]


class Gains(NamedTuple):
    """Steps of an update; see ``OccupancyGridConfig``.

    Attributes:
        blocked: Share of its way that a blocked polar cell moves the log odds.
        free: Share that a free one moves them.
        unknown: Log odds that an empty one adds.
        certain_blocked: Log odds of a polar cell that is certainly blocked.
        certain_free: Log odds against one that is certainly free.
        max_log_odds: Largest log odds.
    """

    blocked: float
    free: float
    unknown: float
    certain_blocked: float
    certain_free: float
    max_log_odds: float


def polar_cells(grid: PolarGrid, config: OccupancyGridConfig) -> PolarCells:
    """Return the polar cells of each grid cell, relative to the robot's own."""
    cell = config.cell
    reach = int(grid.outer_radius / cell) + 1
    middles = np.arange(-reach, reach + 1) * cell
    x = middles[:, None, None] + cell / 2 * np.array([0, 1, 1, -1, -1])
    y = middles[None, :, None] + cell / 2 * np.array([0, 1, -1, 1, -1])
    ranges = np.hypot(x, y)
    rings = (np.searchsorted(grid.ring_edges, ranges, side="right") - 1).astype(np.int16)
    rings[(rings < 0) | (rings >= grid.n_rings)] = _OUTSIDE
    bearings = np.arctan2(*np.broadcast_arrays(y, x)).astype(np.float32)
    ranges = ranges[:, :, 0]
    return PolarCells(
        rings=rings[:, :, 0].copy(),
        bearings=bearings[:, :, 0].copy(),
        weights=1.0 / (1.0 + ranges / config.range_scale),
        is_empty_known=ranges < config.unknown_range,
        is_blocked_known=ranges < config.blocked_range,
        corner_rings=rings[:, :, 1:].copy(),
        corner_bearings=bearings[:, :, 1:].copy(),
    )


@kernel
def add_scan(
    log_odds: NDArray[np.float32],
    centre: NDArray[np.int64],
    yaw: float,
    odds: NDArray[np.float32],
    polar: PolarCells,
    gains: Gains,
    ground: NDArray[np.float32],
    has_ground: bool,
) -> None:
    """Add what a scan shows of each cell around the robot that the ground layer does not know.

    Args:
        log_odds: Log odds, wrapped around, changed in place, shape (n, n).
        centre: Cell of the robot, shape (2,).
        yaw: Heading of the robot [rad].
        odds: Log odds of the scan's cells for being blocked, NaN where empty, shape (sectors,
            rings).
        polar: Polar cells of the grid cells.
        gains: Steps of the update.
        ground: Log odds of the ground layer, wrapped around, 0 where it knows nothing, shape
            (n, n).
        has_ground: True if ground cells show what stands where in far blocked cells.
    """
    n, half, sectors = len(log_odds), len(polar.rings) // 2, len(odds)
    nearest = _first_blocked(odds)
    for a in range(2 * half + 1):
        i = (centre[0] + a - half) & (n - 1)
        for b in range(2 * half + 1):
            j = (centre[1] + b - half) & (n - 1)
            ring = polar.rings[a, b]
            if ring == _OUTSIDE or ground[i, j] != 0.0:
                continue
            sector = _sector_of(polar.bearings[a, b], yaw, sectors)
            seen, weight = odds[sector, ring], polar.weights[a, b]
            known, most = log_odds[i, j], gains.max_log_odds * weight
            if seen < 0:
                # An object in a corner makes its own polar cell blocked, and not this one.
                for k in range(4):
                    sector = _sector_of(polar.corner_bearings[a, b, k], yaw, sectors)
                    if polar.corner_rings[a, b, k] != _OUTSIDE:
                        seen = max(seen, odds[sector, polar.corner_rings[a, b, k]])
                if seen < 0:
                    there = most * max(seen / gains.certain_free, -1.0)
                    moved = known - gains.free * weight * (known - there)
                    log_odds[i, j] = min(known, moved)
            elif known <= -most:
                continue  # It was seen free from nearer.
            elif seen >= 0 and (polar.is_blocked_known[a, b] or not has_ground):
                there = most * min(seen / gains.certain_blocked, 1.0)
                log_odds[i, j] = max(known, known + gains.blocked * weight * (there - known))
            elif np.isnan(seen) and polar.is_empty_known[a, b] and ring < nearest[sector]:
                # Nothing came back, and nothing stands before it: the ground may fall away.
                log_odds[i, j] = max(known, min(known + gains.unknown, most))


@kernel
def _first_blocked(odds: NDArray[np.float32]) -> NDArray[np.int64]:
    """Return the first blocked ring of each sector, the number of rings for none."""
    first = np.full(len(odds), odds.shape[1])
    for sector in range(len(odds)):
        for ring in range(odds.shape[1]):
            if odds[sector, ring] >= 0:
                first[sector] = ring
                break
    return first


@kernel
def _sector_of(bearing: float, yaw: float, sectors: int) -> int:
    """Return the sector of a bearing in ``odom`` [rad] for a heading [rad]; sector 0 is behind."""
    return int((bearing - yaw + 3 * np.pi) / (2 * np.pi) * sectors) % sectors
