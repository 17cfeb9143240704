"""Poses, and the track of poses that tells where the robot was at the instant of each beam."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation


def wrap(angle: float) -> float:
    """Return an angle [rad] wrapped to (-pi, pi]."""
    return float(np.pi - (np.pi - angle) % (2 * np.pi))


@dataclass(frozen=True)
class Pose:
    """Where ``base_footprint`` (centre of the wheel contact points, X forward) is in the map.

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
        quaternion = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat()
        return cls(np.asarray(position, dtype=np.float64), quaternion)

    @property
    def yaw(self) -> float:
        """Heading [rad], 0 = east, counter-clockwise."""
        x, y, z, w = self.quaternion
        return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))

    @property
    def matrix(self) -> NDArray[np.float64]:
        """``T_map_base``, shape (4, 4)."""
        T_map_base = np.eye(4)
        T_map_base[:3, :3] = Rotation.from_quat(self.quaternion).as_matrix()
        T_map_base[:3, 3] = self.position
        return T_map_base


class PoseTrack:
    """The latest poses by time, in a ring that lives as long as the robot.

    Positions are interpolated linearly and rotations by normalised linear interpolation, which for
    the few milliseconds between two entries differs from slerp by less than a microradian.
    """

    def __init__(self, capacity: int = 1024) -> None:
        self._stamps = np.full(capacity, -np.inf)
        self._poses = np.zeros((capacity, 7))
        self._count = 0

    def clear(self) -> None:
        """Forget everything."""
        self._stamps.fill(-np.inf)
        self._count = 0

    def append(
        self, stamp: float, position: NDArray[np.float64], quaternion: NDArray[np.float64]
    ) -> None:
        """Add a pose; stamps [s] must grow.

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
            quaternion = -quaternion  # The same rotation, on the near side for interpolation.
        self._stamps[self._count] = stamp
        self._poses[self._count, :3] = position
        self._poses[self._count, 3:] = quaternion
        self._count += 1

    def extend(
        self,
        stamps: NDArray[np.float64],
        positions: NDArray[np.float64],
        quaternions: NDArray[np.float64],
    ) -> None:
        """Add poses, oldest first: stamps [s] (k,), positions [m] (k, 3), quaternions (k, 4)."""
        for stamp, position, quaternion in zip(stamps, positions, quaternions, strict=True):
            self.append(float(stamp), position, quaternion)

    @property
    def latest(self) -> float:
        """Stamp of the newest pose [s]; minus infinity when there is none."""
        return float(self._stamps[self._count - 1]) if self._count else -np.inf

    def at(self, stamps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the poses at the given instants; before the first and after the last, those.

        Args:
            stamps: Times [s], shape (n,).

        Returns:
            x, y, z [m], then the quaternion x, y, z, w, float64, shape (n, 7).

        Raises:
            ValueError: If the track is empty.
        """
        if not self._count:
            raise ValueError("pose track: expected at least one pose, got none")
        known = self._stamps[: self._count]
        after = np.clip(np.searchsorted(known, stamps), 1, max(self._count - 1, 1))
        if self._count == 1:
            return np.repeat(self._poses[:1], len(stamps), axis=0)
        before = after - 1
        span = known[after] - known[before]
        share = np.clip((stamps - known[before]) / span, 0.0, 1.0)[:, None]
        poses = (1 - share) * self._poses[before] + share * self._poses[after]
        poses[:, 3:] /= np.linalg.norm(poses[:, 3:], axis=1, keepdims=True)
        return poses
