"""Poses, and a track of poses over time, interpolated at the instant of each beam."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from terrain.kernel import inlined_kernel, kernel

PoseRow = tuple[float, float, float, float, float, float, float]
"""A pose in compiled code: x, y, z [m] and quaternion x, y, z, w."""

_QUATERNION = 3
"""First column of the quaternion in a row of x, y, z and quaternion x, y, z, w."""


def wrap(angle: float) -> float:
    """Return an angle [rad] wrapped to (-pi, pi]."""
    return float(np.pi - (np.pi - angle) % (2 * np.pi))


@dataclass(frozen=True)
class Pose:
    """Pose of ``base_footprint`` (centre of the wheel contact points, X forward) in the map.

    Attributes:
        position: Map coordinates [m], float64, shape (3,).
        quaternion: Rotation from base to map, x, y, z, w, unit length, float64, shape (4,).
    """

    position: NDArray[np.float64]
    quaternion: NDArray[np.float64]

    @classmethod
    def from_euler(
        cls, position: NDArray[np.float64], roll: float, pitch: float, yaw: float
    ) -> "Pose":
        """Return the pose with the given roll, pitch and yaw [rad] (intrinsic z-y-x)."""
        sr, cr = math.sin(roll / 2), math.cos(roll / 2)
        sp, cp = math.sin(pitch / 2), math.cos(pitch / 2)
        sy, cy = math.sin(yaw / 2), math.cos(yaw / 2)
        x, y = sr * cp * cy - cr * sp * sy, cr * sp * cy + sr * cp * sy
        z, w = cr * cp * sy - sr * sp * cy, cr * cp * cy + sr * sp * sy
        return cls(np.asarray(position, dtype=np.float64), np.array([x, y, z, w]))

    @property
    def yaw(self) -> float:
        """Heading [rad], 0 = east, counter-clockwise."""
        x, y, z, w = self.quaternion.tolist()
        return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Homogeneous matrix ``T_map_base``, shape (4, 4)."""
        T_map_base = np.eye(4)
        T_map_base[:3, :3] = Rotation.from_quat(self.quaternion).as_matrix()
        T_map_base[:3, 3] = self.position
        return T_map_base


