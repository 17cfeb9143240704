"""Wheel speeds from joint states, and body twists from odometry.

Where speeds are missing, or stay zero while the robot moves, they are differences of positions.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from andabata.records.decoding.joint_signs import JointSigns
from andabata.records.decoding.position_tracks import MAX_STEP, PositionTracks
from andabata.records.decoding.unusable_message import UnusableMessageError
from andabata.records.decoding.wheel_joints import Sides, wheel_sides
from andabata.records.remarks import Remarks
from andabata.records.topics import RosMessage

TWO_NODES = (
    "expected one publisher of wheel speeds, got two: messages of one that stands still are left "
    "out; stop that node (often a joint_state_publisher) before the next recording"
)
"""Remark on wheel speeds of two nodes."""

_MOVED = 0.2
"""Change of a pose from which twists that were always zero are ignored [m, rad]."""


@dataclass(frozen=True)
class JointFacts:
    """Facts about the joint states of a session, known from an earlier pass over it.

    Attributes:
        reversed_names: Joints that are counted backwards.
        has_velocities: True if some messages hold speeds of the wheels.
    """

    reversed_names: frozenset[str] = frozenset()
    has_velocities: bool = False


class JointSpeeds:
    """Reads wheel speeds from joint states: velocities, or differences of positions without any.

    Two nodes may publish joint states on one topic. Messages without speeds beside others that have
    some, and positions that jump back to those of a node that stands still, are refused.

    Attributes:
        names: Joints of the last message without a wheel.
    """

    def __init__(self, remarks: Remarks, topic: str, facts: JointFacts | None = None) -> None:
        """Create a reader before the first message.

        Args:
            remarks: Destination of remarks.
            topic: Topic that remarks are about.
            facts: Facts that are known before, or None.
        """
        facts = facts or JointFacts()
        self._remarks, self._topic = remarks, topic
        self.names: tuple[str, ...] = ()
        self._signs = JointSigns(facts.reversed_names)
        self._has_velocities = facts.has_velocities
        self._uses_positions = False
        self._orders: dict[tuple[str, ...], PositionTracks] = {}

    @property
    def facts(self) -> JointFacts:
        """Facts that are known so far."""
        return JointFacts(self._signs.reversed_names, self._has_velocities)

    def speeds(self, message: RosMessage, stamp: float) -> list[float] | None:
        """Return left and right wheel speed [rad/s].

        A message without a wheel, as of an arm, gives None, and so do the first positions.

        Args:
            message: JointState to read.
            stamp: Time of the message [s].

        Raises:
            UnusableMessageError: If the sides are unknown, one of them has no number, or the
                message is of a node that publishes beside another.
        """
        names = tuple(message.name)
        sides = wheel_sides(names)
        if sides is None:
            self.names = names
            return None
        tracks = self._tracks(names)
        wheels = _Wheels.of(names, sides)
        velocities = wheels.means(wheels.pick(message.velocity), self._signs)
        if self._signs.reversed_names:
            reversed_names = ", ".join(sorted(self._signs.reversed_names))
            text = "joints that turn against the others of their side are reversed: "
            self._remarks.note(self._topic, text + reversed_names)
        positions = wheels.pick(message.position)
        if velocities is not None and (any(velocities) or not tracks.moved or self._has_velocities):
            self._has_velocities |= any(velocities)
            self._follow(tracks, positions, stamp)
            return velocities
        if velocities is None and self._has_velocities:
            self._remarks.fail(self._topic, TWO_NODES)
            raise UnusableMessageError(
                "expected velocities of the wheels, as other messages of the topic have, got none"
            )
        if positions is None or not np.isfinite(positions).all():
            raise UnusableMessageError(
                "expected velocities or positions of the wheels, got neither velocities nor "
                "positions"
            )
        change = self._follow(tracks, positions, stamp)
        if change is not None and change.any() and not self._uses_positions:
            self._uses_positions = True
            reason = "are missing" if velocities is None else "stay zero while the positions change"
            text = f"velocities {reason}: wheel speeds are differences of positions"
            self._remarks.note(self._topic, text)
        return None if change is None else wheels.means(change, self._signs)

    def _follow(
        self, tracks: PositionTracks, positions: NDArray[np.float64] | None, stamp: float
    ) -> NDArray[np.float64] | None:
        """Return the speeds since the positions before; see ``PositionTracks.add``.

        Raises:
            UnusableMessageError: If the positions are of a second node.
        """
        try:
            return tracks.add(positions, stamp)
        except UnusableMessageError:
            self._remarks.fail(self._topic, TWO_NODES)
            raise

    def _tracks(self, names: tuple[str, ...]) -> "PositionTracks":
        """Return the positions of messages with their joints in this order."""
        if names not in self._orders:
            self._orders[names] = PositionTracks()
            if len(self._orders) > 1:
                orders = " and ".join(", ".join(order) for order in list(self._orders)[:2])
                self._remarks.note(
                    self._topic, f"two nodes publish the wheels' joints, in two orders: {orders}"
                )
        return self._orders[names]


@dataclass(frozen=True)
class _Wheels:
    """Wheels among the joints of a message.

    Attributes:
        chosen: Indices of the left, then the right wheels, by name.
        names: Names of the same.
        left: Number of the left ones.
    """

    chosen: tuple[int, ...]
    names: tuple[str, ...]
    left: int

    @classmethod
    def of(cls, names: tuple[str, ...], sides: Sides) -> "_Wheels":
        """Return the wheels of a message, in the same order whatever that of the joints is."""
        chosen = tuple(k for side in sides for k in sorted(side, key=lambda k: names[k]))
        return cls(chosen, tuple(names[k] for k in chosen), len(sides[0]))

    @property
    def sides(self) -> Sides:
        """Indices of the left and of the right wheels among ``names``."""
        return tuple(range(self.left)), tuple(range(self.left, len(self.names)))

    def pick(self, numbers: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Return the numbers of the wheels, None where one is missing."""
        if len(numbers) <= max(self.chosen):
            return None
        return np.asarray(numbers, dtype=np.float64)[list(self.chosen)]

    def means(self, numbers: NDArray[np.float64] | None, signs: JointSigns) -> list[float] | None:
        """Return the mean of each side over its wheels with a number, None where one has none."""
        if numbers is None:
            return None
        corrected = signs.corrected(self.names, self.sides, numbers)
        means = []
        for side in self.sides:
            finite = corrected[list(side)][np.isfinite(corrected[list(side)])]
            if not len(finite):
                return None
            means.append(float(finite.mean()))
        return means


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
        if not 0 < seconds < MAX_STEP:
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
