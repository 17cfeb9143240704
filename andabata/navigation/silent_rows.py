"""Beams of a 3D laser that met nothing, found from those that did.

A cloud holds returns alone. Of a laser whose rows are known, a direction of a row without a return
is one where it met nothing: over open ground nothing else tells that the air is free. Directions
are grouped, and a group counts if no beam in it and in those around it was returned, so that
neither one lost return nor a gap between leaves is nothing.
"""

import numpy as np
from numpy.typing import NDArray

from terrain.kernel import borrowing_kernel, kernel
from traversability.cloud import PointCloud

_SECTORS = 128
"""Number of sectors of a turn."""

_NEVER = -np.inf
"""Stamp of a sector without any return [s]."""


class SilentRows:
    """Finds the beams without a return in clouds of a laser."""

    def __init__(self, rows_deg: tuple[float, ...], elevations_deg: tuple[float, float]) -> None:
        """Prepare for a laser.

        Args:
            rows_deg: Elevations of its rows, two or more, increasing [deg].
            elevations_deg: Lowest and highest elevation of rows that count [deg].
        """
        rows = np.deg2rad(np.array(rows_deg))
        low, high = np.deg2rad(elevations_deg)
        # A return belongs to the row that is nearest; the outermost rows end half a step beyond.
        middles = (rows[1:] + rows[:-1]) / 2.0
        edges = np.concatenate([[2 * rows[0] - middles[0]], middles, [2 * rows[-1] - middles[-1]]])
        counts = np.flatnonzero((rows >= low) & (rows <= high))
        self._slopes = np.tan(rows[counts])
        self._edges = np.tan(edges[counts[0] : counts[-1] + 2]) if len(counts) else np.empty(0)

    def ends(self, cloud: PointCloud, lidar_height: float, free_range: float) -> PointCloud:
        """Return places that beams have passed without a return, in the cloud's frame, with times.

        Sectors without any return are left out: nothing tells that the laser has looked there.

        Args:
            cloud: Points with times, as in ``SensorReadings.frames``.
            lidar_height: Height of the optical centre above ``base_footprint`` [m].
            free_range: Range of these places [m].

        Raises:
            ValueError: If the points have no times.
        """
        if cloud.stamps is None:
            raise ValueError("stamps: expected a time of each point, got none")
        height = 0.0 if cloud.frame == "sensor" else lidar_height
        points, stamps = _silent(
            cloud.points, cloud.stamps, self._edges, self._slopes, height, free_range
        )
        return PointCloud(points, cloud.frame, stamps)


@kernel
def _silent(
    points: NDArray[np.float32],
    stamps: NDArray[np.float64],
    edges: NDArray[np.float64],
    slopes: NDArray[np.float64],
    height: float,
    free_range: float,
) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
    """Return ends of beams without a return [m], shape (k, 3), and their times [s], shape (k,).

    Args:
        points: Returns, shape (n, 3).
        stamps: Their times [s], shape (n,).
        edges: Tangents of the elevations between the rows, increasing, shape (r + 1,).
        slopes: Tangents of the rows' elevations, shape (r,).
        height: Height of the optical centre in the points' frame [m].
        free_range: Range of the ends [m].
    """
    rows = len(slopes)
    is_seen = np.zeros((rows, _SECTORS), dtype=np.bool_)
    newest = np.full(_SECTORS, _NEVER)
    for k in range(len(points)):
        x, y = points[k, 0], points[k, 1]
        sector = _sector(x, y)
        newest[sector] = stamps[k]
        slope = (points[k, 2] - height) / max(np.sqrt(x * x + y * y), 1e-6)
        if rows and edges[0] <= slope < edges[rows]:
            is_seen[np.searchsorted(edges, slope, side="right") - 1, sector] = True
    ends = np.empty((rows * _SECTORS, 3), dtype=np.float32)
    times, count = np.empty(rows * _SECTORS), 0
    for sector in range(_SECTORS):
        # The middle of the sector on the square |x| + |y| = 1.
        turn = (sector + 0.5) * 4.0 / _SECTORS - 2.0
        x, y = abs(turn) - 1.0, (1.0 - abs(abs(turn) - 1.0)) * np.sign(turn)
        away = np.hypot(x, y)
        for row in range(rows):
            if newest[sector] == _NEVER or _is_met(is_seen, row, sector):
                continue
            level = free_range / np.sqrt(1.0 + slopes[row] * slopes[row])
            ends[count, 0], ends[count, 1] = -x / away * level, y / away * level
            ends[count, 2] = height + level * slopes[row]
            times[count] = newest[sector]
            count += 1
    return ends[:count].copy(), times[:count].copy()


@borrowing_kernel
def _is_met(is_seen: NDArray[np.bool_], row: int, sector: int) -> bool:
    """Return True if a beam of a row and sector, or of those around them, was returned."""
    for a in range(max(row - 1, 0), min(row + 2, len(is_seen))):
        for b in range(sector - 1, sector + 2):
            if is_seen[a, b % _SECTORS]:
                return True
    return False


@borrowing_kernel
def _sector(x: float, y: float) -> int:
    """Return the sector of a direction: one of equal parts of the square |x| + |y| = 1."""
    size = abs(x) + abs(y)
    across = y / size if size > 0.0 else 0.0
    # From -2 to 2 once around: 0 ahead, 1 to the left, -1 to the right.
    turn = across if x >= 0.0 else (2.0 - across if y >= 0.0 else -2.0 - across)
    return min(max(int((turn + 2.0) * _SECTORS / 4.0), 0), _SECTORS - 1)
