"""Compiled pass from beams to points in the robot's frame, and windows of bearing."""

import numpy as np
from numpy.typing import NDArray

from andabata.tasks.room_kernel import MIN_RANGE, Lasers
from terrain.kernel import kernel

SECTORS = 36
"""Number of windows of bearing that critics see (Zhang et al., section III-B)."""

_EDGE = 1e-9
"""Widening of a window [windows]: a beam at its edge must not be lost to rounding."""

_TURN = 2 * np.pi


@kernel
def take_points(
    found: NDArray[np.float32],
    chosen: NDArray[np.bool_],
    lasers: Lasers,
    mounted: NDArray[np.int64],
    capacity: int,
    rows: NDArray[np.float32],
) -> None:
    """Write beams as points in the robot's frame, and the nearest of each window of bearing.

    A laser with more beams than there is room for gives the nearest of as many neighbours as it
    takes. A row begins with ``capacity`` points (sin a / d, cos a / d), bearing a and distance d
    from the robot's centre [1/m]; then come a mask, 1 for points that count and 0 for padding, and
    the largest reciprocal distance of each of ``SECTORS`` windows of bearing, the first from -pi
    on, counter-clockwise.

    Args:
        found: Reciprocals as ``cast`` writes them, shape (n, b).
        chosen: True for robots to write, shape (n,).
        lasers: Lasers.
        mounted: Index of each robot's laser, shape (n,).
        capacity: Number of points of a row.
        rows: Observations, float32, shape (n, 3 capacity + ``SECTORS`` and more).
    """
    for k in range(len(chosen)):
        if not chosen[k]:
            continue
        laser, row = mounted[k], rows[k]
        mask, windows = row[2 * capacity : 3 * capacity], row[3 * capacity : 3 * capacity + SECTORS]
        count, directions = lasers.counts[laser], lasers.directions[laser]
        ahead, left = lasers.offsets[laser]
        windows[:] = np.float32(1.0 / lasers.max_ranges[laser])
        beams = found[k]
        pool = (count + capacity - 1) // capacity
        used = (count + pool - 1) // pool
        for p in range(used):
            i = p * pool
            near = beams[i]
            for j in range(p * pool + 1, min((p + 1) * pool, count)):
                near = beams[j] if beams[j] > near else near
            while beams[i] != near:
                i += 1
            cosine, sine = directions[0, i], directions[1, i]
            bearing = lasers.firsts[laser] + i * lasers.steps[laser]
            # From the robot's centre a beam's bearing is known, and so is its distance.
            if ahead != 0.0 or left != 0.0:
                x, y = ahead + cosine / near, left + sine / near
                distance = np.sqrt(x * x + y * y)
                bearing = np.arctan2(y, x)
                cosine, sine = np.float32(x / distance), np.float32(y / distance)
                near = np.float32(1.0 / max(distance, MIN_RANGE))
            row[2 * p], row[2 * p + 1] = near * sine, near * cosine
            mask[p] = 1.0
            sector = int(np.floor((bearing + np.pi) * (SECTORS / _TURN) + _EDGE)) % SECTORS
            if near > windows[sector]:
                windows[sector] = near
        row[2 * used : 2 * capacity] = 0.0
        mask[used:] = 0.0
