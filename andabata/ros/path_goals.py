"""Goals along a path that another planner publishes, as Nav2's planner server does."""

import threading

import numpy as np
from numpy.typing import NDArray

from andabata.records.topics import RosMessage, Topic

_AHEAD = 4.0
"""Length of path between the robot and its goal [m]: well inside of what the robot sees."""

_NEAR = 0.5 * _AHEAD
"""Distance to a goal within which the next one is chosen [m], so that none of them is reached."""

_OWN_FRAME = "odom"
"""Frame of the path that the navigator publishes itself."""

_FRAMES = ("", "map")
"""Frames of a path that is used; an empty one is taken for the map's."""


class PathGoals:
    """Turns the last path received into goals: a point ahead of the robot, at last its end.

    A graph's thread writes, the navigator reads.

    Attributes:
        refusals: Why paths were not used, a line each, without repetition.
    """

    def __init__(self) -> None:
        """Begin without a path."""
        self._lock = threading.Lock()
        self._path = np.zeros((0, 2))
        self._next = 0
        self._goal: NDArray[np.float64] | None = None
        self.refusals: list[str] = []

    def add(self, topic: Topic, message: RosMessage) -> None:
        """Take a path; one that cannot be used is refused, and the last one stays.

        Args:
            topic: Topic of the path.
            message: ``nav_msgs/Path`` in the frame of the map.
        """
        frame = message.header.frame_id.lstrip("/")
        places = [each.pose.position for each in message.poses]
        path = np.array([(place.x, place.y) for place in places]).reshape(-1, 2)
        if frame not in _FRAMES:
            self._refuse(topic, f"expected a path in map, got one in {frame}{_hint(frame)}")
        elif not len(path):
            self._refuse(topic, "expected a path of at least one pose, got an empty one")
        elif not np.isfinite(path).all():
            self._refuse(topic, "expected finite positions, got a path with others")
        else:
            with self._lock:
                self._path, self._next, self._goal = path, 0, None

    def _refuse(self, topic: Topic, reason: str) -> None:
        """Note why a path was not used."""
        text = f"{topic.ros1}: {reason}; the last path stays"
        if text not in self.refusals:
            self.refusals.append(text)

    def goal(self, position: NDArray[np.float64]) -> NDArray[np.float64] | None:
        """Return where to drive to in the map [m], shape (2,); None before the first path.

        Args:
            position: Position of the robot in the map [m], shape (2,).
        """
        with self._lock:
            if len(self._path) and self._is_due(position):
                self._advance(position)
            return self._goal

    def _is_due(self, position: NDArray[np.float64]) -> bool:
        """Return True if the next goal is to be chosen."""
        if self._goal is None:
            return True
        is_last = self._next == len(self._path) - 1
        return not is_last and bool(np.hypot(*(self._goal - position)) < _NEAR)

    def _advance(self, position: NDArray[np.float64]) -> None:
        """Choose the point at a length of path ahead of the robot; never an earlier one."""
        rest = self._path[self._next :]
        lengths = np.append(0.0, np.cumsum(np.hypot(*np.diff(rest, axis=0).T)))
        # A path that comes back to where it was is not cut short.
        reach = np.inf if self._goal is None else _AHEAD
        near = rest[: int(np.searchsorted(lengths, reach, side="right"))]
        nearest = int(np.argmin(np.hypot(*(near - position).T)))
        ahead = int(np.searchsorted(lengths, lengths[nearest] + _AHEAD))
        self._next = min(self._next + ahead, len(self._path) - 1)
        self._goal = self._path[self._next].copy()


def _hint(frame: str) -> str:
    """Return what to do about a path in a frame."""
    if frame != _OWN_FRAME:
        return ""
    return " (if it is the navigator's own: --no-map, or in ROS 2 --remap /plan=/local_plan)"
