"""How a trained policy drives: its best actions, or these with a noise, held as long as it says.

A policy that sees one scan alone can balance before an obstacle: to its left it would turn right,
to its right left, and between both it stands for ever. A little noise ends that.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rl.policy import Policy

DRIVING_NOISE = "driving_noise"
"""Key of a policy's description under which the noise that it drives with stands: the standard
deviation of normal noise on the actions' shares."""


DRIVING_REPEAT = "driving_repeat"
"""Key of a policy's description under which the number of control steps stands that it holds an
action for when it drives; a policy without it decides in every step."""


def driving_repeat(policy: Policy) -> int:
    """Return the number of control steps that a policy holds an action for when it drives."""
    return int(policy.info.get(DRIVING_REPEAT, 1))


def driving_noise(policy: Policy) -> float:
    """Return the standard deviation of the noise that a policy drives with, in shares."""
    return float(policy.info.get(DRIVING_NOISE, 0.0))


def driven_many(
    policy: Policy, observations: NDArray[np.float32], rngs: Sequence[np.random.Generator]
) -> NDArray[np.float64]:
    """Return what robots drive with: the best actions, noisy where the policy keeps noise.

    Args:
        policy: Policy.
        observations: Observations, float32, shape (n, n_observations).
        rngs: Generator of each robot; a policy without noise draws nothing.

    Returns:
        Shares from -1 to 1, shape (n, n_actions).
    """
    shares, sigma = policy.best_many(observations), driving_noise(policy)
    if sigma:
        drawn = [rng.standard_normal(policy.actions.size) for rng in rngs]
        shares = np.clip(shares + sigma * np.array(drawn).reshape(shares.shape), -1.0, 1.0)
    return shares


def driven(
    policy: Policy, observation: NDArray[np.float32], rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return what one robot drives with, shares from -1 to 1, shape (n_actions,).

    Args:
        policy: Policy.
        observation: Observation, float32, shape (n_observations,).
        rng: Draws of the noise.
    """
    if driving_noise(policy):
        return driven_many(policy, observation[None], [rng])[0]
    return policy.best(observation)
