"""The upper bound: follow the shortest safe path on the true map, from the true pose."""

import numpy as np
from numpy.typing import NDArray

from andabata.machine.pose import wrap
from andabata.navigation.view import View
from worlds.world import World

_ROOMS = (0.3, 0.45, 0.6, 0.9)
"""Clearances that are tried, the least first [m]."""

_DETOUR = 1.15
"""A roomier path may be longer by this factor."""


class OracleController:
    """Plans on the true map and follows the plan by pure pursuit: it knows what no robot knows."""

    def __init__(self, world: World, look_ahead: float = 0.9, gain: float = 2.5) -> None:
        """Prepare for one world.

        Args:
            world: Whose truth is used.
            look_ahead: Distance of the pursued point along the path [m].
            gain: From the bearing of that point to the yaw rate [1/s].
        """
        self._world = world
        self._look_ahead = look_ahead
        self._gain = gain
        self.reset()

    def reset(self) -> None:
        """Forget the plan."""
        self._goal: NDArray[np.float64] | None = None
        self._path = np.zeros((0, 2))
        self._next = 0

    def steer(self, view: View) -> float:
        """Return a yaw rate along the plan [rad/s].

        Raises:
            ValueError: If the view holds no truth, or no safe path exists.
        """
        if view.truth is None:
            raise ValueError(
                "truth: expected the true state (the oracle drives in simulation only), got none"
            )
        here = view.truth.pose.position[:2]
        if self._goal is None or not np.array_equal(self._goal, view.goal):
            self._plan(here, view.goal)
        window = self._path[self._next : self._next + 80]
        gaps = np.hypot(*(window - here).T)
        nearest = int(np.argmin(gaps))
        self._next += nearest
        if gaps[nearest] > 1.5:
            self._plan(here, view.goal)
        ahead = np.hypot(*(self._path[self._next :] - here).T) >= self._look_ahead
        offset = int(np.argmax(ahead)) if ahead.any() else len(ahead) - 1
        target = self._path[self._next + offset]
        bearing = float(np.arctan2(target[1] - here[1], target[0] - here[0]))
        return self._gain * wrap(bearing - view.truth.pose.yaw)

    def _plan(self, here: NDArray[np.float64], goal: NDArray[np.float64]) -> None:
        """Find the roomiest path that is hardly longer, and cut it into steps of 0.1 m."""
        path = self._roomiest(here, goal)
        lengths = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        steps = np.linspace(0.0, lengths[-1], max(2, int(lengths[-1] / 0.1)))
        self._path = np.column_stack([np.interp(steps, lengths, path[:, k]) for k in range(2)])
        self._goal = np.array(goal, dtype=np.float64)
        self._next = 0

    def _roomiest(
        self, here: NDArray[np.float64], goal: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the path with the most room that is at most ``_DETOUR`` times the shortest."""
        best, least = None, np.inf
        for room in _ROOMS:
            path = self._world.truth.shortest_path(here, goal, room)
            if path is None:
                continue
            length = float(np.hypot(*np.diff(path, axis=0).T).sum())
            least = min(least, length)
            if best is None or length <= _DETOUR * least:
                best = path
        if best is None:
            raise ValueError(
                f"oracle: expected a safe path to {goal.tolist()}, got none from {here.tolist()}"
            )
        return best
