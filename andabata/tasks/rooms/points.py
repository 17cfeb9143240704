"""Compiled pass from beams to points in the robot's frame, and windows of bearing.

Windows lie side by side around straight ahead, counter-clockwise; what is outside of all of them is
in none.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from andabata.tasks.rooms.kernel import MIN_RANGE, YAW, Lasers, X, Y
from terrain.kernel import kernel

SECTORS = 36
"""Number of windows of bearing that critics see (Zhang et al., section III-B)."""

_EDGE = 1e-9
"""Widening of a window [windows]: a beam at its edge must not be lost to rounding."""

_EARLIER_EDGE = 4e-6
"""The same for points that were moved: their directions are float32."""

_TURN = 2 * np.pi


class Windows(NamedTuple):
    """Windows of bearing of equal width, as some lasers fill them.

    Attributes:
        size: Number of windows.
        fov: Angle that they cover together [rad].
        of_beams: Window of each beam of each laser that is in the robot's middle, -1 for none,
            shape (l, b).
    """

    size: int
    fov: float
    of_beams: NDArray[np.int64]


def bearing_windows(lasers: Lasers, size: int = SECTORS, fov: float = _TURN) -> Windows:
    """Return windows around straight ahead.

    Args:
        lasers: Lasers.
        size: Number of windows.
        fov: Angle that they cover together [rad].
    """
    of_beams = np.full(lasers.directions[:, 0].shape, -1)
    for laser, count in enumerate(lasers.counts.tolist()):
        bearings = lasers.firsts[laser] + lasers.steps[laser] * np.arange(count)
        of_beams[laser, :count] = [window_of(b, size, fov, _EDGE) for b in bearings.tolist()]
    return Windows(size, fov, of_beams)


@kernel
def window_of(bearing: float, size: int, fov: float, edge: float) -> int:
    """Return the window of a bearing, -1 if it is in none.

    Args:
        bearing: Bearing from straight ahead [rad].
        size: Number of windows.
        fov: Angle that they cover together [rad].
        edge: Widening of a window [windows].
    """
    turn = size * (_TURN / fov)
    index = (bearing + 0.5 * fov) * (size / fov) + edge
    index -= turn * np.floor(index / turn)
    # The last window holds its upper edge; beyond it there may be a part of the turn without any.
    if index > size + 2.0 * edge:
        return -1
    return min(int(index), size - 1)


@kernel
def take_points(
    reciprocals: NDArray[np.float32],
    chosen: NDArray[np.bool_],
    lasers: Lasers,
    mounted: NDArray[np.int64],
    capacity: int,
    windows: Windows,
    rows: NDArray[np.float32],
) -> None:
    """Write beams as points in the robot's frame, and the nearest of each window of bearing.

    A laser with more beams than there is room for gives the nearest of as many neighbours as it
    takes. A row begins with ``capacity`` points (sin a / d, cos a / d), bearing a and distance d
    from the robot's centre [1/m]; then come a mask, 1 for points that count and 0 for padding, and
    the largest reciprocal distance of each window, that of the maximum range in an empty one.
    Without room for any point a row is the windows alone, and all beams count.

    Args:
        reciprocals: Reciprocals as ``cast`` writes them, shape (n, b).
        chosen: True for robots to write, shape (n,).
        lasers: Lasers.
        mounted: Index of each robot's laser, shape (n,).
        capacity: Number of points of a row.
        windows: Windows of bearing.
        rows: Observations, float32, shape (n, 3 capacity + windows and more).
    """
    for k in range(len(chosen)):
        if not chosen[k]:
            continue
        laser, row = mounted[k], rows[k]
        mask = row[2 * capacity : 3 * capacity]
        nearest = row[3 * capacity : 3 * capacity + windows.size]
        count, directions = lasers.counts[laser], lasers.directions[laser]
        ahead, left = lasers.offsets[laser]
        nearest[:] = np.float32(1.0 / lasers.max_ranges[laser])
        beams = reciprocals[k]
        room = capacity if capacity > 0 else count
        pool = (count + room - 1) // room
        used = (count + pool - 1) // pool
        for p in range(used):
            i = p * pool
            near = beams[i]
            for j in range(p * pool + 1, min((p + 1) * pool, count)):
                near = beams[j] if beams[j] > near else near
            while beams[i] != near:
                i += 1
            cosine, sine = directions[0, i], directions[1, i]
            window = windows.of_beams[laser, i]
            # Seen from the robot's centre a beam of a laser elsewhere has another bearing.
            if ahead != 0.0 or left != 0.0:
                x, y = ahead + cosine / near, left + sine / near
                distance = np.sqrt(x * x + y * y)
                window = window_of(np.arctan2(y, x), windows.size, windows.fov, _EDGE)
                cosine, sine = np.float32(x / distance), np.float32(y / distance)
                near = np.float32(1.0 / max(distance, MIN_RANGE))
            if capacity > 0:
                row[2 * p], row[2 * p + 1] = near * sine, near * cosine
                mask[p] = 1.0
            if window >= 0 and near > nearest[window]:
                nearest[window] = near
        if capacity > 0:
            row[2 * used : 2 * capacity] = 0.0
            mask[used:] = 0.0


@kernel
def take_earlier_windows(
    reciprocals: NDArray[np.float32],
    then: NDArray[np.float64],
    now: NDArray[np.float64],
    lasers: Lasers,
    mounted: NDArray[np.int64],
    windows: Windows,
    rows: NDArray[np.float32],
) -> None:
    """Write the windows of bearing that an earlier scan would fill from where the robot is now.

    What the beams met is turned and moved by the robot's own motion since, and seen from its
    present pose; beams that met nothing are left out. What stands fills them as it fills the
    present windows, but for what one of both poses does not see; what moves differs.

    Args:
        reciprocals: Reciprocals of the earlier scan as ``cast`` writes them, shape (n, b).
        then: x, y [m] and yaw [rad] of each robot at that scan, shape (n, 3).
        now: Poses at present, shape (n, 3).
        lasers: Lasers.
        mounted: Index of each robot's laser, shape (n,).
        windows: Windows of bearing.
        rows: Largest reciprocal distance of each window, float32, changed in place, shape
            (n, windows); that of the maximum range in an empty one [1/m].
    """
    for k in range(len(reciprocals)):
        laser, row, beams = mounted[k], rows[k], reciprocals[k]
        directions = lasers.directions[laser]
        ahead, left = lasers.offsets[laser]
        silent = np.float32(1.0 / lasers.max_ranges[laser])
        row[:] = silent
        # Pose of then in the frame of now.
        dx, dy = then[k, X] - now[k, X], then[k, Y] - now[k, Y]
        c, s = np.cos(now[k, YAW]), np.sin(now[k, YAW])
        moved_x, moved_y = c * dx + s * dy, c * dy - s * dx
        turn = then[k, YAW] - now[k, YAW]
        c, s = np.cos(turn), np.sin(turn)
        for i in range(lasers.counts[laser]):
            if beams[i] <= silent:
                continue
            far = 1.0 / np.float64(beams[i])
            x, y = ahead + far * directions[0, i], left + far * directions[1, i]
            x, y = moved_x + c * x - s * y, moved_y + s * x + c * y
            near = np.float32(1.0 / max(np.hypot(x, y), MIN_RANGE))
            window = window_of(np.arctan2(y, x), windows.size, windows.fov, _EARLIER_EDGE)
            if window >= 0 and near > row[window]:
                row[window] = near
