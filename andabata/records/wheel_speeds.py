"""Wheel speeds from joint states, and body twists from odometry.

Where speeds are missing, or stay zero while the robot moves, they are differences of positions.
"""

import numpy as np
from numpy.typing import NDArray

from andabata.records.remarks import Remarks
from andabata.records.topics import RosMessage
from andabata.records.unusable_message import UnusableMessageError
from andabata.records.wheel_joints import Sides, wheel_sides

_MAX_STEP = 0.5
"""Longest time between two positions that give a speed [s]."""

_MOVED = 0.2
"""Change of a position from which speeds that were always zero are ignored [rad, m]."""

_WRAPPED = 2 * np.pi + 0.01
"""Bound of the angles of wheels that wrap around [rad]."""


class JointSpeeds:
    """Reads wheel speeds from joint states: velocities, or differences of positions without any.

    Attributes:
        names: Joints of the last message without a wheel.
    """

    def __init__(self, remarks: Remarks, topic: str) -> None:
        """Create a reader before the first message.

        Args:
            remarks: Destination of remarks.
            topic: Topic that remarks are about.
        """
        self._remarks, self._topic = remarks, topic
        self.names: tuple[str, ...] = ()
        self._has_velocities = False
        self._uses_positions = False
        self._wraps = True
        self._first: NDArray[np.float64] | None = None
        self._last: tuple[float, NDArray[np.float64]] | None = None

    def speeds(self, message: RosMessage, stamp: float) -> list[float] | None:
        """Return left and right wheel speed [rad/s].

        A message without a wheel, as of an arm, gives None, and so do the first positions.

        Args:
            message: JointState to read.
            stamp: Time of the message [s].

        Raises:
            UnusableMessageError: If the sides are unknown, or one of them has no number.
        """
        names = tuple(message.name)
        sides = wheel_sides(names)
        if sides is None:
            self.names = names
            return None
        velocities = _side_means(message.velocity, sides)
        differences = self._differences(_wheel_values(message.position, sides), sides, stamp)
        if velocities is not None and (any(velocities) or not self._moved):
            self._has_velocities |= any(velocities)
            return velocities
        if self._last is None:
            raise UnusableMessageError(
                "expected velocities or positions of the wheels, got neither velocities nor "
                "positions"
            )
        if not self._uses_positions:
            self._uses_positions = True
            reason = "are missing" if velocities is None else "stay zero while the positions change"
            self._remarks.note(
                self._topic, f"velocities {reason}: wheel speeds are differences of positions"
            )
        return differences

    @property
    def _moved(self) -> bool:
        """True if the wheels have turned and no velocity was ever other than zero."""
        if self._has_velocities or self._first is None or self._last is None:
            return False
        return bool(np.abs(self._last[1] - self._first).max() > _MOVED)

    def _differences(
        self, positions: NDArray[np.float64] | None, sides: Sides, stamp: float
    ) -> list[float] | None:
        """Return speeds by the change since the last positions, None without one."""
        before = self._last
        if positions is None:
            self._last = None
            return None
        if self._first is None or self._first.shape != positions.shape:
            self._first, before = positions, None
        self._wraps &= bool(np.abs(positions).max() < _WRAPPED)
        self._last = (stamp, positions)
        if before is None or not 0 < stamp - before[0] < _MAX_STEP:
            return None
        change = positions - before[1]
        if self._wraps:
            change = (change + np.pi) % (2 * np.pi) - np.pi
        speeds, left = change / (stamp - before[0]), len(sides[0])
        return [float(speeds[:left].mean()), float(speeds[left:].mean())]


def _wheel_values(numbers: NDArray[np.float64], sides: Sides) -> NDArray[np.float64] | None:
    """Return the numbers of left, then right wheels, None where one is missing."""
    chosen = [*sides[0], *sides[1]]
    if len(numbers) <= max(chosen):
        return None
    found = np.asarray(numbers, dtype=np.float64)[chosen]
    return found if np.isfinite(found).all() else None


def _side_means(numbers: NDArray[np.float64], sides: Sides) -> list[float] | None:
    """Return the mean of each side over its wheels with a number, None where a side has none."""
    if len(numbers) <= max(*sides[0], *sides[1]):
        return None
    found = []
    for side in sides:
        finite = [value for k in side if np.isfinite(value := float(numbers[k]))]
        if not finite:
            return None
        found.append(float(np.mean(finite)))
    return found


class OdometryTwist:
    """Reads forward speed and yaw rate of odometry: its twist, or changes of its pose."""

    def __init__(self, remarks: Remarks, topic: str) -> None:
        """Create a reader before the first message; see ``JointSpeeds``."""
        self._remarks, self._topic = remarks, topic
        self._has_twists = False
        self._first: NDArray[np.float64] | None = None
        self._last: tuple[float, NDArray[np.float64]] | None = None

    def twist(self, message: RosMessage, stamp: float) -> tuple[float, float] | None:
        """Return speed [m/s] and yaw rate [rad/s], None where two poses are needed.

        Args:
            message: Odometry to read.
            stamp: Time of the message [s].
        """
        given = message.twist.twist
        speed, yaw_rate = float(given.linear.x), float(given.angular.z)
        if speed or yaw_rate:
            self._has_twists = True
        if self._has_twists:
            return speed, yaw_rate
        pose, before = _planar_pose(message), self._last
        self._last = (stamp, pose)
        if self._first is None or before is None:
            self._first = pose
        change = pose - self._first
        change[2] = (change[2] + np.pi) % (2 * np.pi) - np.pi
        if before is None or not np.abs(change).max() > _MOVED:
            return speed, yaw_rate
        self._remarks.note(
            self._topic, "the twist stays zero while the pose changes: speeds are its changes"
        )
        seconds = stamp - before[0]
        if not 0 < seconds < _MAX_STEP:
            return None
        return _mean_twist(before[1], pose, seconds)


def _planar_pose(message: RosMessage) -> NDArray[np.float64]:
    """Return x, y [m] and yaw [rad] of odometry, shape (3,)."""
    p, q = message.pose.pose.position, message.pose.pose.orientation
    yaw = np.arctan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
    return np.array([p.x, p.y, yaw])


def _mean_twist(
    before: NDArray[np.float64], after: NDArray[np.float64], seconds: float
) -> tuple[float, float]:
    """Return the mean speed [m/s] and yaw rate [rad/s] between two planar poses.

    The step is projected onto the heading at half of the turn: exact for a circular arc's chord.
    """
    step = after - before
    turn = (step[2] + np.pi) % (2 * np.pi) - np.pi
    heading = before[2] + turn / 2
    forward = step[0] * np.cos(heading) + step[1] * np.sin(heading)
    return float(forward / seconds), float(turn / seconds)
