"""Wheel speeds of both sides from joints or odometry, by differences where speeds are missing."""

import re
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from andabata.records.remarks import Remarks
from andabata.records.row_error import RowError
from andabata.records.topics import RosMessage

_LEFT = frozenset({"left", "l", "lf", "fl", "lb", "bl", "rl", "lr", "ml", "lm", "lh"})
_RIGHT = frozenset({"right", "r", "rf", "fr", "rb", "br", "rr", "mr", "rm", "rh"})
"""Tokens of a joint's name that tell its side; ``rl`` is rear left and ``lr`` left rear."""

_WHEEL = ("wheel", "whl", "tire", "tyre")
_DRIVE = ("track", "drive", "motor", "axle")
_NO_DRIVE = ("caster", "castor", "steer", "suspension")

_PLAIN = frozenset(
    {"front", "rear", "back", "middle", "mid", "centre", "center", "base", "joint", "link"}
)
"""What may stand beside the side in the name of a wheel that isn't called one."""

_STEP = 0.5
"""Positions further apart give no speed [s]."""

_MOVED = 0.2
"""Speeds that have been zero are not believed once a position has changed by so much [rad, m]."""

Sides = tuple[tuple[int, ...], tuple[int, ...]]


def _tokens(name: str) -> list[str]:
    """Return the parts of a joint's name, lower case, without numbers."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", name)
    joined = re.sub(r"(wheel|whl|left|right|front|rear|joint|drive)", r"_\1_", apart.lower())
    return [token for token in re.split(r"[^a-z]+", joined) if token]


def _side(tokens: list[str]) -> int | None:
    """Return 0 for left, 1 for right, None where the name tells none or both."""
    found = set(tokens)
    if ("left" in found) != ("right" in found):
        return int("right" in found)
    left, right = bool(_LEFT & found), bool(_RIGHT & found)
    return int(right) if left != right else None


@lru_cache(maxsize=64)
def wheel_sides(names: tuple[str, ...]) -> Sides | None:
    """Return which joints are left and which are right wheels; None where none is a wheel.

    Args:
        names: Names of the joints in whatever spelling: ``front_left_wheel``, ``wheel_l_joint``,
            ``fl_wheel``, ``RearRightWheel``.

    Raises:
        RowError: If there are wheels and their sides can't be told.
    """
    parted = {k: _tokens(name) for k, name in enumerate(names)}
    driven = {k: t for k, t in parted.items() if not any(w in p for p in t for w in _NO_DRIVE)}
    for words in (_WHEEL, _DRIVE):
        chosen = [k for k, t in driven.items() if any(w in p for p in t for w in words)]
        if chosen:
            break
    else:
        alone = _PLAIN | _LEFT | _RIGHT
        chosen = [k for k, t in driven.items() if t and set(t) <= alone and _side(t) is not None]
    if not chosen:
        return None
    sides = [tuple(k for k in chosen if _side(parted[k]) == side) for side in (0, 1)]
    if not all(sides):
        found = ", ".join(names[k] for k in chosen)
        raise RowError(f"name: expected left and right wheels, got {found}")
    return sides[0], sides[1]


class Joints:
    """Wheel speeds from joint states: velocities, or differences of positions without any.

    Attributes:
        names: Joints of the last message that named no wheel.
    """

    def __init__(self, remarks: Remarks, sense: str) -> None:
        """Begin before the first message."""
        self._remarks, self._sense = remarks, sense
        self.names: tuple[str, ...] = ()
        self._spoke = False
        self._by_position = False
        self._wraps = True
        self._first: NDArray[np.float64] | None = None
        self._last: tuple[float, NDArray[np.float64]] | None = None

    def speeds(self, message: RosMessage, stamp: float) -> list[float] | None:
        """Return left and right wheel speed [rad/s].

        None comes of a message that names no wheel, as of an arm, and of the first of positions.

        Raises:
            RowError: If the sides can't be told, or it holds no number for one of them.
        """
        names = tuple(message.name)
        sides = wheel_sides(names)
        if sides is None:
            self.names = names
            return None
        given = _by_side(message.velocity, sides)
        change = self._change(_values(message.position, sides), sides, stamp)
        if given is not None and (any(given) or not self._moved):
            self._spoke |= any(given)
            return given
        if self._last is None:
            raise RowError("it has neither velocities nor positions of the wheels")
        if not self._by_position:
            self._by_position = True
            reason = "are missing" if given is None else "stay zero while the positions change"
            self._remarks.note(
                self._sense, f"velocities {reason}: wheel speeds are differences of positions"
            )
        return change

    @property
    def _moved(self) -> bool:
        """Whether the wheels have turned and no velocity ever told."""
        if self._spoke or self._first is None or self._last is None:
            return False
        return bool(np.abs(self._last[1] - self._first).max() > _MOVED)

    def _change(
        self, positions: NDArray[np.float64] | None, sides: Sides, stamp: float
    ) -> list[float] | None:
        """Return speeds by the change since the last positions, None without one."""
        before = self._last
        if positions is None:
            self._last = None
            return None
        if self._first is None or self._first.shape != positions.shape:
            self._first, before = positions, None
        self._wraps &= bool(np.abs(positions).max() < 2 * np.pi + 0.01)
        self._last = (stamp, positions)
        if before is None or not 0 < stamp - before[0] < _STEP:
            return None
        turned = positions - before[1]
        if self._wraps:
            turned = (turned + np.pi) % (2 * np.pi) - np.pi
        speeds, left = turned / (stamp - before[0]), len(sides[0])
        return [float(speeds[:left].mean()), float(speeds[left:].mean())]


def _values(numbers: NDArray[np.float64], sides: Sides) -> NDArray[np.float64] | None:
    """Return the numbers of left and right wheels, None where one is missing."""
    chosen = [*sides[0], *sides[1]]
    if len(numbers) <= max(chosen):
        return None
    found = np.asarray(numbers, dtype=np.float64)[chosen]
    return found if np.isfinite(found).all() else None


def _by_side(numbers: NDArray[np.float64], sides: Sides) -> list[float] | None:
    """Return the mean of each side over its wheels that have a number, None without any."""
    if len(numbers) <= max(*sides[0], *sides[1]):
        return None
    found = []
    for side in sides:
        whole = [value for k in side if np.isfinite(value := float(numbers[k]))]
        if not whole:
            return None
        found.append(float(np.mean(whole)))
    return found


class TwistOfOdometry:
    """Forward speed and yaw rate of odometry: its twist, or changes of its pose without any."""

    def __init__(self, remarks: Remarks, sense: str) -> None:
        """Begin before the first message."""
        self._remarks, self._sense = remarks, sense
        self._spoke = False
        self._first: NDArray[np.float64] | None = None
        self._last: tuple[float, NDArray[np.float64]] | None = None

    def twist(self, message: RosMessage, stamp: float) -> tuple[float, float] | None:
        """Return speed [m/s] and yaw rate [rad/s], None where only a second pose tells them."""
        given = message.twist.twist
        speed, yaw_rate = float(given.linear.x), float(given.angular.z)
        if speed or yaw_rate:
            self._spoke = True
        if self._spoke:
            return speed, yaw_rate
        p, q = message.pose.pose.position, message.pose.pose.orientation
        yaw = np.arctan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
        pose, before = np.array([p.x, p.y, yaw]), self._last
        self._last = (stamp, pose)
        if self._first is None or before is None:
            self._first = pose
        change = pose - self._first
        change[2] = (change[2] + np.pi) % (2 * np.pi) - np.pi
        if before is None or not np.abs(change).max() > _MOVED:
            return speed, yaw_rate
        self._remarks.note(
            self._sense, "the twist stays zero while the pose changes: speeds are its changes"
        )
        seconds = stamp - before[0]
        if not 0 < seconds < _STEP:
            return None
        step = pose - before[1]
        turn = (step[2] + np.pi) % (2 * np.pi) - np.pi
        middle = before[1][2] + turn / 2
        ahead = step[0] * np.cos(middle) + step[1] * np.sin(middle)
        return float(ahead / seconds), float(turn / seconds)
