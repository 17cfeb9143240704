"""What the learners ask of an environment."""

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

State = NDArray[np.float32]


class Environment(Protocol):
    """A Gymnasium environment whose last info of an episode names its outcome.

    Observations are float32, shape (n,); actions are float32, shape (1,), from -1 to 1, a share of
    the steering limit. The last ``info`` of an episode has ``is_success`` (bool) and ``outcome``
    (str); every ``info`` of a step has ``reward_terms``.
    """

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[State, dict[str, Any]]:
        """Begin an episode."""

    def step(self, action: NDArray[np.float32]) -> tuple[State, float, bool, bool, dict[str, Any]]:
        """Return state, reward, terminated, truncated and info after one control step."""

    def close(self) -> None:
        """Free everything."""


class Robots(Protocol):
    """A Gymnasium vector environment that begins episodes when it is told to.

    A robot whose episode is over stands still until ``reset`` with a ``reset_mask`` begins its next
    one. The infos of a step in which episodes end hold ``is_success`` and ``outcome`` of each.
    """

    num_envs: int

    def reset(
        self, *, seed: list[int | None], options: dict[str, Any]
    ) -> tuple[State, dict[str, Any]]:
        """Begin episodes and return the states of all robots, shape (n, m)."""

    def step(
        self, actions: NDArray[np.float32]
    ) -> tuple[State, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Return states, rewards, terminated, truncated and infos after one control step."""
