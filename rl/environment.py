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
