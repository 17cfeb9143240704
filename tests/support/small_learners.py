"""Training of small learners, and batches to learn from, for the tests of learners."""

import numpy as np
import torch

from rl.spaces import steering_actions, steering_observations
from rl.training import EpisodeSpec, play
from tests.support.known_environments import TurnToGoal

OBSERVATIONS, ACTIONS = steering_observations(4, 10.0, 0.5), steering_actions(0.5)


def train(learner, environment, iterations, episodes, repeat=1):
    """Let a learner play and learn; return the figures of the last iteration."""
    rng = np.random.default_rng(5)
    for n in range(iterations):
        policy = learner.behaviour_policy()
        played = [
            play(environment, policy, repeat, EpisodeSpec(0, (n, k))) for k in range(episodes)
        ]
        figures = learner.update(played, rng)
    return figures


def share_facing_the_goal(policy):
    """Return the share of 20 new episodes in which a policy turns to the goal."""
    episodes = [
        play(TurnToGoal(), policy, 1, EpisodeSpec(0, (9, k)), explore=False) for k in range(20)
    ]
    return np.mean([episode.is_success for episode in episodes])


def batch(rows=8, reward=1.0, terminated=0.0):
    """Return transitions between drawn states, all with the same reward and end."""
    rng = np.random.default_rng(3)
    states = rng.uniform(0, 1, (2, rows, 7)).astype(np.float32)
    return {
        "states": torch.from_numpy(states[0]),
        "next_states": torch.from_numpy(states[1]),
        "actions": torch.from_numpy(rng.uniform(-1, 1, (rows, 1)).astype(np.float32)),
        "rewards": torch.full((rows,), reward),
        "terminated": torch.full((rows,), terminated),
    }


def copies(module):
    """Return the parameters of a module as they are now."""
    return [parameter.detach().clone() for parameter in module.parameters()]


def moved(tensors, before):
    """Return whether any of some parameters has changed."""
    return any(bool((a != b).any()) for a, b in zip(tensors, before, strict=True))