class PoseTrack:
    """Buffer of the latest poses, ordered by time.

    Positions are interpolated linearly and rotations by normalised linear interpolation, which for
    the few milliseconds between two entries differs from slerp by less than a microradian.
    """

    def __init__(self, capacity: int = 1024) -> None:
        """Allocate an empty buffer.

        Args:
            capacity: Number of poses that it holds; a full one drops its older half.
        """
        self._stamps = np.full(capacity, -np.inf)
        self._poses = np.zeros((capacity, 7))
        self._count = 0

    def clear(self) -> None:
        """Remove all poses."""
        self._stamps.fill(-np.inf)
        self._count = 0

    def append(
        self, stamp: float, position: NDArray[np.float64], quaternion: NDArray[np.float64]
    ) -> None:
        """Add a pose.

        Args:
            stamp: Time [s], later than the last one.
            position: Coordinates in the track's frame [m], shape (3,).
            quaternion: Rotation x, y, z, w, shape (4,).

        Raises:
            ValueError: If ``stamp`` is not later than the last one.
        """
        if self._count and not stamp > self.latest:
            raise ValueError(f"stamp: expected later than {self.latest} s, got {stamp} s")
        if self._count == len(self._stamps):  # Drop the older half: amortised, the rest in order.
            half = self._count // 2
            self._stamps[: self._count - half] = self._stamps[half:].copy()
            self._poses[: self._count - half] = self._poses[half:].copy()
            self._count -= half
        if self._count and self._poses[self._count - 1, 3:] @ quaternion < 0:
            quaternion = -quaternion  # The same rotation; interpolation takes the short way.
        self._stamps[self._count] = stamp
        self._poses[self._count, :3] = position
        self._poses[self._count, 3:] = quaternion
        self._count += 1

    def extend(self, rows: NDArray[np.float64]) -> None:
        """Add poses, oldest first.

        Args:
            rows: Rows of stamp [s], increasing, coordinates in the track's frame [m] and rotation
                x, y, z, w, shape (k, 8).

        Raises:
            ValueError: If the stamps do not increase from the last one.
        """
        if self._count + len(rows) > len(self._stamps):
            for row in rows:
                self.append(float(row[0]), row[1:4], row[4:])
        elif _add_rows(self._stamps, self._poses, self._count, rows):
            self._count += len(rows)
        else:
            raise ValueError(f"stamps: expected increasing from {self.latest} s, got {rows[:, 0]}")

    def rotated(self, rotation: Rotation) -> "PoseTrack":
        """Return the track of a sensor whose orientation differs from the body's.

        Args:
            rotation: Rotation ``R_body_sensor``.
        """
        track = PoseTrack(max(self._count, 1))
        stamps, poses = self._stamps[: self._count], self._poses[: self._count]
        turned = (Rotation.from_quat(poses[:, 3:]) * rotation).as_quat()
        track.extend(np.column_stack([stamps, poses[:, :3], turned]))
        return track

    @property
    def earliest(self) -> float:
        """Stamp of the oldest pose [s]; infinity when there is none."""
        return float(self._stamps[0]) if self._count else np.inf

    @property
    def latest(self) -> float:
        """Stamp of the newest pose [s]; minus infinity when there is none."""
        return float(self._stamps[self._count - 1]) if self._count else -np.inf

    @property
    def table(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Stamps [s], shape (k,), and buffer of poses as ``at`` returns them, for compiled code.

        Raises:
            ValueError: If the track is empty.
        """
        if not self._count:
            raise ValueError("pose track: expected at least one pose, got none")
        return self._stamps[: self._count], self._poses

    def at(self, stamps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the poses at some instants, clamped to the first and the last pose.

        Args:
            stamps: Times [s], shape (n,).

        Returns:
            Rows of x, y, z [m] and quaternion x, y, z, w, float64, shape (n, 7).

        Raises:
            ValueError: If the track is empty.
        """
        poses = np.empty((7, len(stamps)))
        interpolate(*self.table, stamps, poses)
        return np.ascontiguousarray(poses.T)


@kernel
def interpolate(
    known: NDArray[np.float64],
    poses: NDArray[np.float64],
    stamps: NDArray[np.float64],
    out: NDArray[np.float64],
    after: int = 1,
) -> int:
    """Interpolate poses at stamps that mostly increase.

    Args:
        known: Stamps of the known poses [s], increasing, shape (k,), k at least 1.
        poses: Known poses: position [m] and quaternion x, y, z, w; shape (k or more, 7).
        stamps: Stamps to interpolate at [s], shape (n,).
        out: Poses at the stamps, filled, component by component, shape (7, n or more).
        after: Known pose at which the search begins; see below.

    Returns:
        Known pose after the last stamp, from which a search for the next ones had best begin.
    """
    end = 0
    while end < len(stamps):
        begin = end
        after, end = next_stretch(known, stamps, begin, after)
        # Stamps of an interval at once, as views that begin at zero: the compiler packs the loop.
        interval, times = interval_of(known, poses, after), stamps[begin:end]
        x, y, z = out[0, begin:end], out[1, begin:end], out[2, begin:end]
        qx, qy, qz, qw = out[3, begin:end], out[4, begin:end], out[5, begin:end], out[6, begin:end]
        for k in range(len(times)):
            x[k], y[k], z[k], qx[k], qy[k], qz[k], qw[k] = pose_within(interval, times[k])
    return after


class Interval(NamedTuple):
    """Two poses of a track between which poses are interpolated, the same one twice if alone.

    Attributes:
        begin: Stamp of the earlier pose [s].
        end: Stamp of the later one [s].
        first: Earlier pose.
        second: Later pose.
    """

    begin: float
    end: float
    first: PoseRow
    second: PoseRow


@inlined_kernel
def next_stretch(
    known: NDArray[np.float64], stamps: NDArray[np.float64], begin: int, after: int
) -> tuple[int, int]:
    """Return the known pose after a stamp, and the end of the stamps before the same one.

    Args:
        known: Stamps of the known poses [s], increasing, shape (k,).
        stamps: Stamps [s], shape (n,).
        begin: Number of the stamp.
        after: Known pose at which the search begins: for increasing stamps it costs nothing.

    Returns:
        Number of the pose, from 1 on and the last one's at most, and of the first stamp, after
        ``begin``, that lies in another interval.
    """
    last = len(known) - 1
    while after > 1 and known[after - 1] > stamps[begin]:
        after -= 1
    while after < last and known[after] < stamps[begin]:
        after += 1
    low = known[after - 1] if after > 1 else -np.inf
    high = known[after] if after < last else np.inf
    end = begin + 1
    while end < len(stamps) and low <= stamps[end] <= high:
        end += 1
    return after, end


@inlined_kernel
def interval_of(known: NDArray[np.float64], poses: NDArray[np.float64], after: int) -> Interval:
    """Return the interval that ends with a known pose, of a track with but one pose that one."""
    last = min(after, len(known) - 1)
    end = known[last] if last == after else np.inf
    return Interval(known[after - 1], end, _pose_row(poses, after - 1), _pose_row(poses, last))


@inlined_kernel
def _pose_row(poses: NDArray[np.float64], row: int) -> PoseRow:
    """Return one of some poses, shape (k, 7)."""
    x, y, z, i, j, k, w = poses[row]
    return x, y, z, i, j, k, w


@inlined_kernel
def pose_within(interval: Interval, stamp: float) -> PoseRow:
    """Return the pose at a stamp, clamped to the first and the second pose of an interval."""
    share = (stamp - interval.begin) / (interval.end - interval.begin)
    share = min(max(share, 0.0), 1.0)
    a, b = interval.first, interval.second
    x, y, z = _mix(share, a[0], b[0]), _mix(share, a[1], b[1]), _mix(share, a[2], b[2])
    i, j, k = _mix(share, a[3], b[3]), _mix(share, a[4], b[4]), _mix(share, a[5], b[5])
    w = _mix(share, a[6], b[6])
    # A linear mix of two unit quaternions is shorter than one.
    scale = 1.0 / np.sqrt(i * i + j * j + k * k + w * w)
    return x, y, z, i * scale, j * scale, k * scale, w * scale


@inlined_kernel
def _mix(share: float, a: float, b: float) -> float:
    """Return the mean of two numbers, the second with a share of the weight."""
    return (1 - share) * a + share * b


@kernel
def _add_rows(
    stamps: NDArray[np.float64],
    poses: NDArray[np.float64],
    count: int,
    rows: NDArray[np.float64],
) -> bool:
    """Write rows behind the first ``count`` of a track; return false if stamps do not increase.

    Each quaternion is flipped that lies far from the one before it: the same rotation, between
    which interpolation takes the short way.
    """
    latest = stamps[count - 1] if count else -np.inf
    for k in range(len(rows)):
        if not rows[k, 0] > latest:
            return False
        latest = rows[k, 0]
    for k in range(len(rows)):
        i = count + k
        stamps[i] = rows[k, 0]
        poses[i] = rows[k, 1:]
        if i > 0 and np.dot(poses[i - 1, _QUATERNION:], poses[i, _QUATERNION:]) < 0:
            poses[i, _QUATERNION:] = -poses[i, _QUATERNION:]
    return True
