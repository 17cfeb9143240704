"""The policy's state: free ranges, the two previous actions, the heading error (section 4.1)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

N_EXTRAS = 3
"""Entries after the ranges: two previous actions and the heading error."""

MIDDLE_RANGE = 2.0
"""Range that is neither near nor far for the networks [m]."""


@dataclass(frozen=True)
class ObservationLayout:
    """Where things stand in the state vector.

    Attributes:
        n_sectors: Number of ranges (paper: 32).
    """

    n_sectors: int = 32

    @property
    def size(self) -> int:
        """Length of the state (paper: 35)."""
        return self.n_sectors + N_EXTRAS

    def bounds(
        self, max_range: float, limit: float
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the lowest and the highest state.

        Args:
            max_range: Largest range [m].
            limit: Largest yaw rate [rad/s].
        """
        # One step of float32 above pi: a heading error of pi in float64 rounds up.
        half_turn = np.nextafter(np.float32(np.pi), np.float32(4.0))
        high = np.array([max_range] * self.n_sectors + [limit, limit, half_turn], dtype=np.float32)
        low = -high
        low[: self.n_sectors] = 0.0
        return low, high

    def scale(self, limit: float) -> NDArray[np.float32]:
        """Return the numbers a, b, c, d of the networks' input, float32, shape (4, size).

        ``(a + b state) / (c + d state)`` takes a state into -1 to 1. Ranges are bent: 1 at contact,
        0 at ``MIDDLE_RANGE``, towards -1 in the open, since a decimetre matters near the body and
        not ten metres away (assumption).

        Args:
            limit: Largest yaw rate [rad/s].
        """
        near = np.array([[MIDDLE_RANGE], [-1.0], [MIDDLE_RANGE], [1.0]])
        straight = np.array([[0.0] * 3, [1 / limit, 1 / limit, 1 / np.pi], [1.0] * 3, [0.0] * 3])
        return np.hstack([np.repeat(near, self.n_sectors, axis=1), straight]).astype(np.float32)


def observation(
    ranges: NDArray[np.floating], previous_steering: tuple[float, float], heading_error: float
) -> NDArray[np.float32]:
    """Return the state in SI units.

    Args:
        ranges: Finite free ranges [m], shape (n,), sector 0 first.
        previous_steering: The last two executed yaw rates, newest first [rad/s].
        heading_error: Bearing of the goal relative to the heading [rad].

    Returns:
        State, float32, shape (n + 3,).
    """
    state = np.empty(len(ranges) + N_EXTRAS, dtype=np.float32)
    state[:-N_EXTRAS] = ranges
    state[-N_EXTRAS:] = (*previous_steering, heading_error)
    return state
