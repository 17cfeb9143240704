"""Rigid transforms, and the history of the transforms between two frames."""

import math
import warnings
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

_STILL = 1e-6
"""Largest difference of two transforms that count as equal [m and 1]."""

MAX_SHIFT = 0.05
"""Largest distance between two poses of one frame that agree [m]."""

MAX_TURN = np.deg2rad(3.0)
"""Largest angle between two poses of one frame that agree [rad]."""

_RETURN_SHARE = 0.25
"""Distance from the last but one, as a share of that to the last, below which a pose returns."""

_ROW = 8
"""Number of values per row of a history: stamp, x, y, z, quaternion x, y, z, w."""


@dataclass(frozen=True)
class Transform:
    """``T_a_b``: takes coordinates in b to coordinates in a, at one instant or at n instants.

    Attributes:
        rotation: One rotation, or n of them.
        translation: Origin of b in a [m], float64, shape (3,) or (n, 3).
    """

    rotation: Rotation
    translation: NDArray[np.float64]

    @classmethod
    def identity(cls) -> "Transform":
        """Return the transform that changes nothing."""
        return cls(Rotation.identity(), np.zeros(3))

    @property
    def inverse(self) -> "Transform":
        """The inverse ``T_b_a``."""
        inverse_rotation = self.rotation.inv()
        return Transform(inverse_rotation, -inverse_rotation.apply(self.translation))

    def __matmul__(self, other: "Transform") -> "Transform":
        """Return ``T_a_c`` of ``T_a_b @ T_b_c``."""
        translation = self.translation + self.rotation.apply(other.translation)
        return Transform(self.rotation * other.rotation, translation)

    def apply(self, points: NDArray[np.floating]) -> NDArray[np.float64]:
        """Return points of b in a [m], shape (n, 3)."""
        return self.rotation.apply(points) + self.translation


@dataclass
class TransformHistory:
    """Transforms from one child frame to its parent, by time.

    Attributes:
        parent: Name of the parent frame.
        static: True if /tf_static published it.
        moves: True if its transforms differ; older publishers repeat a static one on /tf.
        returns: Number of transforms that jump back to the last but one, as those of two publishers
            of one joint do.
        rows: Stamp [s], x, y, z [m], quaternion x, y, z, w of each transform, one after the other.
    """

    parent: str
    static: bool
    moves: bool = False
    returns: int = 0
    rows: "array[float]" = field(default_factory=lambda: array("d"))
    _table: NDArray[np.float64] | None = None

    def add(self, stamp: float, numbers: list[float]) -> None:
        """Add a transform; a static history keeps the last alone.

        Args:
            stamp: Time of the transform [s].
            numbers: Position x, y, z [m] and quaternion x, y, z, w.
        """
        if self.static:
            self.rows = array("d")
        elif self.rows and not self.moves:
            self.moves = differ(self.first, numbers)
        if self.moves and len(self.rows) >= 2 * _ROW:
            self.returns += _jumps_back(self.before_last, self.last, numbers)
        self.rows.extend([stamp, *numbers])
        self._table = None

    @property
    def count(self) -> int:
        """Number of transforms that are kept."""
        return len(self.rows) // _ROW

    @property
    def last(self) -> Sequence[float]:
        """The transform that was added last; see ``first``."""
        return self.rows[-_ROW + 1 :]

    @property
    def before_last(self) -> Sequence[float]:
        """The transform that was added last but one; see ``first``."""
        return self.rows[-2 * _ROW + 1 : -_ROW]

    @property
    def first(self) -> Sequence[float]:
        """The first transform as x, y, z [m], quaternion x, y, z, w."""
        return self.rows[1:_ROW]

    def prune(self, seconds: float) -> None:
        """Keep the latest ``seconds``, once the history reaches back twice as far."""
        newest = self.rows[-_ROW]
        if newest - self.rows[0] > 2 * seconds:
            starts = range(0, len(self.rows), _ROW)
            oldest = next(k for k in starts if newest - self.rows[k] <= seconds)
            self.rows = self.rows[oldest:]
            self._table = None

    @property
    def table(self) -> NDArray[np.float64]:
        """Rows of stamp, x, y, z, quaternion by increasing stamps, shape (k, 8)."""
        if self._table is None:
            rows = np.array(self.rows).reshape(-1, _ROW)
            order = np.argsort(rows[:, 0], kind="stable")
            last = np.append(np.diff(rows[order, 0]) > 0, True)  # The later of equal stamps counts.
            self._table = rows[order][last]
        return self._table

    def latest(self) -> Transform:
        """Return the newest transform."""
        row = self.table[-1]
        return Transform(Rotation.from_quat(row[4:]), row[1:4])

    def at(self, stamps: NDArray[np.float64]) -> Transform:
        """Return the transforms at n instants, interpolated between the neighbours in time.

        Positions are interpolated linearly, rotations spherically; before the first row and after
        the last the nearest one holds.

        Args:
            stamps: Instants [s], shape (n,).
        """
        table = self.table
        after = np.clip(np.searchsorted(table[:, 0], stamps), 1, len(table) - 1)
        one, two = table[after - 1], table[after]
        share = np.clip((stamps - one[:, 0]) / (two[:, 0] - one[:, 0]), 0.0, 1.0)[:, None]
        first, second = Rotation.from_quat(one[:, 4:]), Rotation.from_quat(two[:, 4:])
        # The shorter arc, whichever sign the quaternions have: the rotation vector is unique.
        step = Rotation.from_rotvec((first.inv() * second).as_rotvec() * share)
        return Transform(first * step, one[:, 1:4] + share * (two[:, 1:4] - one[:, 1:4]))


def _jumps_back(before: Sequence[float], last: Sequence[float], numbers: Sequence[float]) -> bool:
    """Return True if a transform returns from ``last`` to the one before it, over a long way."""
    away, back = (pose_difference(last, before), pose_difference(numbers, before))
    return any(
        there > bound and here < _RETURN_SHARE * there
        for there, here, bound in zip(away, back, (MAX_SHIFT, MAX_TURN), strict=True)
    )


def differ(one: Sequence[float], other: Sequence[float]) -> bool:
    """Return True if two transforms differ.

    Args:
        one: Position x, y, z [m] and quaternion x, y, z, w of a transform.
        other: Position and quaternion of the other transform; q and -q are one rotation.
    """
    sign = 1.0 if sum(a * b for a, b in zip(one[3:], other[3:], strict=True)) > 0 else -1.0
    shift = max(abs(a - b) for a, b in zip(one[:3], other[:3], strict=True))
    turn = max(abs(a - sign * b) for a, b in zip(one[3:], other[3:], strict=True))
    return max(shift, turn) > _STILL


def pose_difference(one: Sequence[float], other: Sequence[float]) -> tuple[float, float]:
    """Return the distance [m] and the angle [rad] between two transforms; see ``differ``."""
    cosine = abs(sum(a * b for a, b in zip(one[3:], other[3:], strict=True)))
    return math.dist(one[:3], other[:3]), 2 * math.acos(min(cosine, 1.0))


def yaw_pitch_roll(rotation: Rotation) -> list[float]:
    """Return yaw, pitch and roll [rad]; at a pitch of 90 degrees, roll is 0."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        angles: list[float] = rotation.as_euler("ZYX").tolist()
    return angles


def mounting_numbers(transform: Transform) -> list[float]:
    """Return x, y, z [m], roll, pitch and yaw [deg], as ``--mounting`` takes them."""
    angles = np.rad2deg(yaw_pitch_roll(transform.rotation)[::-1])
    return [*transform.translation.tolist(), *angles.tolist()]
