"""Gymnasium's spaces of our specs."""

import gymnasium as gym
import numpy as np

from rl.spaces import ActionSpec, ObservationSpec


def observation_box(observations: ObservationSpec) -> gym.spaces.Box:
    """Return the box of observation vectors in SI units."""
    low, high = observations.bounds()
    return gym.spaces.Box(low, high, dtype=np.float32)


def action_box(actions: ActionSpec) -> gym.spaces.Box:
    """Return the box of actions as shares from -1 to 1."""
    return gym.spaces.Box(-1.0, 1.0, (actions.size,), np.float32)
