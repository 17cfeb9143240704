"""Scans of the last control steps of many robots, and from where they were made."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from andabata.tasks.rooms.observations import EarlierScans
from worlds.rooms.mover_motion import Movers


class ScanHistory:
    """Ring of the latest scans of each robot.

    Attributes:
        earlier: Scan of each robot as many steps ago as asked for, the first one of its episode
            before that; shapes as in ``EarlierScans``, n robots.
    """

    def __init__(self, count: int, steps: int, beams: int, movers: int) -> None:
        """Begin empty.

        Args:
            count: Number n of robots.
            steps: Number of control steps to look back.
            beams: Number of beams of a scan.
            movers: Number of moving obstacles of each robot.
        """
        self._steps = steps
        self._ages = np.full(count, -1)
        self.earlier = _empty((count,), beams, movers)
        self._rings = _empty((count, steps + 1), beams, movers)

    def restart(self, k: int) -> None:
        """Forget the scans of robot ``k``, whose next scan is the first of an episode."""
        self._ages[k] = -1

    def update(
        self,
        numbers: NDArray[np.intp],
        reciprocals: NDArray[np.float32],
        poses: NDArray[np.float64],
        movers: Movers,
    ) -> None:
        """Remember the scans of some robots, and look back.

        Args:
            numbers: Indices of the robots, shape (k,).
            reciprocals: Reciprocals of their beams, shape (k, b).
            poses: x, y [m] and yaw [rad] of all robots, shape (n, 3).
            movers: Moving obstacles of all robots.
        """
        self._ages[numbers] += 1
        ages, size = self._ages[numbers], self._steps + 1
        now, then = ages % size, (ages - np.minimum(ages, self._steps)) % size
        around = movers.places[numbers], movers.radii[numbers]
        seen = EarlierScans(reciprocals, poses[numbers], *around)
        kept: Sequence[NDArray[Any]] = self.earlier
        rings: Sequence[NDArray[Any]] = self._rings
        for ring, values, earlier in zip(rings, seen, kept, strict=True):
            ring[numbers, now] = values
            earlier[numbers] = ring[numbers, then]


def _empty(lead: tuple[int, ...], beams: int, movers: int) -> EarlierScans:
    """Return scans of nothing, with some leading axes."""
    return EarlierScans(
        np.zeros((*lead, beams), dtype=np.float32),
        np.zeros((*lead, 3)),
        np.zeros((*lead, movers, 2)),
        np.zeros((*lead, movers)),
    )
