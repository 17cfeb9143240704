"""Seam between learners and environments."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

State = NDArray[np.float32]


class Environment(Protocol):
    """A Gymnasium environment whose last info of an episode names its outcome.

    Observations are float32, shape (n_observations,); actions are shares from -1 to 1, float32,
    shape (n_actions,). The last ``info`` of an episode has ``is_success`` (bool), ``outcome`` (str)
    and, where the robot turns, ``turns`` (float); every ``info`` of a step has ``reward_terms``.

    Every info, that of a reset too, may hold ``situations``, float32, shape (m,): enough to render
    the observation anew. They are remembered in the place of observations.
    """

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[State, dict[str, Any]]:
        """Begin an episode."""

    def step(self, action: NDArray[np.float32]) -> tuple[State, float, bool, bool, dict[str, Any]]:
        """Return state, reward, terminated, truncated and info after one control step."""

    def close(self) -> None:
        """Free everything."""


class VectorEnvironment(Protocol):
    """A Gymnasium vector environment that begins episodes on request.

    A robot whose episode is over stands still until ``reset`` with a ``reset_mask`` begins its next
    one. The infos of a step in which episodes end hold ``is_success``, ``outcome`` and ``turns`` of
    each. Infos may hold ``situations``, shape (n, m), as in ``Environment``. The arrays of a step
    are not written to by later ones.
    """

    num_envs: int

    def reset(
        self, *, seed: list[int | None], options: dict[str, Any]
    ) -> tuple[State, dict[str, Any]]:
        """Begin episodes and return the states of all robots, shape (n, n_observations)."""

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[State, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Return states, rewards, terminated, truncated and infos after one control step.

        Args:
            actions: Shares from -1 to 1, float32, shape (n, n_actions).
        """


def world_of_level(level: float, count: int) -> int:
    """Return the index of the world that a level names among ``count``, the easiest first."""
    return round(level * (count - 1))
